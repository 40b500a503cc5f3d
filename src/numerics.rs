//! Where numbers could go wrong, what is done about it, and the test that shows it. Nothing but documentation.
//!
//! Three habits carry most of it. What decides an order is counted in integers: pixels, positions in 1/256 pixel,
//! logarithms in fixed point ([`FixedLog`]). What has to be the same on every machine uses only additions, multiplications,
//! divisions and square roots, which IEEE 754 rounds alike ([`views`]), and takes other functions from `libm`. What comes from
//! outside is checked once, at the door: [`Plant::validate`], [`FoliageModel::validate`], [`SimplifyOptions::validate`].
//! Tests `tests/determinism.rs`: `models_of_the_embedded_species_are_the_same_on_every_machine`,
//! `tests/layers.rs`: `imports_point_downwards_and_crates_stay_in_their_files` (which also refuses the platform's functions).
//!
//! # In the simplification
//!
//! **0 log 0.** A polygon that a view does not see has no term in that view's information. [`FixedLog::log2`] of 0 is 0 and
//! is multiplied by the area 0; no float is involved.
//! Test `src/simplify/information.rs`: `powers_of_two_are_exact_and_zero_counts_as_zero`.
//!
//! **A leaf that no view sees** has error 0, and there are thousands of them: ties go by the pixels in which a leaf stands
//! second, then by index ([`Criterion`]). It goes early and nothing grows for it ([`Compensate`]).
//! Tests `tests/determinism.rs`: `hidden_leaves_go_first_and_add_nothing`,
//! `src/simplify/enlarge.rs`: `a_leaf_that_no_view_saw_adds_nothing_and_neither_does_the_rule_none`.
//!
//! **All leaves coincide, or lie in one plane.** Depths are 32-bit integers with the leaf's index below them in one number,
//! so that equal depths have one order ([`Layers`]). [`Neighbours`] keeps leaves of one centroid in one primitive, else
//! its tree would be as deep as there are leaves.
//! Tests `tests/hard_cases.rs`: `coincident_leaves_are_lost_without_error_and_where_views_decide_without_growth`,
//! `tests/exactness.rs`: `coincident_twins_are_pruned_as_by_the_naive_method`,
//! `src/simplify/neighbours.rs`: `a_hundred_thousand_coincident_leaves_are_removed_in_index_order`.
//!
//! **Leaves without area, and needles.** A triangle is snapped before it is covered, and one whose corners then lie in a line
//! covers nothing ([`raster`]). Nothing grows for a leaf without area.
//! Tests `tests/hard_cases.rs`: `leaves_without_area_are_lost_without_error_and_nothing_grows_for_them`,
//! `src/simplify/raster.rs`: `a_triangle_without_area_covers_nothing`,
//! `tests/fragment_pass.rs`: `leaves_needles_and_shared_edges_cover_the_same_pixels`.
//!
//! **One leaf, two leaves.** The last leaf has no target, and a model of one leaf has no event.
//! Tests `tests/hard_cases.rs`: `one_and_two_leaves_make_sound_models_by_any_options`,
//! `src/simplify/enlarge.rs`: `the_last_leaf_has_no_target`.
//!
//! **Views of one pixel.** Nearly every leaf falls between the pixels; the order is that of the ties, and the same as by the
//! naive method. A cascade never halves below one pixel.
//! Test `tests/hard_cases.rs`: `views_of_one_to_three_pixels_are_pruned_as_by_the_naive_method`.
//!
//! **Wood hides every leaf.** Fragments behind the wood are dropped when views are captured; every leaf is then one that no
//! view sees.
//! Test `tests/hard_cases.rs`: `leaves_that_wood_hides_go_in_their_order_and_change_nothing`.
//!
//! **Coordinates of 1e-6, 1e6, and far from the origin.** Everything is judged in *unit space*, the bounding sphere brought to
//! the unit sphere in `f64` ([`ViewSet`]). Factors that are powers of two change no bit; others round the input itself, so
//! that leaves whose errors tie may change places. A file's node that puts a plant beyond about 170 of its radii would cost
//! it its digits in `f32`: the importer moves it to the origin ([`Imported::origin`]). Instances and cameras are `f64`.
//! Tests `tests/invariance.rs`: `a_node_that_moves_and_scales_the_plant_changes_it_by_rounding_alone`,
//! `a_node_that_scales_the_plant_by_a_power_of_two_changes_no_choice`,
//! `instances_and_camera_moved_and_scaled_together_give_the_same_picture`,
//! `instances_and_camera_moved_and_scaled_together_give_the_same_counts`,
//! `tests/hard_cases.rs`: `plants_a_million_times_smaller_or_larger_are_pruned_and_drawn_alike`,
//! `decimal_factors_of_a_million_change_the_picture_by_rounding_alone`, `a_plant_far_from_the_origin_is_pruned_as_at_the_origin`,
//! `tests/render_models.rs`: `a_plant_far_from_the_origin_looks_as_it_does_there`.
//!
//! **A leaf as near to the wood with one corner as with another.** Where it is attached ([`import`]) must not hang on the
//! last bit: corners that are equally far within 1e-4 count together, by their middle, and distances are exact.
//! Tests `tests/invariance.rs`: `a_node_that_moves_and_scales_the_plant_changes_it_by_rounding_alone`,
//! `src/import/pivot.rs`: `no_point_of_a_triangle_is_nearer_than_the_closest`.
//!
//! **Numbers that are none.** Importers refuse them by index, and [`Plant::validate`] and [`FoliageModel::validate`] wherever
//! they stand, so that nothing behind them has to ask.
//! Tests `tests/hard_cases.rs`: `a_number_that_is_none_is_refused_wherever_it_stands`,
//! `tests/import_hostile.rs`: `positions_that_are_no_numbers_are_refused_by_index`.
//!
//! # At run time
//!
//! **A chain of 100,000 enlargements.** A swap moves bits and computes nothing, so no error can add up, however long the walk
//! ([`Swap`]); [`Timeline`] looks the same bits up without a walk.
//! Tests `tests/extract.rs`: `a_chain_of_100_000_enlargements_is_walked_and_looked_up_exactly`,
//! `tests/hard_cases.rs`: `a_hundred_thousand_enlargements_of_one_leaf_are_undone_to_the_bit`.
//!
//! **An active count that jumps between none and all.** [`Swap::set_active`] walks leaf by leaf to any count; more than all
//! leaves counts as all.
//! Test `tests/hard_cases.rs`: `a_count_that_jumps_between_none_and_all_gets_there_at_once`.
//!
//! **The camera inside the crown, at its centre, or behind.** From inside the bounding sphere its outline is infinite and all
//! leaves are drawn ([`Sight`]); triangles across the near plane are cut, those behind it are gone. A distance of 0 over a
//! radius of 0 counts as 0.
//! Tests `src/extract/lod.rs`: `from_inside_the_crown_everything_is_drawn`,
//! `tests/hard_cases.rs`: `from_inside_a_closed_crown_every_pixel_is_leaf`,
//! `tests/software_pictures.rs`: `leaves_behind_the_eye_vanish_and_one_across_the_near_plane_is_cut`.
//!
//! **far = near.** [`Blend`] would divide by 0: it becomes a step at `near`.
//! Tests `tests/hard_cases.rs`: `a_range_without_width_or_end_is_a_step_or_all`,
//! `src/extract/lod.rs`: `equal_near_and_far_make_a_step_of_the_nearness`.
//!
//! **Fields of view of 1 and 170 degrees.** The outline's size is a ratio of tangents of half the angle, which is finite below
//! 180 degrees; [`Camera`] brings any other angle to a finite one.
//! Tests `tests/hard_cases.rs`: `outlines_in_pixels_follow_the_formula_from_1_to_170_degrees`,
//! `a_card_covers_what_its_angle_says_from_1_to_170_degrees`,
//! `src/render/camera.rs`: `hostile_numbers_still_give_a_finite_camera`.
//!
//! **Wind at 1e7 seconds.** In `f32` a phase would be lost there. [`Wind::at`] takes the time modulo its period in `f64`, and
//! only what is left goes to the GPU.
//! Test `src/effects/wind.rs`: `late_times_move_as_early_ones_and_no_wind_gives_the_rest_pose`.
//!
//! # In stochastic pruning
//!
//! **lambda of 0, 1e-6 and 1.** Laws end in [`lambda::floored`]: not below [`lambda::FLOOR`], where a plant would vanish at once,
//! and not above 1. [`visible_factor`] takes any lambda above 0.
//! Tests `src/stochastic/lambda.rs`: `lambda_stays_within_floor_and_one_whatever_the_numbers`,
//! `tests/hard_cases.rs`: `area_factors_lie_between_1_and_what_keeps_the_surface`.
//!
//! **h towards 1, and h = 1/2.** The power ln(1/2) / ln h is infinite at 1, so h stops one step short of it
//! ([`lambda::from_area`]); [`CookLambda`] stops at 0.999. At h = 1/2 the power is 1.
//! Test `src/stochastic/lambda.rs`: `half_of_the_leaves_stay_at_h`.
//!
//! **r of 0, 1e-12 and 1.** (1 - (1 - r)^(1/lambda)) / r loses all its digits for small r: [`visible_factor`] goes through
//! `ln_1p` and `exp_m1`, and takes the limit 1/lambda below the smallest normal number.
//! Tests `tests/hard_cases.rs`: `area_factors_equal_those_of_four_hundred_digits`,
//! `src/stochastic/area.rs`: `limits_are_met_and_nothing_is_infinite`.
//!
//! **A scene whose plants are all equally far** has a range of distances of 0, by which
//! [`SceneReduction`] would divide: nothing is taken off.
//! Test `src/stochastic/lambda.rs`: `a_scene_takes_most_off_the_farthest_plant_and_nothing_off_the_nearest`.
//!
//! [`Blend`]: crate::extract::lod::Blend
//! [`Camera`]: crate::render::camera::Camera
//! [`Compensate`]: crate::simplify::Compensate
//! [`CookLambda`]: crate::extract::lod::CookLambda
//! [`Criterion`]: crate::simplify::criterion::Criterion
//! [`FixedLog`]: crate::simplify::information::FixedLog
//! [`FixedLog::log2`]: crate::simplify::information::FixedLog::log2
//! [`FoliageModel::validate`]: crate::model::FoliageModel::validate
//! [`Imported::origin`]: crate::import::Imported::origin
//! [`Layers`]: crate::simplify::layers::Layers
//! [`Neighbours`]: crate::simplify::neighbours::Neighbours
//! [`Plant::validate`]: crate::Plant::validate
//! [`SceneReduction`]: crate::stochastic::lambda::SceneReduction
//! [`Sight`]: crate::extract::Sight
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
//! [`visible_factor`]: crate::stochastic::area::visible_factor
