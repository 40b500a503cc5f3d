// The effect `wind`: the trunk bends by a displacement field over height, limbs turn about their
// feet, leaves about their pivots. Twin of effects/wind.rs and effects/limbs.rs.
//
// Declare in your shader `sways: array<Sway>`, one per instance, and the texture `limbs` of
// draw/limb_texels.rs.

const TURN: f32 = 6.2831853;
const STEPS: f32 = 65536.0;

// Motion of one plant at this time, in local space.
struct Sway {
    bend: vec3<f32>,
    height: f32,
    along: vec3<f32>,
    base: f32,
    axis: vec2<f32>,
    radius: f32,
    branches: f32,
    // Phases of the two branch waves and the two leaf waves, in cycles.
    phases: vec4<f32>,
    flutter: f32,
    // Part of the period that has passed for limbs; below 0 without limbs.
    clock: f32,
    // Share of the motion of both levels of limbs.
    limbs: vec2<f32>,
}

// A stem that turns about its foot.
struct Limb {
    foot: vec3<f32>,
    axis: vec3<f32>,
    // Turn for a sway of the outermost branches of 1.
    turn: f32,
    // Cycles per period along the wind and upwards, and phases of both.
    cycles: vec2<f32>,
    phases: vec2<f32>,
    // Limb that it grows on; 0 for level 1.
    below: u32,
}

// Motion of all that rides on a limb: a rotation about its foot, then one about the foot of the
// limb that it grows on, then a displacement. Turns are halves of rotation vectors.
struct Carry {
    foot_1: vec3<f32>,
    turn_1: vec3<f32>,
    foot_2: vec3<f32>,
    turn_2: vec3<f32>,
    shift: vec3<f32>,
}

// How a leaf moves: about its pivot, and with its limb.
struct LeafTurn {
    axis: vec3<f32>,
    angle: f32,
    carry: Carry,
}

fn moved_wood(rest: vec3<f32>, instance: u32) -> vec3<f32> {
    return rest + sway_offset(rest, sways[instance]);
}

// Upper bound on the length of a displacement by sway_offset.
fn sway_reach(instance: u32) -> f32 {
    let sway = sways[instance];
    let lowered = BEND_DESCENT * dot(sway.bend, sway.bend) / sway.height;
    let branches = select(0.0, abs(sway.branches), sway.clock < 0.0);
    return length(vec2(length(sway.bend), lowered)) + branches * length(vec2(1.0, BRANCH_LIFT));
}

fn leaf_turn(leaf: u32, pivot: vec3<f32>, instance: u32) -> LeafTurn {
    let sway = sways[instance];
    let mixed = leaf * HASH_MULTIPLIER;
    let own = vec3(f32(mixed >> 22u), f32((mixed >> 12u) % PHASE_STEPS), f32((mixed >> 2u) % PHASE_STEPS)) / f32(PHASE_STEPS);
    let waves = sin((sway.phases.zw + own.xy) * TURN);
    let angle = sway.flutter * dot(vec2(FLUTTER_SHARE_A, FLUTTER_SHARE_B), waves);
    let around = own.z * TURN;
    let axis = normalize(vec3(cos(around), FLUTTER_TILT, sin(around)));
    if !limbs_move(sway) {
        return LeafTurn(axis, angle, still_carry(pivot, instance));
    }
    let ride = limb_texel(limb_texel(0u).y + leaf / 4u)[leaf % 4u];
    let y = sway.base + f32(ride >> 16u) / STEPS * sway.height;
    return LeafTurn(axis, angle, carry_of(ride & 0xffffu, y, sway));
}

fn moved_leaf(pivot: vec3<f32>, offset: vec3<f32>, normal: vec3<f32>, turn: LeafTurn) -> Moved {
    let position = pivot + rotated(offset, turn.axis, turn.angle);
    return Moved(position + carried_by(turn.carry, position), turned_by(turn.carry, rotated(normal, turn.axis, turn.angle)));
}

fn limbs_move(sway: Sway) -> bool {
    return sway.clock >= 0.0 && any(sway.limbs > vec2(0.0));
}

// Motion of a point that is on no limb.
fn still_carry(point: vec3<f32>, instance: u32) -> Carry {
    var carry = Carry();
    carry.shift = sway_offset(point, sways[instance]);
    return carry;
}

// Motion of what is on a stem of the wood, at a point of it.
fn stem_carry(stem: u32, point: vec3<f32>, instance: u32) -> Carry {
    let sway = sways[instance];
    if !limbs_move(sway) {
        return still_carry(point, instance);
    }
    let pair = limb_texel(limb_texel(0u).x + stem / 8u)[(stem % 8u) / 2u];
    return carry_of((pair >> (16u * (stem % 2u))) & 0xffffu, point.y, sway);
}

