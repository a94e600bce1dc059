#include "vulkan/renderer/kernels/unrolled_primitives.h"

#include <algorithm>
#include <vector>

namespace tandem {

namespace {

bool is_diagonal(const auto& row0, const auto& row1, const auto& row2) {
    return row0.y == 0 && row0.z == 0 && row1.x == 0 && row1.z == 0 && row2.x == 0 && row2.y == 0;
}

// As is_aligned of shaders/scene/scene_set.glsl finds on the device.
bool is_aligned(const gpu::EntityTransform& m) { return is_diagonal(m.to_object0, m.to_object1, m.to_object2); }

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

bool is_unturned(const SceneData& scene) {
    return std::all_of(scene.sources.begin() + scene.triangle_count, scene.sources.begin() + scene.primitives(),
        [&](const gpu::PrimitiveSource& source) {
            const gpu::EntityTransform& m = scene.transforms[source.entity];
            return is_aligned(m) && is_diagonal(m.to_world0, m.to_world1, m.to_world2);
        });
}

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
