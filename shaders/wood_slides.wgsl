// Vertices of wood that slide to others; twin of wood/slide.rs.

struct WoodCorner {
    @builtin(instance_index) instance: u32,
    @builtin(vertex_index) vertex: u32,
}

struct SlidingWood {
    position_xy: u32,
    // Position along z, and the normal or the centre line of a ribbon.
    position_z_normal: u32,
    uv: u32,
    look: u32,
    // Vertex that it slides to, and half of a ribbon's width over its stem's.
    parent_half: u32,
    // Number of the stem, and the upper half of the error from which on the vertex is where its
    // parent is.
    stem_threshold: u32,
}

struct Stem {
    width: f32,
    // How far the stem is widened over the error, a byte for each of SWELLS ratios of the error to
    // the width.
    swells: array<u32, 4>,
}

@group(0) @binding(14) var<storage, read> wood: array<SlidingWood>;
@group(0) @binding(15) var<storage, read> stems: array<Stem>;

// The vertex on its way at an error: where it is, and those that it slides to one after another.
// They may be on different limbs; `number` is the record whose wind moves them.
fn wood_vertex(corner: WoodCorner, error: f32, number: u32) -> WoodVertex {
    let own = looks[wood[corner.vertex].look];
    var vertex: WoodVertex;
    vertex.share = 1.0;
    vertex.material = own.material;
    vertex.rect = vec4(own.shown_low, own.shown);
    var at = corner.vertex;
    var weight = 1.0;
    for (var slides = 0u; slides <= MAX_SLIDES + 1u && weight > 0.0; slides++) {
        let bits = wood[at];
        let threshold = bitcast<f32>(bits.stem_threshold & 0xffff0000u);
        // Over the last part below its threshold, the vertex slides.
        let share = clamp(error / threshold * (1.0 / SLIDE) - (1.0 / SLIDE - 1.0), 0.0, 1.0);
        let here = weight * (1.0 - share);
        if here > 0.0 {
            let look = looks[bits.look];
            let normal = normal_of(bits.position_z_normal);
            let stem = bits.stem_threshold & 0xffffu;
            let rest = grid_point(bits.position_xy, bits.position_z_normal, packing.wood_step, look);
            let carry = stem_carry(stem, rest, number);
            let turned = turned_by(carry, normal);
            vertex.rest += here * rest;
            vertex.shift += here * carried_by(carry, rest);
            if bits.parent_half >> 24u == 0u {
                vertex.widened += here * widening(stem, error) * turned;
                vertex.normal += here * turned;
            } else {
                vertex.across += here * half_of_ribbon(bits.parent_half >> 24u, stem, error) * turned;
            }
            vertex.uv += here * uv_of(bits.uv, look);
            vertex.color += here * look.color;
        }
        weight *= share;
        at = bits.parent_half & 0xffffffu;
    }
    return vertex;
}

// Half of the width that a ribbon is drawn with: 0 while the tube is drawn.
fn half_of_ribbon(code: u32, stem: u32, error: f32) -> f32 {
    let width = stems[stem].width;
    let ratio = error / width;
    let half = exp2(f32(code) / HALF_STEPS + LEAST_HALF) * width;
    let breadth = select(1.0, ratio * (1.0 + swell_at(stem, ratio)), ratio > 1.0);
    return select(half * breadth, 0.0, error < RIBBON * width);
}

// How far a stem's vertices are drawn outside the surface, along their normals.
fn widening(stem: u32, error: f32) -> f32 {
    return error * swell_at(stem, error / stems[stem].width);
}

// How far a stem is widened over the error, given their ratio.
fn swell_at(stem: u32, error_ratio: f32) -> f32 {
    // The bits of a number rise with its logarithm, linear between powers of two.
    let above = bitcast<u32>(max(error_ratio, LEAST_SWELL)) - bitcast<u32>(LEAST_SWELL);
    let ratio = min(f32(above) / 4194304.0, f32(SWELLS - 1u));
    let step = min(u32(ratio), SWELLS - 2u);
    return mix(swell(stem, step), swell(stem, step + 1u), ratio - f32(step));
}

fn swell(stem: u32, step: u32) -> f32 {
    let byte = (stems[stem].swells[step / 4u] >> (8u * (step % 4u))) & 0xffu;
    return (f32(byte) - NO_SWELL) / SWELL_STEPS;
}
