// Paths on the device, vertex by vertex (shaders/kernels/trace.comp), for `tandem trace` and feature images.
#pragma once

#include "common/render/estimate.h"
#include "common/render/path_trace.h"
#include "common/render/renderer.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/kernels/bindings.h"
#include "vulkan/renderer/kernels/stages.h"

namespace tandem {

// Buffers of its own: what a job renders is not touched. Records are in float, whatever computes them.
class PathTracing {
public:
    // What is referred to must outlive it. Throws UnsupportedError for paths that are too long to be kept whole.
    PathTracing(const Device& device, Stages& stages, const SceneData& scene, const Specialisation& specialisation,
        std::uint32_t bounces, GeometryPrecision precision);

    // Samples of one pixel; `settings` as every stage is told them.
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t pixel, SampleRange samples, gpu::Settings settings);

    // RenderJob::first_vertices, of all pixels.
    [[nodiscard]] bool first_vertices(
        SampleRange samples, gpu::Settings settings, const RenderControl& control, const FirstVertexVisitor& visit);

private:
    void follow(const gpu::Settings& settings);
    [[nodiscard]] std::vector<PathTrace> follow_whole(const gpu::Settings& settings);
    void record(const vk::raii::CommandBuffer& commands, const vk::raii::Pipeline& pipeline,
        const gpu::Settings& settings, std::uint32_t invocations) const;
    [[nodiscard]] PathTrace read(const gpu::Vec4* words) const;

    std::uint32_t primitives_, words_;  // a whole path's record
    std::uint32_t most_samples_;        // at a time
    std::shared_ptr<const Stages::PathPipelines> pipelines_;
    FrameResources resources_;
    Bindings bindings_;
    Submission submission_;
    bool scene_uploaded_ = false;
};

}  // namespace tandem
