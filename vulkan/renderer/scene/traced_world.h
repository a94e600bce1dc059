// The primitives of a scene as a ray-tracing pipeline traverses them.
#pragma once

#include "vulkan/framework/pipeline.h"
#include "vulkan/renderer/scene/scene_data.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem {

// Why intersection shaders cannot do the scene; empty: they can.
[[nodiscard]] std::string untraceable(const Scene& scene, const RenderSettings& settings);

// The box of every primitive by kind (triangles, spheres, cuboids) and slot. It holds every point at which the device's
// arithmetic can find the primitive from any origin that the scene's rays have.
using KindBoxes = std::array<std::vector<vk::AabbPositionsKHR>, 3>;
[[nodiscard]] KindBoxes traced_boxes(const Scene& scene, const SceneData& data);

// An acceleration structure over boxes, a geometry a kind, which the device builds, and the descriptor set that names
// it.
class TracedWorld {
public:
    // Builds, and waits for it. `set`: the layout of the set, whose only binding is the structure. The device must have
    // DeviceFeatures::ray_tracing.
    TracedWorld(const Device& device, const KindBoxes& boxes, vk::DescriptorSetLayout set);

    [[nodiscard]] vk::DescriptorSet descriptors() const { return descriptors_[0]; }

private:
    // A structure, the buffer it lies in and what building it takes.
    struct Level {
        BufferGroup storage;
        vk::raii::AccelerationStructureKHR structure;
        vk::DeviceSize scratch_bytes;
    };
    [[nodiscard]] static Level make_level(const Device& device, vk::AccelerationStructureTypeKHR type,
        std::span<const vk::AccelerationStructureGeometryKHR> geometries, std::span<const std::uint32_t> counts);

    BufferGroup inputs_;  // boxes, and the instance
    std::array<vk::AccelerationStructureGeometryKHR, 3> boxes_;
    Level bottom_;
    vk::AccelerationStructureGeometryKHR instance_;
    Level top_;
    DescriptorSets descriptors_;
};

}  // namespace tandem
