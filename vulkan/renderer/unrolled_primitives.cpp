#include "vulkan/renderer/unrolled_primitives.h"

#include <algorithm>

namespace tandem {

namespace {

// As is_aligned of shaders/scene_set.glsl finds on the device.
bool is_aligned(const gpu::EntityTransform& m) {
    const gpu::Vec3 &a = m.to_object0, &b = m.to_object1, &c = m.to_object2;
    return a.y == 0 && a.z == 0 && b.x == 0 && b.z == 0 && c.x == 0 && c.y == 0;
}

struct Corner {
    std::uint32_t entity;
    float x, y, z;
    bool operator==(const Corner&) const = default;
};

Corner corner_of(const SceneData& scene, std::size_t corner) {
    const gpu::PrimitiveSource& source = scene.sources[corner / 3];
    const std::array<std::uint32_t, 3> index{source.index0, source.index1, source.index2};
    const gpu::Vec4& vertex = scene.vertices[index[corner % 3]];
    return {source.entity, vertex.x, vertex.y, vertex.z};
}

}  // namespace

UnrolledPrimitives describe_unrolled(const SceneData& scene) {
    UnrolledPrimitives result;
    for (std::uint32_t i = 0; i < scene.cuboid_count; ++i)
        if (is_aligned(scene.transforms[scene.sources[scene.triangle_count + scene.sphere_count + i].entity]))
            result.aligned_cuboids |= 1u << i;
    std::vector<Corner> seen;
    for (std::uint32_t i = 0; i < 3 * scene.triangle_count; ++i) {
        seen.push_back(corner_of(scene, i));
        const auto first = static_cast<std::uint32_t>(std::ranges::find(seen, seen.back()) - seen.begin());
        result.corners[i / 3] |= first << 8 * (i % 3);
    }
    return result;
}

}  // namespace tandem
