// Motion vectors of sky and ground, along the ray of each pixel. Twin of render/landscape_motion.rs.

struct Rays {
    // A pixel's ray is forward + right * x + up * y, x and y from -1 to 1.
    right: vec3<f32>,
    // Of the eye over the ground.
    eye_height: f32,
    up: vec3<f32>,
    forward: vec3<f32>,
    // From the eye to the clip space of the frame before.
    before_from_eye: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> rays: Rays;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) at: vec2<f32>,
}

// One triangle over the whole picture.
@vertex
fn landscape_corner(@builtin(vertex_index) corner: u32) -> Corner {
    let at = vec2(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0);
    return Corner(vec4(at, 0.0, 1.0), at);
}

@fragment
fn landscape_motion(corner: Corner) -> @location(0) vec2<f32> {
    let ray = rays.forward + rays.right * corner.at.x + rays.up * corner.at.y;
    // The sky is at infinity. The place on the ground is ray * eye_height / -ray.y, here times -ray.y.
    var place = vec4(ray, 0.0);
    if HAS_GROUND && ray.y < 0.0 && rays.eye_height > 0.0 {
        place = vec4(ray * rays.eye_height, -ray.y);
    }
    let before = rays.before_from_eye * place;
    if before.w <= 0.0 {
        // It was behind the eye.
        return vec2(0.0);
    }
    return (corner.at - before.xy / before.w) * vec2(0.5, -0.5);
}
