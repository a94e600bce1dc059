// Rays of the caller on the device (common/render/ray_batch.h), by the closest-hit code of the tracer.
#pragma once

#include "common/render/renderer.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/kernels/bindings.h"

namespace tandem {

class VulkanIntersector : public RayIntersector {
public:
    VulkanIntersector(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
        const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision);

    [[nodiscard]] RayHits intersect(std::span<const GivenRay> rays) override;

private:
    template <class Vec4>
    void stage(std::span<const GivenRay> rays);
    template <class Vec4>
    void fetch(std::span<RayHit> hits) const;
    [[nodiscard]] double trace(std::uint32_t count);
    void place_scene();

    const Instance& instance_;
    GeometryPrecision precision_;
    std::size_t element_;  // bytes of four numbers
    SceneData scene_;
    std::shared_ptr<const Stages::RayPipelines> pipelines_;
    FrameResources resources_;
    Bindings bindings_;
    BufferGroup upload_, readback_;
    Submission submission_;
    std::vector<std::uint32_t> slots_;  // by primitive id
};

// Throws UnsupportedError for kernels that are the CPU's alone.
void check_kernels(const IntersectionSettings& chosen);

}  // namespace tandem
