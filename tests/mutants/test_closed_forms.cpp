// A bug common to both tracers cannot show between them: each must then miss a closed form. The
// shipped scenes of scenes/closed-forms, met by every sound tracer in tests/suite, must be missed by every buggy one.
#include <doctest/doctest.h>

#include "common/scene/loader/scene_loader.h"
#include "tests/mutants/catalogue.h"
#include "tests/mutants/plant_data.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// By how many of its own errors a backend with the bug misses the closed form, in the channel where it does so most. An
// error is a sixth of what tests/suite allows.
double miss(const Backend& backend, const PlantedFault& bug, const Scene& scene, const RenderSettings& settings,
    const dvec3& answer) {
    const std::uint64_t samples = settings.width == 1 || settings.height == 1 ? 4096 : 256;  // few pixels
    const auto renderer = renderer_with(backend, bug);
    const Measured measured = pooled(renderer->prepare(scene, settings)->render({0, samples}).estimate);
    CHECK(measured.invalid == 0);
    double greatest = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        const double expected = answer[channel];
        const double rounding = ((8.0 * settings.bounces + 64.0) * 0x1p-24 + summation_error) * std::abs(expected);
        const double difference = std::abs(measured.mean[channel] - expected);
        if (difference > 0.0)
            greatest = std::max(greatest, difference / (measured.standard_error[channel] + rounding / sigmas));
    }
    return greatest;
}

double miss(const Backend& backend, const PlantedFault& bug, const std::string& file, Integrator integrator,
    std::uint32_t roulette_start = no_roulette) {
    const Scene scene = load_scene(TANDEM_SOURCE_DIR "/scenes/closed-forms/" + file + ".json");
    REQUIRE(scene.expect.has_value());
    RenderSettings settings = default_settings(scene);
    settings.integrator = integrator;
    settings.roulette_start = roulette_start;
    make_visible(bug.bug, settings);
    settings.width = std::min(settings.width, 12u);
    settings.height = std::min(settings.height, 12u);
    return miss(backend, bug, scene, settings, scene.expect->radiance);
}

// A lamp as wide as a pixel, in the middle of a column of pixels. A Gaussian of standard deviation 1/2, cut at three of
// them, shows erf(1/sqrt 2)/erf(3/sqrt 2) of it.
double miss_of_filter(const Backend& backend, const PlantedFault& bug) {
    const dvec3 radiance(1.0, 2.0, 4.0);
    RenderSettings settings = settings_of(1, 1);
    settings.height = 12;
    make_visible(bug.bug == PlantedBug::none ? PlantedBug::filter_even : bug.bug, settings);
    const double half = 1.0 / settings.height;
    const Scene scene =
        SceneBuilder()
            .camera(black, {0.0, 0.0, -1.0}, 90.0)
            .quad(emitter(radiance), {-half, -9.0, -1.0}, {half, -9.0, -1.0}, {half, 9.0, -1.0}, {-half, 9.0, -1.0})
            .scene();
    return miss(backend, bug, scene, settings, std::erf(std::sqrt(0.5)) / std::erf(3.0 * std::sqrt(0.5)) * radiance);
}

}  // namespace

TEST_CASE("a Gaussian pixel filter without a bug meets its closed form") {
    CHECK(miss_of_filter(cpu_backend(), {}) < sigmas);
    CHECK(miss_of_filter(vulkan_backend(), {}) < sigmas);
}

#define TANDEM_FILTER_MISSES(bug, amount)                                            \
    TEST_CASE("cpu: " #bug " " #amount " misses a closed form") {                    \
        CHECK(miss_of_filter(cpu_backend(), {PlantedBug::bug, amount}) > sigmas);    \
    }                                                                                \
    TEST_CASE("vulkan: " #bug " " #amount " misses a closed form") {                 \
        CHECK(miss_of_filter(vulkan_backend(), {PlantedBug::bug, amount}) > sigmas); \
    }

TANDEM_FILTER_MISSES(filter_width_scaled, 0.3)
TANDEM_FILTER_MISSES(filter_width_scaled, 0.1)
TANDEM_FILTER_MISSES(filter_off_centre, 0.0)
TANDEM_FILTER_MISSES(filter_even, 0.0)

