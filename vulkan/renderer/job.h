// One scene on one device: records, submits and collects the six stages.
#pragma once

#include "common/renderer.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/frame_resources.h"

namespace tandem {

class VulkanJob : public RenderJob {
public:
    VulkanJob(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
        const RenderSettings& settings, Acceleration acceleration, PlantedBug planted_bug);

    [[nodiscard]] JobFacts facts() const override;
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override;

private:
    // A run of pixels that are in flight together.
    struct Tile {
        std::uint32_t first_pixel, pixel_count;
    };
    struct Progress;

    [[nodiscard]] std::uint64_t render_tile_block(Tile tile, SampleRange block, Progress& progress);
    void record_pre_processing(Tile tile);
    void record_sampling(Tile tile, std::uint64_t sample, std::uint32_t first_segment, std::uint32_t end_segment);
    void record_post_processing(Tile tile);
    void bind(
        const vk::raii::CommandBuffer& commands, Stage stage, const gpu::Settings& settings, std::uint32_t ray_parity);
    void dispatch_queue(const vk::raii::CommandBuffer& commands, Stage stage, const gpu::Settings& settings);
    void dispatch(const vk::raii::CommandBuffer& commands, Stage stage, const gpu::Settings& settings,
        std::uint32_t invocations, std::uint32_t ray_parity = 0);
    [[nodiscard]] gpu::Settings stage_settings(Tile tile, std::uint64_t sample) const;
    void download(Tile tile);
    void collect(Tile tile, Estimate::Plane& plane) const;
    void adapt_batch(double seconds, std::uint64_t segments);
    [[nodiscard]] std::uint64_t record_batch(Tile tile, SampleRange block, std::uint64_t& done, std::uint32_t& segment);

    const Instance& instance_;
    RenderSettings settings_;
    SceneData scene_;
    Specialisation specialisation_;
    const PipelineLayout& layout_;
    std::shared_ptr<const Stages::Pipelines> pipelines_;
    std::uint32_t tile_pixels_;
    FrameResources resources_;
    Submission submission_;
    bool scene_uploaded_ = false;
    std::uint32_t sum_parity_ = 0;      // the half of the sums that holds the current ones
    std::uint64_t batch_ = 1;           // path segments a submission, over one or several samples
    std::uint32_t invalid_before_ = 0;  // of the device's running count
};

}  // namespace tandem
