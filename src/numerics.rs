//! Numerical edge cases, how each is handled, and the test that proves it. This module is
//! documentation only.
//!
//! Three principles cover most cases. Decisions about order are made in integers: pixel counts,
//! positions in 1/256 pixel, fixed-point logarithms ([`FixedLog`]). Results that must be identical
//! on every machine use only additions, multiplications, divisions and square roots, which IEEE 754
//! rounds identically everywhere ([`views`]), and take all other functions from `libm`. External
//! data is validated once, on entry: [`Plant::validate`], [`FoliageModel::validate`],
//! [`SimplifyOptions::validate`].
//! Tests `tests/determinism.rs`: `models_of_the_embedded_species_are_the_same_on_every_machine`,
//! `tests/layers.rs`: `imports_point_downwards_and_crates_stay_in_their_files` (which also rejects
//! the platform's math functions).
//!
//! # In the simplification
//!
//! **0 log 0.** A polygon that is invisible in a view contributes no term to that view's
//! information. [`FixedLog::log2`] of 0 is 0 and is multiplied by the area 0; no float is involved.
//! Test `src/simplify/information.rs`: `powers_of_two_are_exact_and_zero_counts_as_zero`.
//!
//! **A leaf that is invisible in every view** has error 0, and there are thousands of them. Ties
//! are broken by the number of pixels in which a leaf is the second from the front, then by index
//! ([`Criterion`]). Such a leaf is pruned early and no other leaf is enlarged for it
//! ([`Compensate`]).
//! Tests `tests/determinism.rs`: `hidden_leaves_go_first_and_add_nothing`,
//! `src/simplify/enlarge.rs`:
//! `a_leaf_that_no_view_saw_adds_nothing_and_neither_does_the_rule_none`.
//!
//! **All leaves coincide, or lie in one plane.** A depth is a 32-bit integer with the leaf's index
//! in the low bits of the same number, so equal depths have a unique order ([`Layers`]).
//! [`Neighbours`] puts all leaves with the same centroid into one primitive; otherwise its tree
//! would be as deep as the number of leaves.
//! Tests `tests/hard_cases.rs`:
//! `coincident_leaves_are_lost_without_error_and_where_views_decide_without_growth`,
//! `tests/exactness.rs`: `coincident_twins_are_pruned_as_by_the_naive_method`,
//! `src/simplify/neighbours.rs`: `a_hundred_thousand_coincident_leaves_are_removed_in_index_order`.
//!
//! **Leaves without area, and needles.** A triangle is snapped to the subpixel grid before coverage
//! is computed, and one whose snapped corners are collinear covers nothing ([`raster`]). No leaf is
//! enlarged for a pruned leaf without area.
//! Tests `tests/hard_cases.rs`:
//! `leaves_without_area_are_lost_without_error_and_nothing_grows_for_them`,
//! `src/simplify/raster.rs`: `a_triangle_without_area_covers_nothing`, `tests/fragment_pass.rs`:
//! `leaves_needles_and_shared_edges_cover_the_same_pixels`.
//!
//! **One leaf, two leaves.** The last leaf has no target, and a model of one leaf has no event.
//! Tests `tests/hard_cases.rs`: `one_and_two_leaves_make_sound_models_by_any_options`,
//! `src/simplify/enlarge.rs`: `the_last_leaf_has_no_target`.
//!
//! **Views of one pixel.** Nearly every leaf falls between the pixel centres, so ties decide the
//! order, which is the same as that of the naive method. A cascade never reduces the resolution
//! below one pixel.
//! Test `tests/hard_cases.rs`: `views_of_one_to_three_pixels_are_pruned_as_by_the_naive_method`.
//!
//! **Wood hides every leaf.** Fragments behind the wood are discarded when views are captured,
//! which makes every leaf invisible in every view.
//! Test `tests/hard_cases.rs`: `leaves_that_wood_hides_go_in_their_order_and_change_nothing`.
//!
//! **Coordinates of 1e-6, 1e6, and far from the origin.** Simplification works in *unit space*, in
//! which the bounding sphere is mapped to the unit sphere in `f64` ([`ViewSet`]). Scaling by a
//! power of two changes no bit; other factors round the input itself, so leaves with tied errors
//! may swap places. A file whose node moves a plant farther than about 170 of its radii from the
//! origin would lose precision in `f32`, so the importer moves the plant to the origin
//! ([`Imported::origin`]). Instances and cameras are `f64`.
//! Tests `tests/invariance.rs`:
//! `a_node_that_moves_and_scales_the_plant_changes_it_by_rounding_alone`,
//! `a_node_that_scales_the_plant_by_a_power_of_two_changes_no_choice`,
//! `instances_and_camera_moved_and_scaled_together_give_the_same_picture`,
//! `instances_and_camera_moved_and_scaled_together_give_the_same_counts`, `tests/hard_cases.rs`:
//! `plants_a_million_times_smaller_or_larger_are_pruned_and_drawn_alike`,
//! `decimal_factors_of_a_million_change_the_picture_by_rounding_alone`,
//! `a_plant_far_from_the_origin_is_pruned_as_at_the_origin`, `tests/render_models.rs`:
//! `a_plant_far_from_the_origin_looks_as_it_does_there`.
//!
//! **A leaf with several corners equally close to the wood.** Its attachment point ([`import`])
//! must not depend on the last bit: corners whose distances agree within 1e-4 are averaged, and the
//! distances are exact.
//! Tests `tests/invariance.rs`:
//! `a_node_that_moves_and_scales_the_plant_changes_it_by_rounding_alone`, `src/import/pivot.rs`:
//! `no_point_of_a_triangle_is_nearer_than_the_closest`.
//!
//! **NaN and infinity.** Importers reject them and report the index, and [`Plant::validate`] and
//! [`FoliageModel::validate`] reject them in any field, so that no later stage needs to check.
//! Tests `tests/hard_cases.rs`: `a_number_that_is_none_is_refused_wherever_it_stands`,
//! `tests/import_hostile.rs`: `positions_that_are_no_numbers_are_refused_by_index`.
//!
//! # At run time
//!
//! **A chain of 100,000 enlargements.** A swap moves bits and computes nothing, so errors cannot
//! accumulate, however long the walk ([`Swap`]); [`Timeline`] looks up the same bits without a
//! walk.
//! Tests `tests/extract.rs`: `a_chain_of_100_000_enlargements_is_walked_and_looked_up_exactly`,
//! `tests/hard_cases.rs`: `a_hundred_thousand_enlargements_of_one_leaf_are_undone_to_the_bit`.
//!
//! **An active count that jumps between none and all.** [`Swap::set_active`] walks leaf by leaf to
//! any count; counts above the number of leaves are clamped to it.
//! Test `tests/hard_cases.rs`: `a_count_that_jumps_between_none_and_all_gets_there_at_once`.
//!
//! **The camera inside the crown, at its centre, or facing away.** Inside the bounding sphere its
//! outline is infinite, and at least half of the leaves are drawn ([`Sight::least_lod`]), all of
//! them by the default policy. Triangles that cross the near plane are clipped, and those behind it
//! are discarded. A distance of 0 divided by a radius of 0 counts as 0.
//! Tests `src/extract/lod.rs`: `from_inside_the_crown_everything_is_drawn`,
//! `from_inside_the_crown_at_least_half_is_drawn_by_any_policy`, `tests/hard_cases.rs`:
//! `from_inside_a_closed_crown_every_pixel_is_leaf`, `tests/software_pictures.rs`:
//! `leaves_behind_the_eye_vanish_and_one_across_the_near_plane_is_cut`.
//!
//! **far = near.** [`Blend`] would divide by 0; instead it becomes a step at `near`.
//! Tests `tests/hard_cases.rs`: `a_range_without_width_or_end_is_a_step_or_all`,
//! `src/extract/lod.rs`: `equal_near_and_far_make_a_step_of_the_nearness`.
//!
//! **Fields of view of 1 and 170 degrees.** The size of the outline depends on the tangent of half
//! the angle, which is finite below 180 degrees; [`LookAt`] clamps every angle to between 0.1 and
//! 175 degrees.
//! Tests `tests/hard_cases.rs`: `outlines_in_pixels_follow_the_formula_from_1_to_170_degrees`,
//! `a_card_covers_what_its_angle_says_from_1_to_170_degrees`,
//! `src/camera.rs`: `hostile_numbers_still_give_a_finite_camera`.
//!
//! **Wind at 1e7 seconds.** An `f32` has no precision left for a phase at that time. [`Wind::at`]
//! reduces the time modulo its period in `f64`, and only the remainder is sent to the GPU.
//! Test `src/effects/wind.rs`: `late_times_move_as_early_ones_and_no_wind_gives_the_rest_pose`.
//!
//! # In stochastic pruning
//!
//! **lambda of 0, 1e-6 and 1.** Every law ends in [`lambda::floored`], which clamps to
//! [`lambda::FLOOR`] (below it a plant would vanish at once) and 1. [`visible_factor`] accepts any
//! lambda above 0.
//! Tests `src/stochastic/lambda.rs`: `lambda_stays_within_floor_and_one_whatever_the_numbers`,
//! `tests/hard_cases.rs`: `area_factors_lie_between_1_and_what_keeps_the_surface`.
//!
//! **h towards 1, and h = 1/2.** The exponent ln(1/2) / ln h is infinite at h = 1, so h is clamped
//! just below it ([`lambda::from_area`]); [`CookLambda`] clamps it to 0.999. At h = 1/2 the
//! exponent is 1.
//! Test `src/stochastic/lambda.rs`: `half_of_the_leaves_stay_at_h`.
//!
//! **r of 0, 1e-12 and 1.** (1 - (1 - r)^(1/lambda)) / r loses all its digits for small r:
//! [`visible_factor`] is computed with `ln_1p` and `exp_m1`, and returns the limit 1/lambda below
//! the smallest normal number.
//! Tests `tests/hard_cases.rs`: `area_factors_equal_those_of_four_hundred_digits`,
//! `src/stochastic/area.rs`: `limits_are_met_and_nothing_is_infinite`.
//!
//! **A scene whose plants are all equally far away** has a distance range of 0, and
//! [`SceneReduction`] would divide by it; instead it leaves lambda unchanged.
//! Test `src/stochastic/lambda.rs`:
//! `a_scene_takes_most_off_the_farthest_plant_and_nothing_off_the_nearest`.
//!
//! [`Blend`]: crate::extract::Blend
//! [`LookAt`]: crate::LookAt
//! [`Compensate`]: crate::simplify::Compensate
//! [`CookLambda`]: crate::extract::CookLambda
//! [`Criterion`]: crate::simplify::criterion::Criterion
//! [`FixedLog`]: crate::simplify::information::FixedLog
//! [`FixedLog::log2`]: crate::simplify::information::FixedLog::log2
//! [`FoliageModel::validate`]: crate::model::FoliageModel::validate
//! [`Imported::origin`]: crate::import::Imported::origin
//! [`Layers`]: crate::simplify::layers::Layers
//! [`Neighbours`]: crate::simplify::neighbours::Neighbours
//! [`Plant::validate`]: crate::Plant::validate
//! [`SceneReduction`]: crate::stochastic::lambda::SceneReduction
//! [`Sight::least_lod`]: crate::extract::Sight::least_lod
//! [`SimplifyOptions::validate`]: crate::simplify::SimplifyOptions::validate
//! [`Swap`]: crate::extract::Swap
//! [`Swap::set_active`]: crate::extract::Swap::set_active
//! [`Timeline`]: crate::model::Timeline
//! [`ViewSet`]: crate::simplify::views::ViewSet
//! [`Wind::at`]: crate::effects::Wind::at
//! [`import`]: crate::import
//! [`lambda::FLOOR`]: crate::stochastic::lambda::FLOOR
//! [`lambda::floored`]: crate::stochastic::lambda::floored
//! [`lambda::from_area`]: crate::stochastic::lambda::from_area
//! [`raster`]: crate::simplify::raster
//! [`views`]: crate::simplify::views
//! [`visible_factor`]: crate::stochastic::visible_factor
