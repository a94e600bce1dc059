// The subsystem of each planted bug, decided before any verdict on it was seen.
#include <map>
#include <stdexcept>

#include "tests/mutants/catalogue.h"

namespace tandem::test {

namespace {

using Bug = PlantedBug;

const std::map<Subsystem, std::vector<Bug>>& bugs_of_subsystems() {
    static const std::map<Subsystem, std::vector<Bug>> all{
        {Subsystem::light_sampling,
            {Bug::cosine_dropped, Bug::inverse_pi_dropped, Bug::jacobian_missing, Bug::light_from_behind,
                Bug::next_event_scaled, Bug::light_choice_squared, Bug::triangle_light_uneven,
                Bug::sphere_light_cone_scaled, Bug::cuboid_light_faces_even, Bug::shadow_limit_short,
                Bug::shadow_limit_long, Bug::spot_falloff_linear, Bug::spot_outer_scaled, Bug::point_falloff_linear,
                Bug::sky_sine_missing, Bug::last_light_lost, Bug::light_tree_parents_forgotten,
                Bug::light_tree_number_reused}},
        {Subsystem::mis_weights,
            {Bug::mis_weights_unequal, Bug::mixture_ignored, Bug::balance_on_one_side, Bug::heuristic_swapped,
                Bug::lamp_density_at_rest, Bug::light_tree_normal_forgotten}},
        {Subsystem::emission, {Bug::background_scaled, Bug::background_inverted, Bug::background_late_missing,
                                  Bug::emission_scaled, Bug::sky_mirrored, Bug::sky_rotated, Bug::sky_nearest}},
        {Subsystem::bsdf, {Bug::albedo_scaled, Bug::albedo_twice, Bug::pdf_not_of_sampler, Bug::fuzz_scaled,
                              Bug::ggx_jacobian_missing, Bug::ggx_masking_dropped, Bug::conductor_fresnel_dropped,
                              Bug::roughness_scaled, Bug::roughness_not_squared, Bug::rough_diffuse_term_dropped,
                              Bug::rough_diffuse_unweighted}},
        {Subsystem::dielectric,
            {Bug::relative_index_inverted, Bug::index_scaled, Bug::schlick_for_exact, Bug::one_polarisation,
                Bug::total_reflection_lost, Bug::alpha_ignored, Bug::boundary_refracts, Bug::priority_ignored,
                Bug::outside_index_ignored, Bug::body_not_left}},
        {Subsystem::roulette,
            {Bug::roulette_not_divided, Bug::roulette_late, Bug::one_bounce_more, Bug::one_bounce_fewer}},
        {Subsystem::camera,
            {Bug::film_shifted, Bug::field_scaled, Bug::lens_radius_scaled, Bug::lens_uneven, Bug::focus_scaled,
                Bug::time_fixed, Bug::camera_motion_ignored, Bug::camera_stale, Bug::motion_halved,
                Bug::filter_width_scaled, Bug::filter_off_centre, Bug::filter_even}},
        {Subsystem::random_numbers,
            {Bug::dimension_reused, Bug::number_exchanged, Bug::seed_repeated, Bug::time_dimension_shared,
                Bug::random_short, Bug::numbers_reused, Bug::seed_high_word_ignored, Bug::sample_high_bits_lost}},
        {Subsystem::textures,
            {Bug::coordinates_swapped, Bug::coordinates_flipped, Bug::checker_shifted, Bug::octave_missing,
                Bug::noise_seed_ignored, Bug::texture_nearest, Bug::texture_half_texel, Bug::gamma_twice,
                Bug::texture_weights_short, Bug::pitch_wrong, Bug::texture_channels_swapped, Bug::texture_short}},
        {Subsystem::volumes, {Bug::extinction_scaled, Bug::phase_sign, Bug::anisotropy_shifted,
                                 Bug::free_path_unweighted, Bug::absorption_scattering_swapped,
                                 Bug::medium_shadow_ignored, Bug::grid_axes_swapped, Bug::medium_grey}},
        {Subsystem::geometry,
            {Bug::normal_transform_wrong, Bug::shading_normal_of_corner, Bug::shading_normal_transform_wrong,
                Bug::shading_guard_dropped, Bug::determinant_ignored, Bug::face_normal_flipped, Bug::sphere_inside_lost,
                Bug::triangle_edge_lost, Bug::self_hit_not_excluded, Bug::epsilon_too_large, Bug::primitive_lost,
                Bug::box_skipped}},
        {Subsystem::accumulation, {Bug::radiance_clamped, Bug::sample_lost, Bug::accumulation_missing, Bug::film_half}},
        {Subsystem::indexing, {Bug::workgroup_lost, Bug::row_lost, Bug::pixel_index_short, Bug::tile_offset_wrong,
                                  Bug::lane_repeated, Bug::block_swizzled}},
        {Subsystem::arithmetic, {Bug::throughput_half, Bug::reciprocal_short}},
        {Subsystem::scene_data, {Bug::stale_constant, Bug::layouts_apart, Bug::vertices_short, Bug::normals_short,
                                    Bug::base_vertex_wrong, Bug::material_wrong}},
    };
    return all;
}

}  // namespace

Subsystem subsystem_of(PlantedBug bug) {
    for (const auto& [subsystem, bugs] : bugs_of_subsystems())
        for (const PlantedBug one : bugs)
            if (one == bug) return subsystem;
    throw std::logic_error("a planted bug lies in no subsystem (tests/mutants/subsystems.cpp)");
}

}  // namespace tandem::test
