// Rays of the caller on the device (common/ray_batch.h), by the closest-hit code of the tracer.
#pragma once

#include "common/renderer.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/frame_resources.h"

namespace tandem {

class VulkanIntersector : public RayIntersector {
public:
    VulkanIntersector(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
        const RenderSettings& settings, Acceleration acceleration);

    [[nodiscard]] RayHits intersect(std::span<const GivenRay> rays) override;

private:
    void stage(std::span<const GivenRay> rays);
    void fetch(std::span<RayHit> hits) const;
    [[nodiscard]] double trace(std::uint32_t count);
    void place_scene();

    const Instance& instance_;
    SceneData scene_;
    const PipelineLayout& layout_;
    std::shared_ptr<const Stages::RayPipelines> pipelines_;
    FrameResources resources_;
    BufferGroup upload_, readback_;
    Submission submission_;
    std::vector<std::uint32_t> slots_;  // by primitive id
};

// Throws UnsupportedError for kernels that are the CPU's alone.
void check_kernels(const IntersectionSettings& chosen);

}  // namespace tandem
