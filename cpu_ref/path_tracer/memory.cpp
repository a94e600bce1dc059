#include "cpu_ref/path_tracer/memory.h"

#include <algorithm>

#include "common/processors.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

namespace {

// Columns of FaceTable, but the entity's.
constexpr std::uint64_t columns_of_face = 27;
// Columns of SphereTable.
constexpr std::uint64_t columns_of_sphere = 36;

// Bytes of Embree 3.13.5 for a primitive at RTC_BUILD_QUALITY_HIGH, as measured on hilly grids of 10^6 to 4 10^6
// triangles. The first is of its corners, tree and leaves, the second of what its builder gives back. It stands for
// other qualities too.
constexpr std::uint64_t tree_bytes = 140, builder_bytes = 75;

template <class Real>
void add_tables(MemoryForecast& forecast, const PlacedCounts& placed, bool moves) {
    const std::uint64_t faces = placed.triangles + 2 * placed.spheres + 6 * placed.cuboids;
    const std::uint64_t of_faces = faces * (columns_of_face + (moves ? 1 : 0)) * sizeof(Real);
    const std::uint64_t of_spheres = placed.spheres * columns_of_sphere * sizeof(Real);
    forecast.tables += placed.all() * (sizeof(PrimitiveRef) + sizeof(BoundingBox)) +
                       placed.triangles * sizeof(TriangleForm<Real>) + placed.spheres * sizeof(SphereForm<Real>) +
                       placed.cuboids * sizeof(CuboidForm<Real>) + of_faces + of_spheres;
    // Columns are made of rows, which go when all are done, and before trees are made.
    const std::uint64_t trees = placed.all() * tree_bytes, rows = of_faces + of_spheres;
    forecast.building = std::max(forecast.building, rows - std::min(rows, trees));
}

}  // namespace

MemoryForecast memory_forecast(
    const Scene& scene, const RenderSettings& settings, Precision precision, unsigned threads) {
    const PlacedCounts placed = placed_counts(scene, placed_meshes(scene, settings));
    const bool moves =
        std::ranges::any_of(scene.entities, [](const Entity& entity) { return entity.motion != glm::dvec3(0.0); });
    const bool in_double = precision != Precision::single_precision;
    MemoryForecast forecast;
    if (in_double)
        add_tables<double>(forecast, placed, moves);
    else
        add_tables<float>(forecast, placed, moves);
    if (precision == Precision::mixed) add_tables<float>(forecast, placed, moves);  // shading's own
    const std::uint64_t copies = precision == Precision::mixed ? 2 : 1;
    const std::uint64_t vertex = sizeof(glm::dvec3) * (scene.normals.empty() ? 1 : 2) +
                                 (scene.texture_coordinates.empty() ? 0 : sizeof(glm::dvec2));
    forecast.tables += copies * (placed.mesh_triangles * sizeof(std::array<std::uint32_t, 3>) +
                                    placed.mesh_vertices * vertex + placed.places * sizeof(MeshTable::Place));
    const std::uint64_t in_trees = placed.all() + placed.mesh_triangles + placed.places;
    forecast.trees = in_trees * tree_bytes;
    forecast.building = std::max(forecast.building, in_trees * builder_bytes + placed.mesh_triangles * sizeof(Corners));
    // A thread has its paths, its part of a batch, and Embree's.
    constexpr std::uint64_t thread_bytes = std::uint64_t{3} << 20;
    constexpr std::uint64_t pools = std::uint64_t{12} << 20;  // of TBB, Embree, and what allocators keep
    forecast.workers = pools + (threads == 0 ? usable_processors() : threads) * thread_bytes;
    // The sums that a stop falls back on; compensated ones are added up in a plane of their own.
    forecast.pass_pixel = channel_count * sizeof(Moments);
    if (settings.accumulation.value_or(Accumulation::in_double) != Accumulation::in_double)
        forecast.pass_pixel += channel_count * sizeof(Moments);
    return forecast;
}

}  // namespace tandem::cpu
