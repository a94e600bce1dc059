#include "common/render/memory_forecast.h"

namespace tandem {

// An entity's primitives are counted once for all that share their range.
PlacedCounts placed_counts(const Scene& scene) {
    // Before each primitive: how many there are of a kind.
    std::vector<std::uint32_t> spheres(1, 0), cuboids(1, 0);
    spheres.reserve(scene.primitives.size() + 1);
    cuboids.reserve(scene.primitives.size() + 1);
    for (const Primitive& primitive : scene.primitives) {
        spheres.push_back(spheres.back() + (primitive.kind == PrimitiveKind::sphere ? 1 : 0));
        cuboids.push_back(cuboids.back() + (primitive.kind == PrimitiveKind::cuboid ? 1 : 0));
    }
    PlacedCounts counts;
    for (const Entity& entity : scene.entities) {
        const std::size_t begin = entity.first_primitive, end = begin + entity.primitive_count;
        const std::uint64_t round = spheres[end] - spheres[begin], boxes = cuboids[end] - cuboids[begin];
        counts.spheres += round;
        counts.cuboids += boxes;
        counts.triangles += entity.primitive_count - round - boxes;
    }
    return counts;
}

}  // namespace tandem
