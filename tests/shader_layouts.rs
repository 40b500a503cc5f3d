//! Rust structs have the layout that WGSL expects: the offset of every member and the size of every
//! struct are compared with the parsed shader source.
#![cfg(all(feature = "render", feature = "simplify"))]

use foliage_lod::{
    Look,
    draw::{
        Tint, Variant,
        records::{
            CardRecord, CrownRecord, Event, FrameRecord, GroundRecord, ImpostorRecord, InstanceRecord, LandscapeRecord,
            LookRecord, MaterialRecord, MotionRays, PackedCorner, PackedLeaf, PackingRecord, SlidingWood, StemRecord,
            Tone, bindings,
        },
        shaders,
    },
    effects::{Effects, Shadow, Sky, Sway},
    internals::capture::{self, MaskHeader, Params},
    simplify::{AlphaTest, Coverage},
};
use naga::{Module, TypeInner};
use std::mem::offset_of;

fn parsed(wgsl: &str) -> Module {
    let module = naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|error| panic!("{}", error.emit_to_string(wgsl)));
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    validator.validate(&module).unwrap();
    module
}

/// Names and offsets of the members, and the size of the struct.
fn layout(module: &Module, name: &str) -> (Vec<(String, usize)>, usize) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    match found.map(|(_, ty)| &ty.inner) {
        Some(TypeInner::Struct { members, span }) => {
            let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
            (members.iter().map(member).collect(), *span as usize)
        }
        other => panic!("{name} is {other:?}"),
    }
}

macro_rules! assert_layout {
    ($module:expr, $rust:ty, $wgsl:literal, [$($field:ident),*]) => {
        let expected = vec![$((stringify!($field).to_string(), offset_of!($rust, $field))),*];
        assert_eq!(layout($module, $wgsl), (expected, size_of::<$rust>()), $wgsl);
    };
}

#[test]
fn every_struct_of_the_fragment_pass_lies_in_memory_as_in_rust() {
    let module = parsed(&capture::wgsl());
    assert_layout!(&module, Params, "Params", [resolution, capacity]);
    assert_layout!(&module, AlphaTest, "AlphaTest", [u, v, q, anchor, mask]);
    assert_layout!(&module, MaskHeader, "MaskHeader", [first_word, width, height, wrap]);
    assert_layout!(&module, Coverage, "Coverage", [pixel, triangle]);
    let (members, _) = layout(&module, "Fragments");
    assert_eq!(members[1], ("entries".to_string(), size_of::<u32>()));
}

#[test]
fn the_parts_for_engines_need_no_more_than_the_bindings_that_they_name() {
    let bindings = "\
@group(0) @binding(0) var<storage, read> events: array<Event>;
@group(0) @binding(1) var<storage, read> sways: array<Sway>;
@group(0) @binding(2) var limbs: texture_2d<u32>;
";
    let module = parsed(&(shaders::engine_parts() + bindings));
    assert_layout!(&module, Event, "Event", [leaf, scale]);
    for name in [
        "scale_in",
        "presence",
        "tiled",
        "cutout_coverage",
        "cutout_dither",
        "mip_level",
        "leaf_turn",
        "moved_leaf",
        "stem_carry",
    ] {
        assert!(module.functions.iter().any(|(_, function)| function.name.as_deref() == Some(name)), "{name}");
    }
    let bindings = "\
@group(0) @binding(0) var<uniform> impostor: Impostor;
@group(0) @binding(1) var colors: texture_2d_array<f32>;
@group(0) @binding(2) var surfaces: texture_2d_array<f32>;
@group(0) @binding(3) var clamping: sampler;
@group(0) @binding(4) var<storage, read> sways: array<Sway>;
@group(0) @binding(5) var limbs: texture_2d<u32>;
";
    let module = parsed(&(shaders::impostor_parts() + bindings));
    assert_layout!(&module, ImpostorRecord, "Impostor", [center, half_side, radius, texels, across, is_whole_sphere]);
}

