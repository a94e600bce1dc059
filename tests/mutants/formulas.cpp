#include "tests/mutants/formulas.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "common/scene/loader/scene_loader.h"
#include "common/statistics/distributions.h"
#include "common/stopwatch.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/plant_data.h"
#include "tests/mutants/trial.h"

namespace tandem::test {

namespace {

using Bug = PlantedBug;

constexpr std::uint32_t longer_side = 48, tile_edge = 4;
constexpr std::size_t batches = 8;
constexpr std::uint64_t batch_samples = 64;

const std::map<Effect, std::vector<Bug>>& bugs_of_effects() {
    using enum Effect;
    static const std::map<Effect, std::vector<Bug>> all{
        {triangles, {Bug::triangle_edge_lost, Bug::determinant_ignored}},
        {spheres, {Bug::sphere_inside_lost, Bug::normal_transform_wrong}}, {cuboids, {Bug::face_normal_flipped}},
        {entity_motion, {Bug::time_fixed}}, {lens, {Bug::lens_radius_scaled, Bug::lens_uneven, Bug::focus_scaled}},
        {camera_motion, {Bug::camera_motion_ignored}},
        {diffuse, {Bug::albedo_scaled, Bug::albedo_twice, Bug::pdf_not_of_sampler, Bug::dimension_reused,
                      Bug::cosine_dropped, Bug::inverse_pi_dropped}},
        {fuzz, {Bug::fuzz_scaled}},
        {translucent, {Bug::relative_index_inverted, Bug::index_scaled, Bug::one_polarisation, Bug::schlick_for_exact,
                          Bug::total_reflection_lost, Bug::alpha_ignored}},
        {rough_translucent, {Bug::roughness_scaled, Bug::roughness_not_squared, Bug::ggx_masking_dropped}},
        {smooth_conductor, {Bug::conductor_fresnel_dropped}},
        {rough_conductor, {Bug::roughness_scaled, Bug::roughness_not_squared, Bug::ggx_masking_dropped,
                              Bug::conductor_fresnel_dropped}},
        {rough_diffuse, {Bug::rough_diffuse_term_dropped, Bug::rough_diffuse_unweighted}},
        {boundary, {Bug::boundary_refracts}}, {emission, {Bug::emission_scaled}},
        {one_sided_emission, {Bug::light_from_behind}}, {translucent_emission, {Bug::alpha_ignored}},
        {texture_coordinates, {Bug::coordinates_swapped}}, {checker, {Bug::checker_shifted}},
        {noise, {Bug::octave_missing, Bug::noise_seed_ignored}},
        {image_texture, {Bug::coordinates_flipped, Bug::texture_nearest, Bug::texture_half_texel, Bug::gamma_twice}},
        {background, {Bug::background_scaled, Bug::background_late_missing}},
        {background_gradient, {Bug::background_inverted}},
        {background_image, {Bug::sky_mirrored, Bug::sky_rotated, Bug::sky_nearest}},
        {medium_absorption, {Bug::extinction_scaled, Bug::absorption_scattering_swapped}},
        {medium_scattering, {Bug::free_path_unweighted, Bug::medium_shadow_ignored}},
        {anisotropic_phase, {Bug::phase_sign, Bug::anisotropy_shifted}}, {density_grid, {Bug::grid_axes_swapped}},
        {interiors, {Bug::body_not_left}}, {nested_dielectrics, {Bug::priority_ignored, Bug::outside_index_ignored}},
        {light_sampling,
            {Bug::next_event_scaled, Bug::mis_weights_unequal, Bug::light_choice_squared, Bug::mixture_ignored,
                Bug::balance_on_one_side, Bug::heuristic_swapped, Bug::shadow_limit_short, Bug::shadow_limit_long}},
        {triangle_lights, {Bug::triangle_light_uneven, Bug::jacobian_missing}},
        {sphere_lights, {Bug::sphere_light_cone_scaled}}, {cuboid_lights, {Bug::cuboid_light_faces_even}},
        {point_lights, {Bug::point_falloff_linear}}, {spot_lights, {Bug::spot_falloff_linear, Bug::spot_outer_scaled}},
        {sampled_background, {Bug::sky_sine_missing}}, {roulette, {Bug::roulette_not_divided}},
        {shading_normals,
            {Bug::shading_normal_of_corner, Bug::shading_normal_transform_wrong, Bug::shading_guard_dropped}}};
    return all;
}

template <class Change>
Edit in_materials(Change change) {
    return [change](Scene& scene, RenderSettings&) { std::ranges::for_each(scene.materials, change); };
}

// Where the stretched balls that shine are, balls of their volume.
void round_ellipsoids(Scene& scene, RenderSettings&) {
    for (Entity& entity : scene.entities) {
        const Primitive& first = scene.primitives[entity.first_primitive];
        if (first.kind != PrimitiveKind::sphere || scene.materials[entity.material].radiance == glm::dvec3(0.0))
            continue;
        const glm::dvec3 centre(entity.object_to_world * glm::dvec4(scene.vertices[first.index[0]], 1.0));
        const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(entity.object_to_world))));
        entity.object_to_world = glm::translate(glm::dmat4(1.0), centre - scale * scene.vertices[first.index[0]]) *
                                 glm::scale(glm::dmat4(1.0), glm::dvec3(scale));
    }
}

