// The path tracers and the reference oracle side by side, and how their estimates are held against closed forms.
// A mean may leave its closed form by six of its own standard errors, and by the rounding of `roundings` operations a
// path. The errors are estimated from its samples. That is 2e-9 false alarms a channel where the sum is near normal,
// and every seed is fixed.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/error.h"
#include "common/render/renderer.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"
#include "tests/thorough.h"
#include "vulkan/backend.h"

namespace tandem::test {

struct Tracer {
    std::string name;
    std::unique_ptr<Renderer> renderer;
    double unit_roundoff;   // of the arithmetic that shades
    bool samples_lights;    // else next_event is path again, but for punctual lights
    bool compiles = false;  // kernels for every kind of scene, which takes a hundred times as long as rendering it here
    unsigned scenes = 0;    // that it was asked for
};

// A tracer that compiles kernels renders two of four scenes in a row, unless the run is thorough.
inline bool has_turn(Tracer& tracer) { return !tracer.compiles || thorough() || tracer.scenes++ % 4 < 2; }

// All of them, or those that the environment's TANDEM_TRACERS names, comma-separated: "oracle,cpu double".
inline std::vector<Tracer> make_tracers() {
    const auto make = [](const Backend& backend, std::optional<Precision> precision) {
        BackendOptions options;
        options.precision = precision;
        return backend.create(options);
    };
    const char* chosen = std::getenv("TANDEM_TRACERS");
    const auto wanted = [&](std::string_view name) {
        if (chosen == nullptr) return true;
        std::istringstream names(chosen);
        for (std::string one; std::getline(names, one, ',');)
            if (one == name) return true;
        return false;
    };
    std::vector<Tracer> all;
    if (wanted("cpu float"))
        all.push_back({"cpu float", make(cpu_backend(), Precision::single_precision), 0x1p-24, true});
    if (wanted("cpu double"))
        all.push_back({"cpu double", make(cpu_backend(), Precision::double_precision), 0x1p-53, true});
    if (wanted("vulkan")) all.push_back({"vulkan", make(vulkan_backend(), std::nullopt), 0x1p-24, true, true});
    if (wanted("oracle")) all.push_back({"oracle", make(oracle_backend(), std::nullopt), 0x1p-53, false});
    REQUIRE(!all.empty());
    return all;
}

// The same ones for all scenes of a process: Vulkan compiles kernels once for scenes that they fit alike.
inline std::vector<Tracer>& tracers() {
    static std::vector<Tracer> all = make_tracers();
    return all;
}

// The mean over all pixels and samples, and its standard error.
struct Measured {
    dvec3 mean{0.0}, standard_error{0.0};
    std::uint64_t invalid = 0;
};

inline Measured pooled(const Estimate& estimate) {
    const std::vector<double> mean = mean_of(estimate), variance = variance_of(estimate);
    const auto pixels = static_cast<double>(estimate.pixel_count()), samples = static_cast<double>(estimate.count());
    Measured measured{.invalid = estimate.invalid()};
    for (std::size_t i = 0; i < mean.size(); ++i) {
        measured.mean[static_cast<int>(i % 3)] += mean[i] / pixels;
        measured.standard_error[static_cast<int>(i % 3)] += variance[i] / samples / (pixels * pixels);
    }
    measured.standard_error = glm::sqrt(measured.standard_error);
    return measured;
}

inline Estimate render(Tracer& tracer, const Scene& scene, const RenderSettings& settings, std::uint64_t samples) {
    return tracer.renderer->prepare(scene, settings)->render({0, samples}).estimate;
}

// As render, or nothing and a failed check where the tracer does not simulate the scene yet: the others go on.
inline std::optional<Estimate> try_render(
    Tracer& tracer, const Scene& scene, const RenderSettings& settings, std::uint64_t samples) {
    try {
        return render(tracer, scene, settings, samples);
    } catch (const UnsupportedError& error) {
        FAIL_CHECK(tracer.name << ": " << std::string(error.what()));
        return std::nullopt;
    }
}

inline constexpr double sigmas = 6.0;

// Adding up rounds too: 64 samples a block, a few blocks, and at most 400 pixels here, in double precision.
inline constexpr double summation_error = 512.0 * 0x1p-53;

// The image mean of every tracer is `expected`.
inline void check_mean(std::vector<Tracer>& all, const Scene& scene, const RenderSettings& settings,
    std::uint64_t samples, const dvec3& expected, double roundings) {
    for (Tracer& tracer : all) {
        const bool differs = tracer.samples_lights || !scene.lights.empty();
        if ((settings.integrator == Integrator::next_event && !differs) || !has_turn(tracer)) continue;
        CAPTURE(tracer.name);
        const std::optional<Estimate> estimate = try_render(tracer, scene, settings, samples);
        if (!estimate) continue;
        const Measured measured = pooled(*estimate);
        CHECK(measured.invalid == 0);
        for (int channel = 0; channel < 3; ++channel) {
            CAPTURE(channel);
            CAPTURE(measured.standard_error[channel]);
            const double error = std::abs(measured.mean[channel] - expected[channel]);
            const double allowed = sigmas * measured.standard_error[channel] +
                                   (roundings * tracer.unit_roundoff + summation_error) * std::abs(expected[channel]);
            CAPTURE(measured.mean[channel]);
            CAPTURE(expected[channel]);
            CHECK(error <= allowed);
        }
    }
}

// Every pixel is `expected` but for rounding. It is for paths that all carry the same radiance, where the mean of a
// pixel gives away a single ray gone astray.
inline void check_every_pixel(std::vector<Tracer>& all, const Scene& scene, const RenderSettings& settings,
    std::uint64_t samples, const dvec3& expected, double roundings) {
    for (Tracer& tracer : all) {
        if (!has_turn(tracer)) continue;
        CAPTURE(tracer.name);
        const std::optional<Estimate> estimate = try_render(tracer, scene, settings, samples);
        if (!estimate) continue;
        const std::vector<double> mean = mean_of(*estimate);
        double worst = 0.0;
        for (std::size_t i = 0; i < mean.size(); ++i) {
            const double reference = expected[static_cast<int>(i % 3)];
            const double error = std::abs(mean[i] - reference);
            worst = std::max(worst, error == 0.0 ? 0.0 : error / reference);
        }
        CHECK(estimate->invalid() == 0);
        CHECK(worst <= roundings * tracer.unit_roundoff + summation_error);
    }
}

// Mean of f over the unit square by the midpoint rule with steps² points: for closed forms over a pixel or an image.
inline dvec3 mean_over_square(const std::function<dvec3(double, double)>& f, int steps) {
    dvec3 sum(0.0);
    for (int j = 0; j < steps; ++j)
        for (int i = 0; i < steps; ++i) sum += f((i + 0.5) / steps, (j + 0.5) / steps);
    return sum / (static_cast<double>(steps) * steps);
}

}  // namespace tandem::test
