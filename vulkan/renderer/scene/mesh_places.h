// The places of meshes that entities share (common/render/instancing.h), with the data that trees and rays need.
#pragma once

#include <vector>

#include "common/render/instancing.h"
#include "vulkan/renderer/scene/bvh.h"

namespace tandem {

struct MeshPlace {
    std::uint32_t entity = 0, mesh = 0;
    Box box;          // world, widened as those of triangles are (world_boxes.cpp)
    float reach = 0;  // at least the greatest sum of terms of a corner's coordinate in the world
};

// By ascending entity.
[[nodiscard]] std::vector<MeshPlace> mesh_places(const Scene& scene, const PlacedMeshes& placed);

// The box of a triangle in object space, as it is: what rays are off by there, they bring
// (shaders/geometry/mesh_hits.glsl).
[[nodiscard]] Box object_box(const Scene& scene, const Primitive& triangle);

}  // namespace tandem
