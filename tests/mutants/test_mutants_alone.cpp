// A bug common to both tracers cannot show between them (VALIDATION.md 6): each must then miss a closed form. The
// shipped scenes of scenes/closed-forms, met by every sound witness in tests/suite, must be missed by every buggy one.
#include <doctest/doctest.h>

#include "common/scene_loader.h"
#include "tests/suite/witnesses.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// By how many of its own errors (a sixth of what tests/suite allows) a backend with the bug misses the closed form, in
// the channel where it does so most.
double miss(const Backend& backend, PlantedBug bug, const std::string& file, Integrator integrator,
    std::uint32_t roulette_start = no_roulette) {
    const Scene scene = load_scene(TANDEM_SOURCE_DIR "/scenes/closed-forms/" + file + ".json");
    REQUIRE(scene.expect.has_value());
    RenderSettings settings = default_settings(scene);
    settings.integrator = integrator;
    settings.roulette_start = roulette_start;
    settings.width = std::min(settings.width, 12u);
    settings.height = std::min(settings.height, 12u);
    BackendOptions options;
    options.planted_bug = bug;
    const std::uint64_t samples = settings.width == 1 ? 4096 : 256;
    const auto renderer = backend.create(options);
    const Measured measured = pooled(renderer->prepare(scene, settings)->render({0, samples}).estimate);
    CHECK(measured.invalid == 0);
    double greatest = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        const double expected = scene.expect->radiance[channel];
        const double rounding = ((8.0 * settings.bounces + 64.0) * 0x1p-24 + summation_error) * std::abs(expected);
        const double difference = std::abs(measured.mean[channel] - expected);
        if (difference > 0.0)
            greatest = std::max(greatest, difference / (measured.standard_error[channel] + rounding / sigmas));
    }
    return greatest;
}

}  // namespace

#define TANDEM_MISSES(bug, ...)                                               \
    TEST_CASE("cpu: " #bug " misses a closed form") {                         \
        CHECK(miss(cpu_backend(), PlantedBug::bug, __VA_ARGS__) > sigmas);    \
    }                                                                         \
    TEST_CASE("vulkan: " #bug " misses a closed form") {                      \
        CHECK(miss(vulkan_backend(), PlantedBug::bug, __VA_ARGS__) > sigmas); \
    }

TANDEM_MISSES(cosine_dropped, "polygon-light", Integrator::next_event)
TANDEM_MISSES(inverse_pi_dropped, "polygon-light", Integrator::next_event)
TANDEM_MISSES(roulette_not_divided, "furnace-0.8", Integrator::path, 1)
TANDEM_MISSES(one_bounce_more, "furnace-0.8", Integrator::path)
TANDEM_MISSES(one_bounce_fewer, "furnace-0.8", Integrator::path)
TANDEM_MISSES(relative_index_inverted, "reflectance-exact", Integrator::path)
TANDEM_MISSES(pdf_not_of_sampler, "polygon-light", Integrator::path)
TANDEM_MISSES(mis_weights_unequal, "polygon-light", Integrator::next_event)
TANDEM_MISSES(jacobian_missing, "polygon-light", Integrator::next_event)
TANDEM_MISSES(light_from_behind, "lamp-from-behind", Integrator::next_event)
TANDEM_MISSES(dimension_reused, "ellipsoid-under-sky", Integrator::path)
TANDEM_MISSES(half_pixel_shift, "pixel-coverage", Integrator::path)
TANDEM_MISSES(albedo_off_3_percent, "even-sky", Integrator::path)
TANDEM_MISSES(albedo_off_1_percent, "even-sky", Integrator::path)
TANDEM_MISSES(self_hit_not_excluded, "even-sky", Integrator::path)
TANDEM_MISSES(epsilon_too_large, "sphere-light", Integrator::path)
TANDEM_MISSES(total_reflection_lost, "prism", Integrator::path)
TANDEM_MISSES(normal_transform_wrong, "ellipsoid-under-sky", Integrator::path)
TANDEM_MISSES(radiance_clamped, "furnace-0.8", Integrator::path)
TANDEM_MISSES(lens_radius_doubled, "defocus", Integrator::path)
TANDEM_MISSES(alpha_ignored, "absorption", Integrator::path)
