// Vertices of wood whose thin stems are left out or widened.

struct WoodCorner {
    @builtin(instance_index) instance: u32,
    // Position along x and y; position along z and the normal; texture coordinates; look and width
    // of the stem.
    @location(0) packed: vec4<u32>,
}

// Stems thinner than `least` are drawn at that width.
fn wood_vertex(corner: WoodCorner, least: f32, number: u32) -> WoodVertex {
    let packed = corner.packed;
    let has_width = packing.widths_in_looks == 0u;
    let look = looks[select(packed.w, packed.w & 0xffffu, has_width)];
    let size = exp2(f32((packed.w >> 16u) & 0x7fffu) / WIDTH_STEPS + LEAST_WIDTH) * packing.wood_step;
    let width = select(look.size, select(size, -size, packed.w >> 31u == 1u), has_width);
    let normal = normal_of(packed.y);
    let rest = grid_point(packed.x, packed.y, packing.wood_step, look);
    return WoodVertex(
        rest,
        carried_by(still_carry(rest, number), rest),
        normal * (0.5 * max(least - abs(width), 0.0)),
        vec3(0.0),
        normal,
        uv_of(packed.z, look),
        look.color,
        // The stem that is always drawn covers only as much as it would at its own width.
        select(1.0, min(-width / least, 1.0), width < 0.0),
        look.material,
        vec4(look.shown_low, look.shown),
    );
}
