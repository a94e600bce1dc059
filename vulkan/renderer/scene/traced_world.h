// The primitives of a scene as acceleration structures, for the device's own traversal.
#pragma once

#include "vulkan/framework/pipeline.h"
#include "vulkan/renderer/scene/scene_data.h"
#include "vulkan/renderer/tracer_tuning.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem {

// Why the shape's kernels cannot do what was asked for; empty: they can.
[[nodiscard]] std::string untraceable(KernelShape shape, const RenderSettings& settings);

// The box of every primitive by kind (triangles, spheres, cuboids) and slot. It holds every point at which the device's
// arithmetic can find the primitive from any origin that the scene's rays have, at any time.
using KindBoxes = std::array<std::vector<vk::AabbPositionsKHR>, 3>;

// What is traversed. For what the other has, boxes and corners are NaN, which makes them inactive; where one has all,
// the other is empty.
struct TracedGeometry {
    KindBoxes boxes;
    std::vector<gpu::Vec3> corners;  // of triangles that the device tests, three a slot
};
// `effects`: that kernels simulate. `device_triangles`: triangles of entities at rest are the device's.
[[nodiscard]] TracedGeometry traced_geometry(
    const Scene& scene, const SceneData& data, EffectSet effects, bool device_triangles);

// Two acceleration structures, over boxes, a geometry a kind, and over triangles, which the device builds. Then the one
// over both, and the descriptor set that names it.
class TracedWorld {
public:
    // Builds, and waits for it. `set`: the layout of the set, whose only binding is the structure. The device must have
    // DeviceFeatures::ray_tracing or ray_queries.
    TracedWorld(const Device& device, const TracedGeometry& geometry, vk::DescriptorSetLayout set);

    [[nodiscard]] vk::DescriptorSet descriptors() const { return descriptors_[0]; }

private:
    // A structure, what it is built from, and the buffer it lies in.
    struct Level {
        vk::AccelerationStructureTypeKHR type;
        std::vector<vk::AccelerationStructureGeometryKHR> geometries;
        std::vector<std::uint32_t> counts;
        vk::DeviceSize scratch_bytes;
        BufferGroup storage;
        vk::raii::AccelerationStructureKHR structure;
    };
    [[nodiscard]] static Level make_level(const Device& device, vk::AccelerationStructureTypeKHR type,
        std::vector<vk::AccelerationStructureGeometryKHR> geometries, std::vector<std::uint32_t> counts);
    [[nodiscard]] static std::vector<Level> make_bottom(
        const Device& device, const BufferGroup& inputs, const TracedGeometry& geometry);
    [[nodiscard]] static Level make_top(
        const Device& device, const BufferGroup& inputs, const std::vector<Level>& bottom);
    static void record_build(const vk::raii::CommandBuffer& commands, const Level& level, vk::DeviceAddress scratch);

    BufferGroup inputs_;  // boxes, corners and instances
    std::vector<Level> bottom_;
    Level top_;
    DescriptorSets descriptors_;
};

}  // namespace tandem
