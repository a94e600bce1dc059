#include "tests/mutants/catalogue.h"

#include <fmt/format.h>

namespace tandem::test {

namespace {

using Bug = PlantedBug;
using Names = std::vector<std::string>;

struct Entry {
    Bug bug;
    std::vector<double> amounts;  // {0}: the bug has none
    Names scenes;
    Names closed_forms{};  // below scenes/closed-forms/: for the bug in both backends; none: no closed form knows it
    bool in_cpu = true, in_vulkan = true, unbiased = false;
};

const std::vector<Entry>& entries() {
    static const std::vector<double> none{0.0}, small{0.03, 0.01, 0.003};
    static const std::vector<Entry> all{
        // Next events and their weights
        {Bug::cosine_dropped, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::inverse_pi_dropped, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::mis_weights_unequal, none, {"many-lamps", "cornell-classic"}, {"polygon-light"}},
        {Bug::jacobian_missing, none, {"many-lamps", "cornell-classic"}, {"polygon-light"}},
        {Bug::light_from_behind, none, {"many-lamps", "cornell-classic"}, {"lamp-from-behind"}},
        {Bug::next_event_scaled, small, {"many-lamps", "lights", "cornell-classic"}, {"point-light"}},
        {Bug::emission_scaled, small, {"cornell-thesis", "furnace", "glass"}, {"furnace-0.8"}},
        {Bug::light_choice_squared, none, {"many-lamps", "lights"}},
        {Bug::mixture_ignored, none, {"many-lamps", "cornell-classic", "conductors"}},
        {Bug::balance_on_one_side, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::heuristic_swapped, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::triangle_light_uneven, none, {"many-lamps", "cornell-classic"}, {"polygon-light"}},
        {Bug::sphere_light_cone_scaled, small, {"bokeh", "many-lamps", "motion", "next-week"}, {"sphere-light"}},
        {Bug::cuboid_light_faces_even, none, {"many-lamps", "next-week"}},
        {Bug::shadow_limit_short, {0.3, 0.03}, {"many-lamps", "lights", "cornell-classic"}},
        {Bug::shadow_limit_long, {0.3, 0.03}, {"many-lamps", "cornell-classic", "fog"}},
        // Lights without a surface
        {Bug::spot_falloff_linear, none, {"whitted", "lights"}, {"spot-light"}},
        {Bug::spot_outer_scaled, small, {"whitted", "lights"}, {"spot-light"}},
        {Bug::point_falloff_linear, none, {"whitted", "lights"}, {"point-light"}},
        {Bug::background_scaled, small, {"cornell-thesis", "glass"}, {"even-sky"}},
        {Bug::background_inverted, none, {"glass", "whitted"}},
        {Bug::background_late_missing, none, {"glass", "cornell-thesis"}},
        {Bug::sky_sine_missing, none, {"environment"}, {"image-sky-height"}},
        {Bug::sky_mirrored, none, {"environment"}, {"image-sky-azimuth"}},
        {Bug::sky_rotated, {0.01, 0.002}, {"environment"}},
        {Bug::sky_nearest, none, {"environment"}},
        // Diffuse and specular materials
        {Bug::albedo_scaled, small, {"cornell-thesis", "furnace", "glass"}, {"even-sky"}},
        {Bug::albedo_twice, none, {"cornell-thesis"}, {"furnace-0.8"}},
        {Bug::pdf_not_of_sampler, none, {"cornell-thesis"}, {"polygon-light"}},
        {Bug::dimension_reused, none, {"cornell-thesis"}, {"ellipsoid-under-sky"}},
        {Bug::relative_index_inverted, none, {"glass", "whitted"}, {"reflectance-exact"}},
        {Bug::index_scaled, small, {"glass", "whitted", "nested-glass"}, {"reflectance-exact"}},
        {Bug::schlick_for_exact, none, {"glass", "whitted", "nested-glass"}, {"reflectance-exact"}},
        {Bug::one_polarisation, none, {"glass", "whitted"}, {"reflectance-exact"}},
        {Bug::total_reflection_lost, none, {"glass", "whitted"}, {"prism"}},
        {Bug::alpha_ignored, none, {"whitted", "glass"}, {"absorption"}},
        {Bug::fuzz_scaled, {0.1, 0.03}, {"miniature", "glass", "textures"}, {"fuzz"}},
        // Conductors and rough glass
        // The density is that of the weights of both techniques, which still sum to one.
        {Bug::ggx_jacobian_missing, none, {"many-lamps", "conductors"}, {}, true, true, true},
        {Bug::ggx_masking_dropped, none, {"conductors", "many-lamps"}},
        {Bug::conductor_fresnel_dropped, none, {"whitted", "conductors"}, {"conductor-normal"}},
        {Bug::roughness_scaled, {0.1, 0.03, 0.01}, {"many-lamps", "conductors"}},
        {Bug::roughness_not_squared, none, {"many-lamps", "conductors"}},
        // Bodies within bodies
        {Bug::boundary_refracts, none, {"boundaries"}},
        {Bug::priority_ignored, none, {"nested-glass", "boundaries"}, {"nested-slab"}},
        {Bug::outside_index_ignored, none, {"nested-glass", "boundaries"}, {"nested-slab"}},
        {Bug::body_not_left, none, {"boundaries", "nested-glass"}},
        // Media
        {Bug::extinction_scaled, {-0.5, 0.03, 0.01}, {"fog", "boundaries", "cloud"}, {"medium-transmittance"}},
        {Bug::phase_sign, none, {"boundaries", "fog"}},
        {Bug::anisotropy_shifted, {0.1, 0.03, 0.01}, {"fog", "boundaries", "cloud"}},
        {Bug::free_path_unweighted, none, {"boundaries", "fog"}, {"medium-furnace"}},
        {Bug::absorption_scattering_swapped, none, {"boundaries", "fog"}},
        {Bug::medium_shadow_ignored, none, {"fog", "cloud"}},
        {Bug::grid_axes_swapped, none, {"boundaries", "cloud"}},
        // Textures
        {Bug::coordinates_swapped, none, {"textures", "whitted"}, {"image-texture"}},
        {Bug::coordinates_flipped, none, {"textures"}},
        {Bug::checker_shifted, none, {"whitted", "textures"}},
        {Bug::octave_missing, none, {"textures"}},
        {Bug::noise_seed_ignored, none, {"textures"}},
        {Bug::texture_nearest, none, {"textures"}},
        {Bug::texture_half_texel, none, {"textures"}},
        {Bug::gamma_twice, none, {"textures"}, {"image-texture"}},
        // Camera, film and time
        {Bug::film_shifted, {0.5, 0.1, 0.05}, {"mirror-corridor", "textures", "glass", "cornell-thesis"},
            {"half-pixel-row", "half-pixel-column"}},
        {Bug::field_scaled, small, {"textures", "cornell-thesis", "glass"}, {"pixel-coverage"}},
        {Bug::lens_radius_scaled, {1.0, 0.1, 0.03}, {"bokeh", "glass", "one-weekend"}, {"defocus"}},
        {Bug::lens_uneven, none, {"bokeh", "glass"}, {"defocus"}},
        {Bug::focus_scaled, {0.1, 0.03}, {"bokeh", "glass", "one-weekend"}},
        {Bug::time_fixed, none, {"motion"}, {"motion"}},
        {Bug::time_dimension_shared, none, {"motion"}, {}, true, true, true},
        {Bug::camera_motion_ignored, none, {"motion"}, {"camera-motion"}},
        // Geometry
        {Bug::normal_transform_wrong, none, {"glass"}, {"ellipsoid-under-sky"}},
        {Bug::determinant_ignored, none, {"glass", "many-lamps"}},
        {Bug::face_normal_flipped, none, {"glass", "whitted"}},
        {Bug::sphere_inside_lost, none, {"glass", "whitted"}},
        {Bug::triangle_edge_lost, {0.01, 0.001}, {"cornell-thesis", "glass", "large-mesh", "model"}},
        {Bug::self_hit_not_excluded, none, {"cornell-thesis", "glass"}, {"even-sky"}},
        {Bug::epsilon_too_large, {0.01, 0.001, 0.0001}, {"miniature", "cornell-thesis", "glass", "nested-glass"},
            {"sphere-light"}},
        {Bug::primitive_lost, none, {"cornell-thesis", "large-mesh", "next-week", "one-weekend"}},
        {Bug::box_skipped, none, {"large-mesh", "one-weekend", "next-week"}, {}, false},
        // Paths and sums
        {Bug::one_bounce_more, none, {"furnace", "whitted"}, {"furnace-0.8"}},
        {Bug::one_bounce_fewer, none, {"furnace", "whitted"}, {"furnace-0.8"}},
        {Bug::roulette_not_divided, none, {"textures", "boundaries"}},
        {Bug::roulette_late, none, {"boundaries", "textures", "conductors"}, {}, true, true, true},
        {Bug::number_exchanged, none, {"cornell-thesis", "glass"}, {}, true, true, true},
        {Bug::seed_repeated, none, {"cornell-thesis", "glass"}, {}, true, true, true},
        {Bug::radiance_clamped, none, {"glass", "furnace"}, {"furnace-0.8"}},
        {Bug::sample_lost, none, {"furnace", "cornell-thesis", "glass"}, {"polygon-light"}, false},
        {Bug::stale_constant, none, {"glass", "many-lamps"}, {}, false},
        {Bug::layouts_apart, none, {"whitted", "boundaries"}, {}, false},
    };
    return all;
}

std::vector<Mutant> expanded() {
    std::vector<Mutant> mutants;
    for (const Entry& entry : entries())
        for (const double amount : entry.amounts) {
            const PlantedFault fault{entry.bug, amount};
            if (entry.in_cpu) mutants.push_back({fault, Planting::cpu, entry.scenes, entry.unbiased});
            if (entry.in_vulkan) mutants.push_back({fault, Planting::vulkan, entry.scenes, entry.unbiased});
            Names forms;
            for (const std::string& form : entry.closed_forms) forms.push_back("closed-forms/" + form);
            if (!forms.empty()) mutants.push_back({fault, Planting::both, forms, entry.unbiased});
        }
    return mutants;
}

}  // namespace

const char* name_of(Planting planting) {
    constexpr std::array names{"cpu", "vulkan", "both"};
    return names.at(static_cast<std::size_t>(planting));
}

std::string Mutant::id() const {
    const std::string_view name = planted_bug_names.at(static_cast<std::size_t>(fault.bug));
    return fault.amount == 0.0 ? std::string(name) : fmt::format("{}-{:g}", name, fault.amount);
}

const std::vector<Mutant>& catalogue() {
    static const std::vector<Mutant> all = expanded();
    return all;
}

}  // namespace tandem::test
