// Lighting of surfaces: one sun, a sky, and a crown that shades its own interior. Twin of
// software/light.rs. Everything is in local space, including the directions of the sun and upwards.

// True if the target's format is not sRGB: the shader then encodes linear light as sRGB.
override ENCODE_SRGB: bool = false;

struct Lit {
    normal: vec3<f32>,
    // From the eye to the surface.
    from_eye: vec3<f32>,
    // Offset from the crown's centre; its length is 1 on the ellipsoid inscribed in the crown's
    // box.
    in_crown: vec3<f32>,
    inverse_half_size: vec3<f32>,
    towards_sun: vec3<f32>,
    upwards: vec3<f32>,
    is_leaf: bool,
    is_two_sided: bool,
    // Fraction of the sun's light that arrives.
    sunlit: f32,
}

// Light reflected to the eye by a white surface, linear.
fn reflected(lit: Lit) -> vec3<f32> {
    let is_turned = lit.is_two_sided && dot(lit.normal, lit.from_eye) > 0.0;
    let normal = unit(select(lit.normal, -lit.normal, is_turned));
    let open = INNERMOST + (1.0 - INNERMOST) * smoothstep(INNERMOST_RADIUS, 1.0, length(lit.in_crown));
    let cosine = dot(normal, lit.towards_sun);
    let sun = SUN * lit.sunlit;
    if !lit.is_leaf {
        return (sun * max(cosine, 0.0) + sky(normal, lit.upwards)) * open;
    }
    let outwards = unit(lit.in_crown * lit.inverse_half_size);
    let leaning = unit(select(normal + outwards * LEAN, mix(normal, outwards, CROWN_BLEND), CROWN_NORMALS));
    let facing = max((dot(leaning, lit.towards_sun) + WRAP_LIGHT) / (1.0 + WRAP_LIGHT), 0.0);
    var through = THROUGH * max(-cosine, 0.0);
    if TRANSLUCENCY {
        let against = max(dot(unit(lit.from_eye), lit.towards_sun), 0.0);
        through *= 1.0 + GLOW * pow(against, GLOW_SHARPNESS);
    }
    return (sun * (vec3(facing) + through) + sky(leaning, lit.upwards)) * open;
}

fn sky(normal: vec3<f32>, upwards: vec3<f32>) -> vec3<f32> {
    return mix(GROUND, SKY, dot(normal, upwards) * 0.5 + 0.5);
}

fn unit(v: vec3<f32>) -> vec3<f32> {
    let length_squared = dot(v, v);
    return select(vec3(0.0), v * inverseSqrt(length_squared), length_squared > 0.0);
}

// Colour of the backdrop at a height from 0 (bottom of the picture) to 1 (top), linear.
fn backdrop_color(height: f32) -> vec3<f32> {
    let above = mix(HORIZON, ZENITH, (height - HORIZON_HEIGHT) / (1.0 - HORIZON_HEIGHT));
    let below = mix(FLOOR, HORIZON, smoothstep(0.0, 1.0, height / HORIZON_HEIGHT));
    return select(above, below, height < HORIZON_HEIGHT);
}

fn encoded(linear: vec3<f32>) -> vec3<f32> {
    if !ENCODE_SRGB {
        return linear;
    }
    let c = clamp(linear, vec3(0.0), vec3(1.0));
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3(0.0031308));
}
