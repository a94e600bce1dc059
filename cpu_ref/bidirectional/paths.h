// Bidirectional path tracing (MODEL.md section 9.6): one sample of one pixel, and the light that its light subpath adds
// to other pixels. A path of vertices x_0 (on the light) to x_k (on the lens) may be sampled in k + 1 ways. Way s has s
// vertices from the light, 0 <= s <= k. The power heuristic weighs them [Veach 1995].
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <stop_token>
#include <vector>

#include "cpu_ref/bidirectional/lights.h"
#include "cpu_ref/bidirectional/rays.h"
#include "cpu_ref/bidirectional/sky.h"
#include "cpu_ref/bidirectional/surfaces.h"

namespace tandem::cpu {

class BidirectionalSampler {
public:
    BidirectionalSampler(RTCDevice device, const Scene& scene, const RenderSettings& settings);

    BidirectionalSampler(const BidirectionalSampler&) = delete;
    BidirectionalSampler& operator=(const BidirectionalSampler&) = delete;

    [[nodiscard]] const RenderSettings& settings() const { return settings_; }
    // Greatest count of a sample's vertices: the lens and D + 1 from the camera, the point on a light and D from there.
    [[nodiscard]] std::uint64_t bytes_per_path() const;

    // Radiance that a pixel receives from a subpath of another's sample.
    using Splat = std::function<void(std::uint32_t pixel, const glm::dvec3& radiance)>;
    // Sample `sample` of the pixel: what its own subpath from the camera finds. A function of (seed, pixel, sample).
    // Void once a stop is requested.
    [[nodiscard]] glm::dvec3 radiance(
        std::uint32_t pixel, std::uint64_t sample, const Splat& splat, const std::stop_token& stop) const;

private:
    struct Vertex;
    struct Sample;
    struct Weighing;

    void trace_from_camera(Sample& sample) const;
    void trace_from_light(Sample& sample) const;
    [[nodiscard]] bool extend(
        std::vector<Vertex>& path, const glm::dvec3& direction, double density, double time) const;

    // The ways with s vertices from the light. In order: s = 0 (two functions); s = 1; s >= 2 and more than the lens
    // from the camera; all but the lens from the light.
    [[nodiscard]] glm::dvec3 emission_at(const Sample& sample, std::size_t t) const;
    [[nodiscard]] glm::dvec3 sky_beyond(Sample& sample) const;
    [[nodiscard]] glm::dvec3 next_event(const Sample& sample, std::size_t t) const;
    [[nodiscard]] glm::dvec3 connection(const Sample& sample, std::size_t s, std::size_t t) const;
    void project(const Sample& sample, std::size_t s, const Splat& splat) const;

    [[nodiscard]] double weight(const Sample& sample, const Weighing& way) const;

    // The density over solid angle with which the camera sends rays into the whole film. Beyond it, where pixel filters
    // reach, it goes on: so the weights of a path's ways add up to 1 there as well.
    [[nodiscard]] double film_density(const Sample& sample, const glm::dvec3& direction) const;

    RenderSettings settings_;
    Camera camera_;
    Sky sky_;
    std::vector<Material> materials_;
    RayCaster caster_;
    Emitters emitters_;
    double film_height_, film_width_;  // half, at distance 1
};

}  // namespace tandem::cpu
