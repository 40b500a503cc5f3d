// The effect `wind`: one smooth displacement field moves the trunk, the branches and the pivots of
// leaves; leaves turn about their pivots. Twin of effects/wind.rs.

const TURN: f32 = 6.2831853;

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
}

// One per instance.
@group(2) @binding(1) var<storage, read> sways: array<Sway>;

fn moved_wood(rest: vec3<f32>, instance: u32) -> vec3<f32> {
    return rest + sway_offset(rest, sways[instance]);
}

// Upper bound on the length of a displacement.
fn sway_reach(instance: u32) -> f32 {
    let sway = sways[instance];
    let lowered = BEND_DESCENT * dot(sway.bend, sway.bend) / sway.height;
    return length(vec2(length(sway.bend), lowered)) + abs(sway.branches) * length(vec2(1.0, BRANCH_LIFT));
}

fn moved_leaf(pivot: vec3<f32>, offset: vec3<f32>, normal: vec3<f32>, leaf: u32, instance: u32) -> Moved {
    let sway = sways[instance];
    let mixed = leaf * HASH_MULTIPLIER;
    let own = vec3(f32(mixed >> 22u), f32((mixed >> 12u) % PHASE_STEPS), f32((mixed >> 2u) % PHASE_STEPS)) / f32(PHASE_STEPS);
    let waves = sin((sway.phases.zw + own.xy) * TURN);
    let angle = sway.flutter * dot(vec2(FLUTTER_SHARE_A, FLUTTER_SHARE_B), waves);
    let around = own.z * TURN;
    let axis = normalize(vec3(cos(around), FLUTTER_TILT, sin(around)));
    return Moved(pivot + sway_offset(pivot, sway) + rotated(offset, axis, angle), rotated(normal, axis, angle));
}

fn sway_offset(point: vec3<f32>, sway: Sway) -> vec3<f32> {
    let height = clamp((point.y - sway.base) / sway.height, 0.0, 1.0);
    let lowered = BEND_DESCENT * dot(sway.bend, sway.bend) / sway.height * height * height * height;
    let out = (point.xz - sway.axis) / sway.radius;
    let reach = sway.branches * min(length(out), 1.0) * height;
    let place = (point - vec3(sway.axis.x, sway.base, sway.axis.y)) / sway.height;
    let along = sin((sway.phases.x - dot(place, BRANCH_WAVE_ALONG)) * TURN);
    let up = sin((sway.phases.y - dot(place, BRANCH_WAVE_UP)) * TURN);
    return sway.bend * (height * height) + sway.along * (reach * along) + vec3(0.0, reach * BRANCH_LIFT * up - lowered, 0.0);
}

// Rotates v about a unit axis by an angle in radians (Rodrigues' formula).
fn rotated(v: vec3<f32>, axis: vec3<f32>, angle: f32) -> vec3<f32> {
    let cosine = cos(angle);
    return v * cosine + cross(axis, v) * sin(angle) + axis * dot(axis, v) * (1.0 - cosine);
}