#[test]
fn every_struct_of_the_passes_that_draw_plants_lies_in_memory_as_in_rust() {
    let look = Look::default();
    for wgsl in Variant::all().flat_map(|variant| {
        let wood = [false, true].map(|slides| shaders::wood_pass(&look, variant, slides));
        wood.into_iter().chain([shaders::leaf_pass(&look, variant)])
    }) {
        let module = parsed(&wgsl);
        assert_layout!(
            &module,
            InstanceRecord,
            "Instance",
            [
                anchor_from_local,
                active_count,
                fraction,
                window,
                leaf_scale,
                first_scale,
                first_partial,
                drawn,
                wood_error
            ]
        );
        assert_layout!(
            &module,
            FrameRecord,
            "Frame",
            [clip_from_anchor, clip_from_anchor_before, light_from_anchor, eye, plants, jitter, half_size_px]
        );
        assert_layout!(
            &module,
            LookRecord,
            "Look",
            [origin, material, color, size, uv_low, uv_size, shown, shown_low, anchor, outline, farther]
        );
        assert_layout!(
            &module,
            PackingRecord,
            "Packing",
            [grid_step, wood_step, quads_per_leaf, first_color, first_look, widths_in_looks, first_outline]
        );
        assert_layout!(&module, CrownRecord, "Crown", [center_local, inverse_half_size, tone, mean]);
        assert_layout!(&module, MaterialRecord, "Material", [base_color, cutoff, layer, wrap, is_two_sided]);
    }
    let all = Variant { wind: true, contrast: true, tone: false, tiles: true, alpha: true, handover: true };
    let module = parsed(&shaders::leaf_pass(&look, all));
    assert_layout!(&module, Tone, "Tone", [mean, kept]);
    let tinted = Look { tints: true, ..look };
    assert_layout!(&parsed(&shaders::leaf_pass(&tinted, all)), Tint, "Tint", [factor, added]);
    assert_layout!(
        &module,
        Sway,
        "Sway",
        [bend, height, along, base, axis, radius, branches, phases, flutter, clock, limbs]
    );
    assert_layout!(&module, PackedCorner, "LeafCorner", [offset_xy, offset_z_normal, uv]);
    assert_layout!(&module, PackedLeaf, "LeafRecord", [pivot_xy, pivot_z_seed, first_event, color_look]);
    assert_layout!(&module, Event, "Event", [leaf, scale]);
    assert_layout!(
        &parsed(&shaders::card_pass(&look, all)),
        CardRecord,
        "CardRecord",
        [center, leaf, half_sides, unit, normal_kept, color, size, first_event, last_event, texels, number]
    );
    let module = parsed(&shaders::wood_pass(&look, all, true));
    assert_layout!(
        &module,
        SlidingWood,
        "SlidingWood",
        [position_xy, position_z_normal, uv, look, parent_half, stem_threshold]
    );
    assert_layout!(&module, StemRecord, "Stem", [width, swells]);
    parsed(&shaders::backdrop_pass());
    let shadowed = Look {
        effects: Effects { shadow: Some(Shadow::default()), sky: Some(Sky::default()), ..Effects::default() },
        ..look
    };
    for wind in [false, true] {
        let variant = Variant { wind, ..Variant::default() };
        for look in [look, shadowed] {
            let module = parsed(&shaders::impostor_pass(&look, variant));
            assert_layout!(
                &module,
                ImpostorRecord,
                "Impostor",
                [center, half_side, radius, texels, across, is_whole_sphere]
            );
            parsed(&shaders::impostor_shadow(&look, variant));
            parsed(&shaders::impostor_motion(&look, variant));
        }
    }
    for variant in Variant::all() {
        parsed(&shaders::leaf_pass(&shadowed, variant));
        parsed(&shaders::leaf_shadow(&look, variant));
        parsed(&shaders::leaf_motion(&look, variant));
        parsed(&shaders::card_pass(&shadowed, variant));
        parsed(&shaders::card_shadow(&look, variant));
        parsed(&shaders::card_motion(&look, variant));
        for slides in [false, true] {
            parsed(&shaders::wood_shadow(&look, variant, slides));
            parsed(&shaders::wood_motion(&look, variant, slides));
        }
    }
    for has_ground in [false, true] {
        let module = parsed(&shaders::landscape_motion(has_ground));
        assert_layout!(&module, MotionRays, "Rays", [right, eye_height, up, forward, before_from_eye]);
    }
    for look in [look, shadowed] {
        let module = parsed(&shaders::landscape_pass(&look));
        assert_layout!(
            &module,
            LandscapeRecord,
            "Landscape",
            [right, eye_height, up, haze, forward, scale, towards_sun, ground, perez, zenith, light_from_eye]
        );
        let module = parsed(&shaders::ground_pass(&look));
        assert_layout!(&module, GroundRecord, "GroundFrame", [clip_from_eye, clip_from_eye_before, jitter, has_colors]);
    }
}

