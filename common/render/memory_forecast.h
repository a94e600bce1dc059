// Interface of a Renderer that can forecast how much memory a scene will take.
#pragma once

#include <cstdint>

#include "common/render/instancing.h"

namespace tandem {

// Bytes of this machine's memory, beside the scene itself and the sums that an estimate holds.
struct MemoryForecast {
    std::uint64_t tables = 0;      // of the scene
    std::uint64_t trees = 0;       // of intersection
    std::uint64_t building = 0;    // besides, while tables and trees are made
    std::uint64_t workers = 0;     // paths of all threads, and of a device that shares this memory
    std::uint64_t job_pixel = 0;   // a pixel, as long as the job lives
    std::uint64_t pass_pixel = 0;  // a pixel, while samples are in hand
};

class ForecastingRenderer {
public:
    virtual ~ForecastingRenderer() = default;
    // `pixels`: that are in flight at once.
    [[nodiscard]] virtual MemoryForecast forecast(
        const Scene& scene, const RenderSettings& settings, std::uint64_t pixels) const = 0;
};

// Primitives as placed, kind by kind, without those of entities that place meshes; and those meshes (instancing.h).
struct PlacedCounts {
    std::uint64_t triangles = 0, spheres = 0, cuboids = 0;
    std::uint64_t mesh_triangles = 0, mesh_vertices = 0, places = 0;
    [[nodiscard]] std::uint64_t all() const { return triangles + spheres + cuboids; }
};
[[nodiscard]] PlacedCounts placed_counts(const Scene& scene, const PlacedMeshes& meshes = {});

}  // namespace tandem
