// One per instance.
@group(2) @binding(1) var<storage, read> sways: array<Sway>;
// See draw/limb_texels.rs.
@group(0) @binding(16) var limbs: texture_2d<u32>;