/// Each resource of group 0 to 2 has the binding number that Rust binds it to.
#[test]
fn every_binding_has_the_number_that_rust_gives_it() {
    use bindings::*;
    let expected = [
        ("crown", MODEL, CROWN),
        ("materials", MODEL, MATERIALS),
        ("textures", MODEL, TEXTURES),
        ("filtering", MODEL, SAMPLER),
        ("corners", MODEL, LEAF_CORNERS),
        ("packing", MODEL, PACKING),
        ("leaves", MODEL, LEAVES),
        ("events", MODEL, EVENTS),
        ("looks", MODEL, LOOKS),
        ("extras", MODEL, EXTRAS),
        ("wood", MODEL, WOOD),
        ("stems", MODEL, STEMS),
        ("impostor", MODEL, IMPOSTOR),
        ("colors", MODEL, COLORS),
        ("surfaces", MODEL, SURFACES),
        ("clamping", MODEL, CLAMPING),
        ("instances", FRAME, INSTANCES),
        ("scales", FRAME, SCALES),
        ("frame", FRAME, SHARED),
        ("limbs", MODEL, LIMBS),
        ("cards", MODEL, CARDS),
        ("texels", MODEL, CARD_TEXELS),
        ("tones", EFFECTS, TONES),
        ("sways", EFFECTS, SWAYS),
        ("shadow_map", EFFECTS, SHADOW_MAP),
        ("shadow_sampler", EFFECTS, SHADOW_SAMPLER),
        ("tints", EFFECTS, TINTS),
        ("landscape", MODEL, 0),
        ("ground", FRAME, GROUND),
        ("ground_colors", FRAME, GROUND_COLORS),
        ("ground_slopes", FRAME, GROUND_SLOPES),
        ("ground_sampler", FRAME, GROUND_SAMPLER),
    ];
    let effects = Effects { shadow: Some(Shadow::default()), ..Effects::default() };
    let look = Look { effects, tints: true, ..Look::default() };
    let mut seen = std::collections::HashSet::new();
    for variant in Variant::all() {
        let wood = [false, true].map(|slides| shaders::wood_pass(&look, variant, slides));
        let others = [shaders::leaf_pass, shaders::card_pass, shaders::impostor_pass].map(|wgsl| wgsl(&look, variant));
        for wgsl in wood.into_iter().chain(others).chain([shaders::ground_pass(&look)]) {
            for (_, global) in parsed(&wgsl).global_variables.iter() {
                let (Some(name), Some(binding)) = (&global.name, &global.binding) else { continue };
                let known = expected.iter().find(|(known, ..)| known == name);
                let &(known, group, number) = known.unwrap_or_else(|| panic!("{name} is not bound by Rust"));
                assert_eq!((binding.group, binding.binding), (group, number), "{name}");
                seen.insert(known);
            }
        }
    }
    assert_eq!(seen.len(), expected.len(), "resources that no shader has: {seen:?}");
}

#[test]
fn an_effect_that_is_off_is_not_in_the_shader() {
    let look = Look::default();
    let globals = |variant| {
        let module = parsed(&shaders::leaf_pass(&look, variant));
        let names = module.global_variables.iter().filter_map(|(_, global)| global.name.clone());
        names.filter(|name| ["tones", "sways", "limbs"].contains(&name.as_str())).collect::<Vec<_>>()
    };
    assert!(globals(Variant::default()).is_empty());
    assert!(globals(Variant { alpha: true, ..Variant::default() }).is_empty());
    assert_eq!(globals(Variant { contrast: true, ..Variant::default() }), ["tones"]);
    assert_eq!(globals(Variant { wind: true, ..Variant::default() }), ["sways", "limbs"]);
}
