// One scene on one device: records, submits and collects the kernels of its shape.
#pragma once

#include <limits>

#include "common/render/renderer.h"
#include "vulkan/command/ordering.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/job/bindings.h"
#include "vulkan/renderer/job/path_tracing.h"
#include "vulkan/renderer/kernels/megakernel_plan.h"
#include "vulkan/renderer/scene/traced_world.h"

namespace tandem {

class VulkanJob : public RenderJob {
public:
    VulkanJob(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
        const RenderSettings& settings, Acceleration acceleration, PlantedFault planted_bug,
        const Patterns& patterns = {}, GeometryPrecision precision = GeometryPrecision::single_precision);

    [[nodiscard]] JobFacts facts() const override;
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override;
    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override;
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override;
    // What a window would show next: `samples` samples of every pixel from sample 0 on, left on the device, where
    // render() would fetch sums block by block. `fresh`: scene and camera are sent anew. Throws UnsupportedError where
    // the image does not fit on the device at once.
    [[nodiscard]] SubmissionTimes frame(std::uint64_t samples, bool fresh = false);
    // The two halves of a frame in one submission: other jobs may be at work between them, this one may not be used.
    void start_frame(std::uint64_t samples, bool fresh = false);
    [[nodiscard]] SubmissionTimes finish_frame();
    [[nodiscard]] const Specialisation& specialisation() const { return specialisation_; }

private:
    // A run of pixels, or of places in a list of them, that are in flight together.
    struct Tile {
        std::uint32_t first_pixel, pixel_count;
    };
    struct Progress;

    // A stage and what it is to be told, as it stands when it is recorded.
    struct Dispatch {
        Stage stage;
        gpu::Settings settings;
        std::uint32_t ray_parity, sum_parity;
    };

    [[nodiscard]] std::uint64_t render_tile_block(Tile tile, SampleRange block, Progress& progress);
    [[nodiscard]] std::uint64_t render_by_stages(Tile tile, SampleRange block, Progress& progress);
    [[nodiscard]] std::uint64_t render_by_megakernel(Tile tile, SampleRange block, Progress& progress);
    // `all`: of the image, or of the list.
    [[nodiscard]] RenderResult render_film(
        SampleRange range, Tile all, std::uint32_t width, std::uint32_t height, const RenderControl& control);
    // The pixels that are this job's.
    [[nodiscard]] Tile part() const;
    [[nodiscard]] Specialisation with_parameters(Specialisation specialisation) const;
    void choose_candidates(Specialisation& specialisation) const;  // by the pattern
    void begin_frame(bool fresh);
    void add_whole_paths(Tile tile, std::uint64_t samples);
    void begin_submission();
    // Submits what was added and waits.
    [[nodiscard]] SubmissionTimes submit();
    // The same; returns the seconds that it took.
    double run(Progress& progress);
    void record_scene(
        const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t sum_parity) const;
    [[nodiscard]] std::uint32_t claimants(std::uint32_t places) const;
    void add_megakernel(Tile tile, std::uint64_t first_sample, const MegakernelShare& share);
    void add_pixel_list(Tile tile);
    void add_pre_processing(Tile tile);
    void add_sampling(Tile tile, std::uint64_t sample, std::uint32_t first_segment, std::uint32_t end_segment);
    void add_post_processing(Tile tile, std::uint64_t sample);
    void bind(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const;
    void record_queue(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const;
    void record_fragments(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const;
    void record_rays(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const;
    void prepare_fragments(Stages& stages);
    void prepare_rays(const Scene& scene);
    [[nodiscard]] std::vector<Tile> tiles() const;
    void record(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t invocations) const;
    [[nodiscard]] gpu::Settings stage_settings(Tile tile, std::uint64_t sample) const;
    void download(Tile tile);
    void collect(Tile tile, std::vector<Estimate::Plane>& planes);
    [[nodiscard]] std::uint64_t blocks_at_once(SampleRange left, std::uint64_t pixels) const;
    [[nodiscard]] Moments moments_of(const gpu::Vec4& sums) const;
    void adapt_batch(double seconds, std::uint64_t segments);
    [[nodiscard]] KernelForm form() const {
        return KernelForm(patterns_, precision_,
            accumulation_ == Accumulation::in_double && precision_ == GeometryPrecision::single_precision);
    }
    [[nodiscard]] std::uint64_t add_batch(
        Tile tile, SampleRange block, std::uint64_t most, std::uint64_t& done, std::uint32_t& segment);

    const Instance& instance_;
    const Device& device_;
    Patterns patterns_;
    GeometryPrecision precision_;
    RenderSettings settings_;
    SceneData scene_;
    std::span<const std::uint32_t> listed_;  // of the render in hand; empty: all pixels
    std::uint32_t tile_listed_ = 0;          // of them in the tile, which holds them once for each block
    Specialisation specialisation_;
    std::uint32_t segments_;         // of a sample, that the stages are dispatched for
    std::optional<PathState> kept_;  // from vertex to vertex in buffers
    Accumulation accumulation_;
    const Stages& stages_;
    const PipelineLayout& layout_;
    std::shared_ptr<const Stages::Pipelines> pipelines_;
    std::uint32_t tile_pixels_;
    FrameResources resources_;
    Bindings bindings_;
    Ordering ordering_;
    Submission submission_;
    const FullscreenPass* pass_ = nullptr;  // of fragments, as is the framebuffer
    vk::raii::Framebuffer framebuffer_ = nullptr;
    std::optional<TracedWorld> traced_world_;  // of the ray-tracing pipeline
    bool scene_uploaded_ = false;
    std::uint32_t sum_parity_ = 0;  // the half of the sums that holds the current ones
    std::uint64_t batch_ = 1;       // path segments a submission, over one or several samples
    MegakernelPlan plan_;
    // Plain sums: they go on where the block begins with the sample that they go up to. A block brings what they have
    // grown by since `running_`.
    bool keeps_sums_ = false;
    static constexpr std::uint64_t nowhere = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t summed_to_ = nowhere;
    Estimate::Plane running_;
    std::uint32_t invalid_before_ = 0;      // of the device's running count
    std::unique_ptr<PathTracing> tracing_;  // made when a path is to be traced
};

}  // namespace tandem
