// Renders of small scenes by the Embree path tracer, their means, and what those are held against.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

namespace tandem::test::renders {

inline constexpr double pi = std::numbers::pi;

inline RenderSettings settings(
    std::uint32_t size, Integrator integrator, std::uint32_t bounces, std::uint64_t seed = 1) {
    RenderSettings s;
    s.width = s.height = size;
    s.integrator = integrator;
    s.bounces = bounces;
    s.seed = seed;
    return s;
}

inline Estimate render(const Scene& scene, const RenderSettings& s, std::uint64_t samples,
    Precision precision = Precision::single_precision) {
    BackendOptions options;
    options.precision = precision;
    const auto renderer = cpu_backend().create(options);
    return renderer->prepare(scene, s)->render({0, samples}).estimate;
}

inline bool same_bits(const Estimate& a, const Estimate& b) {
    return std::ranges::equal(a.totals(), b.totals(),
        [](const Moments& x, const Moments& y) { return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares; });
}

struct Pooled {
    double mean, error;
};
inline Pooled pooled(const Estimate& estimate, std::size_t channel = 0) {
    const auto mean = mean_of(estimate), variance = variance_of(estimate);
    const double pixels = static_cast<double>(estimate.pixel_count()), n = static_cast<double>(estimate.count());
    Pooled result{0.0, 0.0};
    for (std::size_t i = channel; i < mean.size(); i += 3) {
        result.mean += mean[i] / pixels;
        result.error += variance[i] / n / (pixels * pixels);
    }
    result.error = std::sqrt(result.error);
    CHECK(estimate.invalid() == 0);
    return result;
}

// Six standard errors: a false alarm in 10^9, and the seeds are fixed.
inline void check_mean(const Estimate& estimate, double expected, std::size_t channel = 0, double relative = 2e-6) {
    const Pooled p = pooled(estimate, channel);
    CAPTURE(p.mean);
    CAPTURE(p.error);
    CAPTURE(expected);
    CHECK(std::abs(p.mean - expected) <= 6.0 * p.error + relative * expected);
}
inline void check_same_mean(const Estimate& a, const Estimate& b) {
    for (std::size_t c = 0; c < 3; ++c) {
        const Pooled x = pooled(a, c), y = pooled(b, c);
        CAPTURE(x.mean);
        CAPTURE(y.mean);
        CAPTURE(x.error);
        CAPTURE(y.error);
        CHECK(x.mean > 0.0);
        CHECK(std::abs(x.mean - y.mean) <= 6.0 * std::hypot(x.error, y.error));
    }
}

inline PunctualLight light(PunctualKind kind, const dvec3& position, const dvec3& direction, const dvec3& intensity) {
    PunctualLight result;
    result.name = "light";
    result.kind = kind;
    result.position = position;
    result.direction = glm::normalize(direction);
    result.intensity = intensity;
    return result;
}

// Looks down at one point of a floor of colour C: the middle pixel of a narrow camera.
inline test::SceneBuilder floor_below(const Material& material) {
    test::SceneBuilder b;
    b.camera({0, 4, 0}, {0, 0, 0}, 0.01, {0, 0, -1}).floor(material, 0.0, 50.0);
    return b;
}

inline Material conductor(double roughness, const dvec3& eta = {0.2, 0.9, 1.1}, const dvec3& k = {3.9, 2.4, 2.2}) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.roughness = roughness;
    material.eta = eta;
    material.k = k;
    return material;
}
inline Material boundary(std::uint32_t interior) {
    Material material;
    material.kind = MaterialKind::boundary;
    material.interior = interior;
    return material;
}
inline Medium medium(const dvec3& absorption, const dvec3& scattering, double anisotropy = 0.0) {
    Medium result;
    result.name = "medium";
    result.absorption = absorption;
    result.scattering = scattering;
    result.anisotropy = anisotropy;
    return result;
}

}  // namespace tandem::test::renders
