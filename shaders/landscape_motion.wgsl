// Motion vectors of the sky and the ground, along the ray of each pixel. The uniforms are filled in
// by gpu/landscape_motion.rs.

struct Rays {
    // A pixel's ray is forward + right * x + up * y, x and y from -1 to 1.
    right: vec3<f32>,
    // Height of the eye above the ground, in world units.
    eye_height: f32,
    up: vec3<f32>,
    forward: vec3<f32>,
    // Transform from world space relative to the eye to the previous frame's clip space.
    before_from_eye: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> rays: Rays;

@fragment
fn landscape_motion(corner: Corner) -> @location(0) vec2<f32> {
    let ray = rays.forward + rays.right * corner.at.x + rays.up * corner.at.y;
    // Homogeneous position relative to the eye. The sky is at infinity (w = 0). The point on the
    // ground is ray * eye_height / -ray.y.
    var place = vec4(ray, 0.0);
    if HAS_GROUND && ray.y < 0.0 && rays.eye_height > 0.0 {
        place = vec4(ray * rays.eye_height, -ray.y);
    }
    let before = rays.before_from_eye * place;
    if before.w <= 0.0 {
        // The point was behind the eye in the previous frame.
        return vec2(0.0);
    }
    return (corner.at - before.xy / before.w) * vec2(0.5, -0.5);
}
