// Impostors of plants of one model: a sprite for each plant, from pictures of the model of which
// the three around the direction to the eye are blended, or mixed pixel by pixel where it is small.
// Twin of software/sprite.rs.

@group(0) @binding(10) var<uniform> impostor: Impostor;
// Colour and coverage.
@group(0) @binding(11) var colors: texture_2d_array<f32>;
// Mean normal to the right and up, depth, and a code of the part towards the viewer.
@group(0) @binding(12) var surfaces: texture_2d_array<f32>;
@group(0) @binding(13) var clamping: sampler;

struct Sprite {
    @builtin(position) clip: vec4<f32>,
    // On the plane through the centre that faces the eye, relative to the centre, at the plant's
    // own size.
    @location(0) at: vec3<f32>,
    // The same in pixels along the sides of the sprite.
    @location(1) at_px: vec2<f32>,
    // Position of the eye relative to the centre, and unit vectors towards the sun and upwards.
    @location(2) @interpolate(flat) eye: vec3<f32>,
    @location(3) @interpolate(flat) towards_sun: vec3<f32>,
    @location(4) @interpolate(flat) upwards: vec3<f32>,
    // Pictures around the direction to the eye, their directions and weights.
    @location(5) @interpolate(flat) layers: vec3<u32>,
    @location(6) @interpolate(flat) weights: vec3<f32>,
    @location(7) @interpolate(flat) towards_0: vec3<f32>,
    @location(8) @interpolate(flat) towards_1: vec3<f32>,
    @location(9) @interpolate(flat) towards_2: vec3<f32>,
    // Mip level, and part of its coverage that a sprite keeps which is drawn larger than it is.
    @location(10) @interpolate(flat) level: f32,
    @location(11) @interpolate(flat) kept: f32,
    @location(12) @interpolate(flat) instance: u32,
}

