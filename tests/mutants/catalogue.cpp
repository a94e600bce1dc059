#include "tests/mutants/catalogue.h"

#include <fmt/format.h>

#include <map>

namespace tandem::test {

namespace {

using Bug = PlantedBug;
using Names = std::vector<std::string>;

struct Entry {
    Bug bug;
    std::vector<double> amounts;  // {0}: the bug has none
    Names scenes;
    Names closed_forms{};  // below scenes/closed-forms/: for the bug in both backends; none: no closed form knows it
    bool in_cpu = true, in_vulkan = true, unbiased = false, tuned_for = true;
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
        {Bug::light_choice_squared, none, {"many-lamps", "lights"}, {"polygon-light"}},
        {Bug::mixture_ignored, none, {"many-lamps", "cornell-classic", "conductors"}, {"polygon-light"}},
        {Bug::balance_on_one_side, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::heuristic_swapped, none, {"many-lamps", "cornell-classic"}, {"sphere-light"}},
        {Bug::triangle_light_uneven, none, {"many-lamps", "cornell-classic"}, {"polygon-light"}},
        {Bug::sphere_light_cone_scaled, small, {"bokeh", "many-lamps", "motion", "next-week"}, {"sphere-light"}},
        {Bug::cuboid_light_faces_even, none, {"many-lamps", "next-week"}},
        {Bug::shadow_limit_short, {0.3, 0.03}, {"many-lamps", "lights", "cornell-classic"}, {"close-screens"}},
        {Bug::shadow_limit_long, {0.3, 0.03}, {"many-lamps", "cornell-classic", "fog"}, {"close-screens"}},
        {Bug::light_tree_parents_forgotten, none, {"many-lamps", "lights"}, {"scaled-lamps"}},
        {Bug::light_tree_number_reused, none, {"many-lamps", "lights"}, {"scaled-lamps"}},
        {Bug::light_tree_normal_forgotten, none, {"many-lamps"}, {"lamp-under-floor"}},
        // Lights without a surface
        {Bug::spot_falloff_linear, none, {"whitted", "lights"}, {"spot-light"}},
        {Bug::spot_outer_scaled, small, {"whitted", "lights"}, {"spot-light"}},
        {Bug::point_falloff_linear, none, {"whitted", "lights"}, {"point-light"}},
        {Bug::background_scaled, small, {"cornell-thesis", "glass"}, {"even-sky"}},
        {Bug::background_inverted, none, {"glass", "whitted"}, {"ellipsoid-under-sky", "nested-slab"}},
        {Bug::background_late_missing, none, {"glass", "cornell-thesis"}, {"medium-furnace"}},
        {Bug::sky_sine_missing, none, {"environment"}, {"image-sky-height"}},
        {Bug::sky_mirrored, none, {"environment"}, {"image-sky-azimuth"}},
        {Bug::sky_rotated, {0.01, 0.002}, {"environment"}, {"image-sky-azimuth"}},
        {Bug::sky_nearest, none, {"environment"}, {"image-sky-azimuth"}},
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
        // Rough diffuse surfaces
        {Bug::rough_diffuse_term_dropped, none, {"moons"}, {"rough-diffuse-sun"}},
        {Bug::rough_diffuse_unweighted, none, {"moons"}, {"rough-diffuse-sky"}},
        // Bodies within bodies
        {Bug::boundary_refracts, none, {"boundaries"}},
        {Bug::priority_ignored, none, {"nested-glass", "boundaries"}, {"nested-slab"}},
        {Bug::outside_index_ignored, none, {"nested-glass", "boundaries"}, {"nested-slab"}},
        {Bug::body_not_left, none, {"boundaries", "nested-glass"}, {"nested-slab", "furnace-nested"}},
        // Media
        {Bug::extinction_scaled, {-0.5, 0.03, 0.01}, {"fog", "boundaries", "cloud"}, {"medium-transmittance"}},
        {Bug::phase_sign, none, {"boundaries", "fog"}},
        {Bug::anisotropy_shifted, {0.1, 0.03, 0.01}, {"fog", "boundaries", "cloud"}},
        {Bug::free_path_unweighted, none, {"boundaries", "fog"}, {"medium-furnace"}},
        {Bug::absorption_scattering_swapped, none, {"boundaries", "fog"}, {"medium-furnace"}},
        {Bug::medium_shadow_ignored, none, {"fog", "cloud"}},
        {Bug::grid_axes_swapped, none, {"boundaries", "cloud"}, {"grid-transmittance"}},
        // Textures
        {Bug::coordinates_swapped, none, {"textures", "whitted"}, {"image-texture", "model-image"}},
        {Bug::coordinates_flipped, none, {"textures"}, {"image-texture", "checker-coordinates"}},
        {Bug::checker_shifted, none, {"whitted", "textures"}, {"checker", "checker-coordinates"}},
        {Bug::octave_missing, none, {"textures"}},
        {Bug::noise_seed_ignored, none, {"textures"}},
        {Bug::texture_nearest, none, {"textures"}, {"image-texture"}},
        {Bug::texture_half_texel, none, {"textures"}, {"image-texture"}},
        {Bug::gamma_twice, none, {"textures"}, {"image-texture", "model-image"}},
        // Camera, film and time
        {Bug::film_shifted, {0.5, 0.1, 0.05}, {"mirror-corridor", "textures", "glass", "cornell-thesis"},
            {"half-pixel-row", "half-pixel-column"}},
        {Bug::filter_width_scaled, {0.3, 0.1}, {"mirror-corridor", "textures", "glass"}},
        {Bug::filter_off_centre, none, {"mirror-corridor", "textures", "glass"}},
        {Bug::filter_even, none, {"mirror-corridor", "textures", "glass"}},
        {Bug::field_scaled, small, {"textures", "cornell-thesis", "glass"}, {"pixel-coverage"}},
        {Bug::lens_radius_scaled, {1.0, 0.1, 0.03}, {"bokeh", "glass", "one-weekend"}, {"defocus"}},
        {Bug::lens_uneven, none, {"bokeh", "glass"}, {"defocus"}},
        {Bug::focus_scaled, {0.1, 0.03}, {"bokeh", "glass", "one-weekend"}, {"defocus"}},
        {Bug::time_fixed, none, {"motion"}, {"motion", "moving-lamps"}},
        {Bug::time_dimension_shared, none, {"motion"}, {}, true, true, true},
        {Bug::camera_motion_ignored, none, {"motion"}, {"camera-motion"}},
        // Geometry
        {Bug::normal_transform_wrong, none, {"glass"}, {"ellipsoid-under-sky"}},
        {Bug::shading_normal_of_corner, none, {"smooth"}, {"smooth-normals"}},
        {Bug::shading_normal_transform_wrong, none, {"smooth"}, {"smooth-normals"}},
        {Bug::shading_guard_dropped, none, {"smooth"}, {"smooth-normals"}},
        {Bug::determinant_ignored, none, {"glass", "many-lamps"}},
        {Bug::face_normal_flipped, none, {"glass", "whitted"}},
        {Bug::sphere_inside_lost, none, {"glass", "whitted"}, {"furnace-0.5", "furnace-0.8"}},
        {Bug::triangle_edge_lost, {0.01, 0.001}, {"cornell-thesis", "glass", "large-mesh", "model", "next-week"},
            {"model-image"}},
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
        {Bug::sample_lost, none, {"furnace", "cornell-thesis", "glass"}, {}, false},
        {Bug::stale_constant, none, {"glass", "many-lamps"}, {}, false},
        {Bug::layouts_apart, none, {"whitted", "boundaries"}, {}, false},
    };
    return all;
}

// These bugs were in the catalogue before it was known which are found. No scene, look or threshold was made for one
// since. So what they show holds for bugs that nobody has thought of.
const std::vector<Entry>& untuned_entries() {
    static const std::vector<double> none{0.0};
    const Names any{"cornell-classic", "cornell-thesis"}, pictures{"textures"}, moves{"motion"};
    static const std::vector<Entry> all = [&] {
        std::vector<Entry> entries{
            // Arithmetic
            {Bug::throughput_half, none, {"cornell-classic", "glass"}},
            {Bug::reciprocal_short, none, {"cornell-classic", "many-lamps"}},
            {Bug::texture_weights_short, none, pictures},
            // Random numbers
            {Bug::random_short, none, {"cornell-classic", "textures"}},
            {Bug::numbers_reused, none, {"cornell-thesis", "glass"}},
            {Bug::seed_high_word_ignored, none, any, {}, true, true, true},
            {Bug::sample_high_bits_lost, none, any, {}, true, true, true},
            {Bug::lamp_density_at_rest, none, moves},
            // Dispatch, indices and the film
            {Bug::workgroup_lost, none, any},
            {Bug::row_lost, none, any, {"even-sky"}},
            {Bug::pixel_index_short, none, any},
            {Bug::tile_offset_wrong, none, any, {}, false},
            {Bug::lane_repeated, none, any},
            {Bug::block_swizzled, none, any},
            {Bug::accumulation_missing, none, any, {"even-sky"}},
            {Bug::film_half, none, any},
            // What the host gives
            {Bug::camera_stale, {0.01, 0.001}, {"cornell-thesis", "glass"}},
            {Bug::vertices_short, {8.0, 12.0}, {"model", "large-mesh"}},
            {Bug::normals_short, none, {"smooth"}},
            {Bug::base_vertex_wrong, none, {"model", "large-mesh"}},
            {Bug::material_wrong, none, {"cornell-thesis", "glass"}},
            {Bug::pitch_wrong, none, pictures},
            {Bug::texture_channels_swapped, none, pictures},
            {Bug::texture_short, none, pictures},
            {Bug::last_light_lost, none, {"lights", "whitted"}},
            {Bug::medium_grey, none, {"fog", "boundaries"}},
            {Bug::motion_halved, none, moves},
        };
        for (Entry& entry : entries) entry.tuned_for = false;
        return entries;
    }();
    return all;
}

std::vector<Entry> all_entries() {
    std::vector<Entry> all = entries();
    all.insert(all.end(), untuned_entries().begin(), untuned_entries().end());
    return all;
}

std::vector<Mutant> expanded() {
    std::vector<Mutant> mutants;
    for (const Entry& entry : all_entries())
        for (const double amount : entry.amounts) {
            const PlantedFault fault{entry.bug, amount};
            const bool tuned = entry.tuned_for;
            if (entry.in_cpu) mutants.push_back({fault, Planting::cpu, entry.scenes, entry.unbiased, tuned});
            if (entry.in_vulkan) mutants.push_back({fault, Planting::vulkan, entry.scenes, entry.unbiased, tuned});
            Names forms;
            for (const std::string& form : entry.closed_forms) forms.push_back("closed-forms/" + form);
            if (!forms.empty()) mutants.push_back({fault, Planting::both, forms, entry.unbiased, tuned});
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

std::vector<NotInBoth> not_in_both() {
    const std::string
        rough = "no closed form of a rough conductor; a furnace would need the albedo of single scattering",
        phase = "furnaces are blind to where media scatter to, and no other closed form has scattering",
        vulkan = "the CPU has none of what is broken",
        box = "closed forms of files hold for the box alone (test_closed_forms.cpp has one of the gaussian)";
    const std::map<Bug, std::string> reasons{
        {Bug::cuboid_light_faces_even, "no closed form of a cuboid light: its faces add up to no simple polygon"},
        {Bug::ggx_masking_dropped, rough},
        {Bug::roughness_scaled, rough},
        {Bug::filter_width_scaled, box},
        {Bug::filter_off_centre, box},
        {Bug::filter_even, box},
        {Bug::roughness_not_squared, rough},
        {Bug::boundary_refracts, "the boundaries of closed forms are met head on, where nothing is bent"},
        {Bug::phase_sign, phase},
        {Bug::anisotropy_shifted, phase},
        {Bug::medium_shadow_ignored, "no closed form has a light sampled through a medium"},
        {Bug::octave_missing, "noise has no closed form"},
        {Bug::noise_seed_ignored, "noise has no closed form, and any seed the same mean"},
        {Bug::determinant_ignored, "no closed form has a mirrored triangle whose sides differ"},
        {Bug::face_normal_flipped, "no closed form has a cuboid whose upper z face is seen"},
        {Bug::primitive_lost, "no closed form has as many as ten primitives"},
        {Bug::box_skipped, vulkan + ": Embree has trees of its own"},
        {Bug::roulette_not_divided, "no closed form's file asks for roulette (test_closed_forms.cpp does, on one)"},
        {Bug::sample_lost, vulkan + ": no two threads add to one sum"},
        {Bug::stale_constant, vulkan + ": its variants are compiled, not specialised"},
        {Bug::layouts_apart, vulkan + ": there is no second layout"},
    };
    std::vector<NotInBoth> result;
    for (const Entry& entry : all_entries()) {
        if (!entry.closed_forms.empty()) continue;
        const auto known = reasons.find(entry.bug);
        result.push_back({entry.bug, entry.unbiased           ? "every mean is right, so that no closed form can notice"
                                     : !entry.tuned_for       ? "never tuned for, so that no closed form was looked for"
                                     : known == reasons.end() ? ""
                                                              : known->second});
    }
    return result;
}

void make_visible(PlantedBug bug, RenderSettings& settings) {
    if (bug == Bug::light_tree_parents_forgotten || bug == Bug::light_tree_number_reused ||
        bug == Bug::light_tree_normal_forgotten)
        settings.light_sampling = LightSampling::tree;
    if (bug == Bug::filter_width_scaled || bug == Bug::filter_off_centre || bug == Bug::filter_even)
        settings.filter = PixelFilter::gaussian;
}

const std::vector<Mutant>& catalogue() {
    static const std::vector<Mutant> all = expanded();
    return all;
}

}  // namespace tandem::test
