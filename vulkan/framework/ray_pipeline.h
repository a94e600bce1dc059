// A ray-tracing pipeline over boxes and triangles, and its shader binding table.
#pragma once

#include "vulkan/framework/pipeline.h"
#include "vulkan/resources/buffer_group.h"

namespace tandem {

class RayPipeline {
public:
    // SPIR-V, each module with the entry point `main`.
    struct Code {
        std::span<const std::uint32_t> generation, miss;
        // Hit groups: an intersection shader a geometry, all with the same any-hit shader and no closest-hit shader.
        std::vector<std::span<const std::uint32_t>> intersections;
        std::span<const std::uint32_t> any_hit;
        // One more hit group, if they are not empty, of triangles that the device tests.
        std::span<const std::uint32_t> triangle_any_hit = {}, triangle_closest_hit = {};

        [[nodiscard]] std::size_t hit_groups() const { return intersections.size() + !triangle_closest_hit.empty(); }
    };

    // Rays may be traced from the generation shader alone. The device must have DeviceFeatures::ray_tracing.
    RayPipeline(const Device& device, vk::PipelineLayout layout, const Code& code,
        std::span<const SpecialisationConstant> constants);

    [[nodiscard]] vk::Pipeline handle() const { return *pipeline_; }
    // So many invocations, in a row. Pipeline and descriptors are bound.
    void trace(const vk::raii::CommandBuffer& commands, std::uint32_t invocations) const;

private:
    vk::raii::Pipeline pipeline_;
    BufferGroup table_;
    vk::StridedDeviceAddressRegionKHR generation_, miss_, hits_;
};

}  // namespace tandem
