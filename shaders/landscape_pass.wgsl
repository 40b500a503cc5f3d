// Sky and ground behind everything, along the ray of each pixel. Twin of software/landscape.rs.

struct Landscape {
    // A pixel's ray is forward + right * x + up * y, x and y from -1 to 1.
    right: vec3<f32>,
    // Height of the eye above the ground, in world units.
    eye_height: f32,
    up: vec3<f32>,
    // Distance, in world units, at which haze leaves 1/e of the ground's own light.
    haze: f32,
    forward: vec3<f32>,
    // Brightness factor of the sky.
    scale: f32,
    towards_sun: vec3<f32>,
    ground: vec3<f32>,
    // Perez coefficients A to E, each for x, y and Y.
    perez: array<vec3<f32>, 5>,
    // x, y and Y at the zenith, divided by the distribution there.
    zenith: vec3<f32>,
    // Transform from world space relative to the eye to the sun's clip space.
    light_from_eye: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> landscape: Landscape;

@fragment
fn landscape_color(corner: Corner) -> @location(0) vec4<f32> {
    let ray = unit(landscape.forward + landscape.right * corner.at.x + landscape.up * corner.at.y);
    if !HAS_GROUND || ray.y >= 0.0 || landscape.eye_height <= 0.0 {
        return vec4(encoded(sky_color(ray)), 1.0);
    }
    let away = landscape.eye_height / -ray.y;
    return vec4(encoded(ground_shown(landscape.ground, vec3(0.0, 1.0, 0.0), ray * away)), 1.0);
}

// Light that reaches the eye from ground of some colour, linear.
fn ground_shown(albedo: vec3<f32>, normal: vec3<f32>, from_eye: vec3<f32>) -> vec3<f32> {
    let sun = SUN * (max(dot(normal, landscape.towards_sun), 0.0) * ground_sunlit(from_eye));
    let lit = sun + sky(normal, vec3(0.0, 1.0, 0.0));
    let haze = 1.0 - exp(-length(from_eye) / landscape.haze);
    return mix(albedo * lit, sky_color(vec3(from_eye.x, 0.0, from_eye.z)), haze);
}

fn sky_color(ray: vec3<f32>) -> vec3<f32> {
    if !HAS_SKY {
        let above = mix(HORIZON, ZENITH, smoothstep(0.0, ZENITH_FROM, ray.y));
        return select(above, mix(HORIZON, FLOOR, smoothstep(0.0, FLOOR_FROM, -ray.y)), ray.y < 0.0);
    }
    let direction = unit(vec3(ray.x, max(ray.y, LOWEST), ray.z));
    let to_zenith = max(direction.y, LOWEST);
    let to_sun = clamp(dot(direction, landscape.towards_sun), -1.0, 1.0);
    let a = landscape.perez[0];
    let spread = vec3(1.0) + a * exp(landscape.perez[1] / to_zenith);
    let around = vec3(1.0) + landscape.perez[2] * exp(landscape.perez[3] * acos(to_sun))
        + landscape.perez[4] * (to_sun * to_sun);
    let xyy = landscape.zenith * spread * around;
    let y = max(xyy.y, LOWEST_CHROMATICITY_Y);
    let xyz = vec3(xyy.x / y, 1.0, (1.0 - xyy.x - y) / y) * max(xyy.z, 0.0);
    let light = max(RGB_FROM_XYZ * xyz, vec3(0.0)) * landscape.scale;
    return vec3(1.0) - exp(-light);
}
