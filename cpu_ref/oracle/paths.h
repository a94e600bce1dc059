// The oracle's light transport: camera (MODEL.md section 4) and the estimators `path` (9.1) and `whitted` (9.5), one
// sample at a time. Lights that scattering cannot find (8.3) are summed at every vertex. Only `whitted` samples lights
// (next_event.h), as its mean is next-event estimation alone. So `path` and `next_event` are the same here.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <stop_token>

#include "common/render/path_trace.h"
#include "common/render/renderer.h"
#include "common/scene/scene.h"
#include "cpu_ref/oracle/geometry.h"
#include "cpu_ref/oracle/next_event.h"
#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {

// A scene made ready for one set of settings; immutable, so any number of threads may ask it.
class PathSampler {
public:
    // Throws InputError for a camera that MODEL.md section 4 refuses.
    PathSampler(const Scene& scene, const RenderSettings& settings);
    PathSampler(const PathSampler&) = delete;  // its lights are those of its scene

    // Radiance of sample `sample` of pixel (x, y): a function of (seed, pixel, sample) alone. Void once a stop is
    // requested, which ends the path at its next vertex.
    [[nodiscard]] glm::dvec3 radiance(
        std::uint32_t x, std::uint32_t y, std::uint64_t sample, const std::stop_token& stop) const;

    // The same path, vertex by vertex.
    [[nodiscard]] PathTrace trace(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const;

    [[nodiscard]] const RenderSettings& settings() const { return settings_; }

private:
    struct Path;    // what changes from vertex to vertex
    struct Vertex;  // where a path is scattered
    struct VertexNumbers;

    [[nodiscard]] Ray camera_ray(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const;
    // From one vertex to the next; `seen` tells of what befell the path, but for where it goes on.
    [[nodiscard]] PathEnd advance(Path& path, std::uint32_t k, TracedVertex& seen) const;
    [[nodiscard]] PathEnd play_roulette(Path& path, std::uint32_t k, double number) const;
    [[nodiscard]] PathEnd scatter_in_medium(
        Path& path, const Medium& medium, double distance, const VertexNumbers& numbers, TracedVertex& seen) const;
    [[nodiscard]] PathEnd scatter_at_surface(
        Path& path, const Hit& hit, const VertexNumbers& numbers, TracedVertex& seen) const;
    // Section 5.2: what a ray that has gone on through a face, and started before it, comes to. Is it where that face
    // is, is it even the same?
    enum class Place : std::uint8_t { elsewhere, same_place, same_face };
    [[nodiscard]] Place place_of(const Path& path, const Hit& hit) const;
    [[nodiscard]] PathEnd leave(Path& path, const Hit& hit, const glm::dvec3& direction, Place place) const;
    [[nodiscard]] const Medium* medium_of(const Path& path) const;  // null: vacuum
    [[nodiscard]] glm::dvec3 colour_at(const Hit& hit) const;
    // What arrives of a light so far away at a vertex: 0 where something but the light's own primitive is between.
    [[nodiscard]] glm::dvec3 arriving(const Path& path, const Vertex& vertex, const glm::dvec3& direction,
        double distance, std::uint32_t light) const;
    // What all punctual lights send to a vertex, times `share` of the direction to each. For `whitted` it is what one
    // sample of one light does, which `seen` is told.
    template <class Share>
    [[nodiscard]] glm::dvec3 direct_light(
        const Path& path, const Vertex& vertex, const Numbers& v, const Share& share, TracedVertex& seen) const;

    RenderSettings settings_;
    Scene scene_;
    World world_;
    SampledLights lights_;
};

}  // namespace tandem::oracle