// The body that was entered earlier fills an overlap of equal priorities, where materials stand in that order.
void let_earlier_bodies_win(Scene& scene, RenderSettings&) {
    std::int32_t before = 0;
    for (Material& material : scene.materials)
        if (material.priority) material.priority = 100 * *material.priority - before++;
}

void turn_suns(Scene& scene, RenderSettings&) {
    for (PunctualLight& light : scene.lights)
        if (light.kind == PunctualKind::sun)
            light.direction = glm::normalize(light.direction + glm::dvec3(0.05, 0.0, 0.0));
}

// What no planted bug gets wrong.
std::vector<Formula> edited_formulas() {
    const Edit whitted = [](Scene&, RenderSettings& settings) { settings.integrator = Integrator::whitted; };
    return {{Effect::specular, "mirrors blurred", {}, in_materials([](Material& material) {
                 if (material.kind == MaterialKind::specular && material.fuzz + material.roughness == 0.0)
                     material.fuzz = 0.05;
             }),
                {"mirror-corridor", "caustics", "one-weekend"}, {}},
        {Effect::schlick, "exact for Schlick", {},
            in_materials([](Material& material) { material.fresnel = Fresnel::exact; }),
            {"closed-forms/reflectance-schlick", "cornell-thesis", "one-weekend", "next-week"}, {}},
        {Effect::interiors, "earlier of equal priorities", {}, let_earlier_bodies_win,
            {"closed-forms/equal-priorities"}, {}},
        {Effect::light_sampling, "shadow-limit-short-0.001", {Bug::shadow_limit_short, 0.001}, {},
            {"closed-forms/close-screens"}, {}},
        {Effect::light_sampling, "shadow-limit-long-0.001", {Bug::shadow_limit_long, 0.001}, {},
            {"closed-forms/close-screens"}, {}},
        {Effect::ellipsoid_lights, "balls of the volume for ellipsoids", {}, round_ellipsoids,
            {"lamps", "closed-forms/scaled-lamps"}, {}},
        {Effect::suns, "sun turned by 0.05", {}, turn_suns, {"lights", "moons", "cloud"}, {}},
        {Effect::direct_only, "paths go on", {},
            [](Scene&, RenderSettings& settings) { settings.integrator = Integrator::next_event; },
            {"cornell-classic", "lights"}, whitted},
        {Effect::direct_only, "next-event-scaled-0.03", {Bug::next_event_scaled, 0.03}, {}, {"many-lamps", "whitted"},
            whitted}};
}

// The greatest of the catalogue's mutants of the bug, with the scenes of all its plantings.
Formula formula_of(Effect effect, Bug bug) {
    Formula formula;
    formula.effect = effect;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.fault.bug != bug) continue;
        if (formula.name.empty() || std::abs(mutant.fault.amount) > std::abs(formula.fault.amount)) {
            formula.fault = mutant.fault;
            formula.name = mutant.id();
        }
        for (const std::string& scene : mutant.scenes)
            if (std::ranges::find(formula.scenes, scene) == formula.scenes.end()) formula.scenes.push_back(scene);
    }
    return formula;
}

struct Asked {
    Scene scene;
    RenderSettings settings;
};

Asked asked(const Formula& formula, const std::string& name) {
    Asked result{load_scene(scene_file(name)), {}};
    result.settings = with_longer_side(default_settings(result.scene), longer_side);
    result.settings.seed = 20261124;
    if (formula.setting) formula.setting(result.scene, result.settings);
    return result;
}