#define TANDEM_MISSES(bug, amount, ...)                                                 \
    TEST_CASE("cpu: " #bug " " #amount " misses a closed form") {                       \
        CHECK(miss(cpu_backend(), {PlantedBug::bug, amount}, __VA_ARGS__) > sigmas);    \
    }                                                                                   \
    TEST_CASE("vulkan: " #bug " " #amount " misses a closed form") {                    \
        CHECK(miss(vulkan_backend(), {PlantedBug::bug, amount}, __VA_ARGS__) > sigmas); \
    }

TANDEM_MISSES(cosine_dropped, 0.0, "polygon-light", Integrator::next_event)
TANDEM_MISSES(inverse_pi_dropped, 0.0, "polygon-light", Integrator::next_event)
TANDEM_MISSES(roulette_not_divided, 0.0, "furnace-0.8", Integrator::path, 1)
TANDEM_MISSES(one_bounce_more, 0.0, "furnace-0.8", Integrator::path)
TANDEM_MISSES(one_bounce_fewer, 0.0, "furnace-0.8", Integrator::path)
TANDEM_MISSES(relative_index_inverted, 0.0, "reflectance-exact", Integrator::path)
TANDEM_MISSES(pdf_not_of_sampler, 0.0, "polygon-light", Integrator::path)
TANDEM_MISSES(mis_weights_unequal, 0.0, "polygon-light", Integrator::next_event)
TANDEM_MISSES(jacobian_missing, 0.0, "polygon-light", Integrator::next_event)
TANDEM_MISSES(light_tree_parents_forgotten, 0.0, "scaled-lamps", Integrator::next_event)
TANDEM_MISSES(light_tree_number_reused, 0.0, "scaled-lamps", Integrator::next_event)
TANDEM_MISSES(light_tree_normal_forgotten, 0.0, "lamp-under-floor", Integrator::next_event)
TANDEM_MISSES(light_from_behind, 0.0, "lamp-from-behind", Integrator::next_event)
TANDEM_MISSES(dimension_reused, 0.0, "ellipsoid-under-sky", Integrator::path)
TANDEM_MISSES(film_shifted, 0.5, "pixel-coverage", Integrator::path)
TANDEM_MISSES(film_shifted, 0.05, "half-pixel-row", Integrator::path)
TANDEM_MISSES(film_shifted, 0.04, "half-pixel-column", Integrator::path)
TANDEM_MISSES(albedo_scaled, 0.03, "even-sky", Integrator::path)
TANDEM_MISSES(albedo_scaled, 0.01, "even-sky", Integrator::path)
TANDEM_MISSES(self_hit_not_excluded, 0.0, "even-sky", Integrator::path)
TANDEM_MISSES(epsilon_too_large, 0.01, "sphere-light", Integrator::path)
TANDEM_MISSES(total_reflection_lost, 0.0, "prism", Integrator::path)
TANDEM_MISSES(normal_transform_wrong, 0.0, "ellipsoid-under-sky", Integrator::path)
TANDEM_MISSES(shading_normal_of_corner, 0.0, "smooth-normals", Integrator::path)
TANDEM_MISSES(shading_normal_transform_wrong, 0.0, "smooth-normals", Integrator::path)
TANDEM_MISSES(shading_guard_dropped, 0.0, "smooth-normals", Integrator::path)
TANDEM_MISSES(radiance_clamped, 0.0, "furnace-0.8", Integrator::path)
TANDEM_MISSES(lens_radius_scaled, 1.0, "defocus", Integrator::path)
TANDEM_MISSES(alpha_ignored, 0.0, "absorption", Integrator::path)
TANDEM_MISSES(shadow_limit_short, 0.001, "close-screens", Integrator::next_event)
TANDEM_MISSES(shadow_limit_long, 0.001, "close-screens", Integrator::next_event)
TANDEM_MISSES(time_fixed, 0.0, "moving-lamps", Integrator::next_event)
TANDEM_MISSES(coordinates_swapped, 0.0, "model-image", Integrator::path)
TANDEM_MISSES(gamma_twice, 0.0, "model-image", Integrator::path)
TANDEM_MISSES(rough_diffuse_term_dropped, 0.0, "rough-diffuse-sun", Integrator::next_event)
TANDEM_MISSES(rough_diffuse_unweighted, 0.0, "rough-diffuse-sky", Integrator::path)