// Motion of what is on a limb, attached at a y coordinate.
fn carry_of(limb: u32, y: f32, sway: Sway) -> Carry {
    var carry = Carry();
    carry.shift = bent(y, sway);
    if limb > 0u {
        var first = limb_of(limb);
        if first.below > 0u {
            let share = sway.limbs.y;
            let slope = cross(vec3(0.0, 1.0, 0.0), sway.bend) * (height_of(first.foot.y, sway) / sway.height);
            carry.foot_2 = first.foot;
            carry.turn_2 = half_turn(first, share, sway) + slope * share;
            carry.shift = mix(carry.shift, bent(first.foot.y, sway), share);
            first = limb_of(first.below);
        }
        carry.foot_1 = first.foot;
        carry.turn_1 = half_turn(first, sway.limbs.x, sway);
    }
    return carry;
}

// Half of a limb's turn, as a vector.
fn half_turn(limb: Limb, share: f32, sway: Sway) -> vec3<f32> {
    let waves = sin(fract(limb.cycles * sway.clock + limb.phases) * TURN);
    let along = LIMB_LEAN + (1.0 - LIMB_LEAN) * waves.x;
    let towards = sway.along * along + vec3(0.0, BRANCH_LIFT * waves.y, 0.0);
    return cross(limb.axis, towards) * (0.5 * share * sway.branches * limb.turn);
}

// Displacement of a point at rest.
fn carried_by(carry: Carry, point: vec3<f32>) -> vec3<f32> {
    let second = change(carry.turn_2, point - carry.foot_2);
    let first = change(carry.turn_1, point + second - carry.foot_1);
    return second + first + carry.shift;
}

// A direction or an offset from a point, turned.
fn turned_by(carry: Carry, v: vec3<f32>) -> vec3<f32> {
    let once = v + change(carry.turn_2, v);
    return once + change(carry.turn_1, once);
}

// What Cayley's rotation by half a turn adds to a vector.
fn change(half_turn: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let across = cross(half_turn, v);
    return (across + cross(half_turn, across)) * (2.0 / (1.0 + dot(half_turn, half_turn)));
}

fn limb_texel(number: u32) -> vec4<u32> {
    return textureLoad(limbs, vec2(number % LIMB_COLUMNS, number / LIMB_COLUMNS), 0);
}

fn limb_of(number: u32) -> Limb {
    let a = limb_texel(2u * number);
    let b = limb_texel(2u * number + 1u);
    let at = unpack2x16snorm(a.w);
    let z = 1.0 - abs(at.x) - abs(at.y);
    let folded = at - select(vec2(1.0), vec2(-1.0), at < vec2(0.0)) * max(-z, 0.0);
    return Limb(
        bitcast<vec3<f32>>(a.xyz),
        normalize(vec3(folded, z)),
        bitcast<f32>(b.x),
        vec2(f32(b.y & 0xffffu), f32(b.y >> 16u)),
        vec2(f32(b.z & 0xffffu), f32(b.z >> 16u)) / STEPS,
        b.w,
    );
}

fn height_of(y: f32, sway: Sway) -> f32 {
    return clamp((y - sway.base) / sway.height, 0.0, 1.0);
}

// Displacement by the bend of the trunk at a y coordinate.
fn bent(y: f32, sway: Sway) -> vec3<f32> {
    let height = height_of(y, sway);
    let lowered = BEND_DESCENT * dot(sway.bend, sway.bend) / sway.height * height * height * height;
    return sway.bend * (height * height) - vec3(0.0, lowered, 0.0);
}

// Displacement of a point of the trunk and, without limbs, of a branch or a leaf's pivot.
fn sway_offset(point: vec3<f32>, sway: Sway) -> vec3<f32> {
    let trunk = bent(point.y, sway);
    if sway.clock >= 0.0 {
        return trunk;
    }
    let out = (point.xz - sway.axis) / sway.radius;
    let reach = sway.branches * min(length(out), 1.0) * height_of(point.y, sway);
    let place = (point - vec3(sway.axis.x, sway.base, sway.axis.y)) / sway.height;
    let along = sin((sway.phases.x - dot(place, BRANCH_WAVE_ALONG)) * TURN);
    let up = sin((sway.phases.y - dot(place, BRANCH_WAVE_UP)) * TURN);
    return trunk + sway.along * (reach * along) + vec3(0.0, reach * BRANCH_LIFT * up, 0.0);
}

// Rotates v about a unit axis by an angle in radians (Rodrigues' formula).
fn rotated(v: vec3<f32>, axis: vec3<f32>, angle: f32) -> vec3<f32> {
    let cosine = cos(angle);
    return v * cosine + cross(axis, v) * sin(angle) + axis * dot(axis, v) * (1.0 - cosine);
}