@vertex
fn impostor_corner(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Sprite {
    let instance = instances[number];
    let placed = surface_of(number, instance);
    var sprite: Sprite;
    sprite.instance = number;
    sprite.towards_sun = placed.towards_sun;
    sprite.upwards = placed.upwards;
    sprite.eye = placed.eye - impostor.center;
    let distance = length(sprite.eye);
    let towards = sprite.eye / distance;
    let axes = axes_of(towards);
    let middle = on_screen(vec3(0.0), instance);
    let across = length(on_screen(axes[0] * impostor.radius, instance) - middle);
    let along = length(on_screen(axes[1] * impostor.radius, instance) - middle);
    let own_px = 2.0 * max(across, along);
    let enlarged = max(LEAST_PX / own_px, 1.0);
    let diameter_px = max(own_px, LEAST_PX);
    sprite.kept = 1.0 / (enlarged * enlarged);
    sprite.level = max(log2(impostor.texels / diameter_px) - SHARPER_LEVELS, 0.0);
    let lattice = around(sprite.eye);
    sprite.layers = lattice.layers;
    sprite.weights = lattice.weights;
    sprite.towards_0 = direction(lattice.layers.x);
    sprite.towards_1 = direction(lattice.layers.y);
    sprite.towards_2 = direction(lattice.layers.z);
    // The outline of the sphere, on the plane through its centre.
    let outline = distance * inverseSqrt(max(pow2(distance) - pow2(impostor.radius), 0.01 * pow2(distance)));
    let reach = impostor.radius * outline * enlarged + sway_reach(number);
    let sign = vec2(select(-1.0, 1.0, corner == 1u || corner == 2u), select(-1.0, 1.0, corner >= 2u));
    let drawn = (axes[0] * sign.x + axes[1] * sign.y) * reach;
    sprite.at = drawn / enlarged;
    sprite.at_px = sign * (0.5 * diameter_px * reach / (enlarged * impostor.radius));
    // The sprite is drawn before the crown, so that nothing within the crown cuts it.
    let to_eye = sprite.eye - drawn;
    let away = length(to_eye);
    let pulled = drawn + to_eye * (min(impostor.radius, MOST_PULL * away) / away);
    sprite.clip = frame.clip_from_anchor * vec4(in_anchor_space(impostor.center + pulled, instance), 1.0);
    return sprite;
}

// Place in the picture, in pixels from its middle.
fn on_screen(from_center: vec3<f32>, instance: Instance) -> vec2<f32> {
    let clip = frame.clip_from_anchor * vec4(in_anchor_space(impostor.center + from_center, instance), 1.0);
    return clip.xy / clip.w * frame.half_size_px;
}

// is_deep: whether the depth of the pictures is followed.
fn seen(sprite: Sprite, is_deep: bool) -> Seen {
    let ray = normalize(sprite.at - sprite.eye);
    let rest = impostor.center + sprite.at;
    let shift = moved_wood(rest, sprite.instance) - rest;
    let origin = sprite.at - shift;
    var sum = Seen();
    if !is_deep {
        // One picture for each cell of about a pixel, as often as it weighs, on one mip level.
        let cell = vec3(vec2<i32>(floor(sprite.at_px)), seed_of(sprite) + 2);
        let draw = hash(cell);
        let level = floor(sprite.level + fract(draw * 61.0));
        let is_first = draw < sprite.weights.x;
        let is_second = !is_first && draw < sprite.weights.x + sprite.weights.y;
        let layer = select(select(sprite.layers.z, sprite.layers.y, is_second), sprite.layers.x, is_first);
        let towards = select(select(sprite.towards_2, sprite.towards_1, is_second), sprite.towards_0, is_first);
        add_picture(&sum, layer, 1.0, towards, origin, ray, level, false);
        return scaled(sum, sprite, shift);
    }
    add_picture(&sum, sprite.layers.x, sprite.weights.x, sprite.towards_0, origin, ray, sprite.level, is_deep);
    add_picture(&sum, sprite.layers.y, sprite.weights.y, sprite.towards_1, origin, ray, sprite.level, is_deep);
    add_picture(&sum, sprite.layers.z, sprite.weights.z, sprite.towards_2, origin, ray, sprite.level, is_deep);
    return scaled(sum, sprite, shift);
}

// Means of sums.
fn scaled(sum: Seen, sprite: Sprite, shift: vec3<f32>) -> Seen {
    let one_over = 1.0 / max(sum.coverage, 1e-6);
    return Seen(
        sum.color * one_over, sum.coverage * sprite.kept, sum.normal * one_over, sum.leaf * one_over,
        sum.hit * one_over, shift,
    );
}

// Number by which the samples of plants differ: a plant without leaves has its seed in the place of
// their numbers.
fn seed_of(sprite: Sprite) -> i32 {
    let instance = instances[sprite.instance];
    return i32(select(0u, instance.first_partial << 2u, far_share(instance) >= 1.0));
}

// Samples that the sprite covers.
fn samples_of(sprite: Sprite, shown: Seen) -> u32 {
    let share = far_share(instances[sprite.instance]);
    let seed = seed_of(sprite);
    let cell = vec2<i32>(floor(sprite.at_px));
    let turn = u32(hash(vec3(cell, seed + 1)) * f32(SAMPLES)) << 16u;
    return covered_samples(shown.coverage, hash(vec3(cell, seed)), turn, SAMPLES) & far_samples(sprite.clip.xy, share, SAMPLES);
}

// Light reflected to the eye by many white surfaces, linear. Twin of the function in
// software/light.rs.
fn reflected_by_many(lit: Lit) -> vec3<f32> {
    let open = INNERMOST + (1.0 - INNERMOST) * smoothstep(INNERMOST_RADIUS, 1.0, length(lit.in_crown));
    let sun = SUN * lit.sunlit;
    let variance = variance_along(lit.towards_sun, lit);
    let cosine = dot(lit.normal, lit.towards_sun);
    if !lit.is_leaf {
        return (sun * spread_light(cosine, variance) + sky(lit.normal, lit.upwards)) * open;
    }
    let outwards = unit(lit.in_crown * lit.inverse_half_size);
    let own = select(1.0, 1.0 - CROWN_BLEND, CROWN_NORMALS);
    let lean = select(LEAN, CROWN_BLEND, CROWN_NORMALS);
    // Mean of the unit vectors along `own` of a normal and `lean` of the outward direction, from
    // the mean of their squared lengths and its second-order correction.
    let mean_squared = own * own + lean * lean * dot(outwards, outwards) + 2.0 * own * lean * dot(lit.normal, outwards);
    let squared = max(mean_squared, 0.05);
    let bent = own * lean * variance_along(outwards, lit);
    let factor = (1.0 + 1.5 * own * lean * bent / (squared * squared)) * inverseSqrt(squared);
    let leaning = (lit.normal * own + outwards * lean) * factor - outwards * (own * bent / squared * inverseSqrt(squared));
    let facing = spread_light(dot(leaning, lit.towards_sun) + WRAP_LIGHT, variance * pow2(own * factor)) / (1.0 + WRAP_LIGHT);
    var through = THROUGH * spread_light(-cosine, variance);
    if TRANSLUCENCY {
        let against = max(dot(unit(lit.from_eye), lit.towards_sun), 0.0);
        through *= 1.0 + GLOW * pow(against, GLOW_SHARPNESS);
    }
    return (sun * (vec3(facing) + through) + sky(leaning, lit.upwards)) * open;
}

// Variance of the normals along a direction, were they spread as those of a hemisphere around the
// direction to the eye: along it a quarter of that across it.
fn variance_along(axis: vec3<f32>, lit: Lit) -> f32 {
    let spread = max(1.0 - dot(lit.normal, lit.normal), 0.0) / 9.0;
    return spread * (4.0 - 3.0 * pow2(dot(unit(lit.from_eye), axis)));
}

// Mean of max(x, 0) over numbers spread evenly around `mean`, as cosines of the normals of a
// hemisphere are, with a variance.
fn spread_light(mean: f32, variance: f32) -> f32 {
    let reach = sqrt(3.0 * variance);
    return select(pow2(mean + reach) / (4.0 * max(reach, 1e-6)), max(mean, 0.0), abs(mean) >= reach);
}

fn shaded_sprite(sprite: Sprite, shown: Seen) -> vec4<f32> {
    let moved = shown.hit + shown.shift;
    let position = impostor.center + moved;
    var lit = Lit(
        shown.normal,
        moved - sprite.eye,
        (position - crown.center_local) * crown.inverse_half_size,
        crown.inverse_half_size,
        sprite.towards_sun,
        sprite.upwards,
        true,
        true,
        sunlit(position, sprite.instance),
    );
    var light = reflected_by_many(lit);
    if shown.leaf < 1.0 {
        lit.is_leaf = false;
        light = mix(reflected_by_many(lit), light, shown.leaf);
    }
    let color = select(vec3(0.9, 0.3, 0.0), tinted(shown.color * light, sprite.instance), COLORING == COLORING_PICTURE);
    return vec4(encoded(color), 1.0);
}

// Depth of what is seen.
fn depth_of(sprite: Sprite, shown: Seen) -> f32 {
    let place = in_anchor_space(impostor.center + shown.hit + shown.shift, instances[sprite.instance]);
    let clip = frame.clip_from_anchor * vec4(place, 1.0);
    return clamp(clip.z / clip.w, 0.0, 1.0);
}

struct Deep {
    @location(0) color: vec4<f32>,
    @builtin(sample_mask) samples: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn impostor_flat(sprite: Sprite) -> Shaded {
    let shown = seen(sprite, false);
    let samples = samples_of(sprite, shown);
    if samples == 0u {
        discard;
    }
    return Shaded(shaded_sprite(sprite, shown), samples);
}

@fragment
fn impostor_deep(sprite: Sprite) -> Deep {
    let shown = seen(sprite, true);
    let samples = samples_of(sprite, shown);
    if samples == 0u {
        discard;
    }
    return Deep(shaded_sprite(sprite, shown), samples, depth_of(sprite, shown));
}