using Image = std::vector<double>;  // means of tiles, a value a channel

Image tiles_of(const Estimate& estimate) {
    const std::vector<double> means = mean_of(estimate);
    const std::uint32_t width = estimate.width(), height = estimate.height();
    const std::uint32_t columns = (width + tile_edge - 1) / tile_edge, rows = (height + tile_edge - 1) / tile_edge;
    Image sums(std::size_t{columns} * rows * channel_count), counts = sums;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < channel_count; ++c) {
                const std::size_t tile = (std::size_t{y / tile_edge} * columns + x / tile_edge) * channel_count + c;
                sums[tile] += means[(std::size_t{y} * width + x) * channel_count + c];
                counts[tile] += 1.0;
            }
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= counts[i];
    return sums;
}

std::vector<Image> images_of(Renderer& renderer, const Asked& what) {
    const auto job = renderer.prepare(what.scene, what.settings);
    std::vector<Image> images;
    for (std::size_t batch = 0; batch < batches; ++batch)
        images.push_back(tiles_of(job->render({batch * batch_samples, (batch + 1) * batch_samples}).estimate));
    return images;
}

// The squared norm of the mean difference, without what its noise adds: products of different batches alone.
double squared_norm(const std::vector<Image>& differences, std::size_t without) {
    const std::size_t tiles = differences.front().size();
    double sum = 0.0, n = 0.0;
    for (std::size_t batch = 0; batch < differences.size(); ++batch) n += batch == without ? 0.0 : 1.0;
    for (std::size_t tile = 0; tile < tiles; ++tile) {
        double total = 0.0, squares = 0.0;
        for (std::size_t batch = 0; batch < differences.size(); ++batch) {
            if (batch == without) continue;
            total += differences[batch][tile];
            squares += differences[batch][tile] * differences[batch][tile];
        }
        sum += total * total - squares;
    }
    return sum / (n * (n - 1.0));
}

}  // namespace

std::vector<Formula> formulas() {
    std::vector<Formula> all = edited_formulas();
    for (const auto& [effect, bugs] : bugs_of_effects())
        for (const Bug bug : bugs) all.push_back(formula_of(effect, bug));
    std::ranges::stable_sort(all, {}, &Formula::effect);
    return all;
}

bool calls_for(const Formula& formula, const std::string& scene) {
    const Asked what = asked(formula, scene);
    return needed_effects(what.scene, what.settings).has(formula.effect);
}

ImageChange change_of(const Formula& formula, const std::string& scene) {
    const Stopwatch watch;
    const Asked sound = asked(formula, scene);
    Asked wrong = sound;
    if (formula.edit) formula.edit(wrong.scene, wrong.settings);
    const std::vector<Image> right = images_of(*renderer_with(cpu_backend(), {}), sound);
    std::vector<Image> differences = images_of(*renderer_with(cpu_backend(), formula.fault), wrong);
    double image = 0.0, wrong_image = 0.0;
    for (std::size_t tile = 0; tile < right.front().size(); ++tile) {
        double mean = 0.0, wrong_mean = 0.0;
        for (std::size_t batch = 0; batch < batches; ++batch) {
            wrong_mean += differences[batch][tile] / static_cast<double>(batches);
            differences[batch][tile] -= right[batch][tile];
            mean += right[batch][tile] / static_cast<double>(batches);
        }
        image += mean * mean;
        wrong_image += wrong_mean * wrong_mean;
    }
    if (image == 0.0) image = wrong_image > 0.0 ? wrong_image : 1.0;
    // Jackknife over batches.
    constexpr double n = batches;
    const double all = squared_norm(differences, batches);
    double mean = 0.0, squares = 0.0;
    for (std::size_t batch = 0; batch < batches; ++batch) {
        const double pseudo = n * all - (n - 1.0) * squared_norm(differences, batch);
        mean += pseudo / n;
        squares += pseudo * pseudo / n;
    }
    const double error = std::sqrt(std::max(0.0, squares - mean * mean) / (n - 1.0));
    const double half = student_quantile(0.975, n - 1.0) * error;
    const auto relative = [&](double square) { return std::sqrt(std::max(0.0, square) / image); };
    return {{relative(all), relative(all - half), relative(all + half)}, sound.settings.width, sound.settings.height,
        batches * batch_samples, watch.seconds()};
}

}  // namespace tandem::test
