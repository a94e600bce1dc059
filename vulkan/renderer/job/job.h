// One scene on one device. Cuts a render into blocks of samples and tiles of pixels, and submits what the recorder of
// its kernel shape adds (recorders/). Decides when to stop, and collects the sums: those of a block while the device
// renders the next one.
#pragma once

#include "common/render/renderer.h"
#include "vulkan/renderer/job/path_tracing.h"
#include "vulkan/renderer/job/running_sums.h"
#include "vulkan/renderer/recorders/frame_recorder.h"

namespace tandem {

class VulkanJob : public RenderJob {
public:
    VulkanJob(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
        const RenderSettings& settings, Acceleration acceleration, PlantedFault planted_bug,
        const JobPatterns& patterns = {}, GeometryPrecision precision = GeometryPrecision::single_precision);

    [[nodiscard]] JobFacts facts() const override;
    [[nodiscard]] bool goes_on_in_blocks() const override { return accumulation_ == Accumulation::in_double; }
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override;
    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override;
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override;
    [[nodiscard]] std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) override;
    [[nodiscard]] bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) override;
    // Renders what a window would show next: `samples` samples of every pixel from sample 0 on. They stay on the
    // device, while render() fetches sums block by block. `fresh`: scene and camera are sent anew. Throws
    // UnsupportedError where the image does not fit on the device at once. The thesis's frame goes on with later
    // samples (thesis_recorder.h).
    [[nodiscard]] SubmissionTimes frame(std::uint64_t samples, bool fresh = false);
    // Later frames end in this image (FrameRecorder::set_target).
    void show_in(const FrameTarget& target) { recorder_->set_target(target); }
    // The two halves of a frame in one submission: other jobs may be at work between them, this one may not be used.
    void start_frame(std::uint64_t samples, bool fresh = false);
    // The two halves of start_frame(). What is added to submission() before, between and after them goes with the frame
    // in this order.
    void add_frame(std::uint64_t samples, bool fresh = false);
    void submit_frame();
    [[nodiscard]] Submission& submission() { return submission_; }
    // Where the sums of the frame that was added last will lie once it ran, [channel * pixels + pixel]
    // (shaders/kernels/moments.glsl). Two places take turns.
    [[nodiscard]] std::uint32_t sums_place() const { return kernels_.sum_parity(); }
    [[nodiscard]] vk::DescriptorBufferInfo sums(std::uint32_t place) const;
    [[nodiscard]] SubmissionTimes finish_frame();
    [[nodiscard]] const Specialisation& specialisation() const { return specialisation_; }

private:
    // What a render is of: a part of the image, or a list of pixels.
    struct Film {
        Tile all;
        std::uint32_t width, height;
        std::span<const std::uint32_t> listed = {};
    };
    struct Progress;
    // What samples of a block are added to: nothing, what the device holds, or FrameResources::sums_to_copy().
    enum class Sums { cleared, kept, restored };

    [[nodiscard]] RenderResult render_film(SampleRange range, const Film& film, const RenderControl& control);
    [[nodiscard]] Tile begin_tile(const Film& film, std::uint32_t first, std::uint32_t end, Progress& progress);
    [[nodiscard]] std::uint64_t render_at_once(
        SampleRange block, std::uint64_t blocks, const Film& film, Progress& progress, Estimate& estimate);
    [[nodiscard]] bool render_tiles(SampleRange samples, const Film& film, Progress& progress,
        std::vector<Estimate::Plane>& planes, std::vector<gpu::Vec4>& sums);
    [[nodiscard]] std::uint64_t render_in_passes(
        SampleRange block, const Film& film, Progress& progress, Estimate& estimate);
    [[nodiscard]] std::uint64_t render_tile_block(const Tile& tile, SampleRange block, Progress& progress, Sums sums);
    void copy_sums(const Tile& tile, const Estimate::Plane& plane, gpu::Vec4* sums) const;
    void add_sums(const Tile& tile);
    // Submits what was added and waits.
    [[nodiscard]] SubmissionTimes submit();
    // The same, while the host takes in the block before. Returns seconds: the device's where the host was at work
    // meanwhile, else wall clock.
    double run(Progress& progress);
    [[nodiscard]] std::uint64_t blocks_at_once(SampleRange left, const Film& film) const;
    // Sends the part of the list that the tile holds.
    void add_pixel_list(Tile& tile, std::span<const std::uint32_t> listed);
    void download(const Tile& tile);
    [[nodiscard]] std::uint32_t count_invalid();
    void collect(const Tile& tile, std::vector<Estimate::Plane>& planes) const;
    [[nodiscard]] Moments moments_of(const gpu::Vec4& sums) const;

    // The pixels that are this job's.
    [[nodiscard]] Tile part() const;
    // Tile after tile, in the same buffers.
    [[nodiscard]] std::vector<Tile> tiles() const;
    void begin_frame(bool fresh);
    void begin_submission();
    [[nodiscard]] PathTracing& tracing();
    [[nodiscard]] KernelForm form() const {
        return KernelForm(patterns_.vulkan, patterns_.tracer.kernel, precision_,
            accumulation_ == Accumulation::in_double && precision_ == GeometryPrecision::single_precision,
            patterns_.tracer.half_state);
    }

    const Instance& instance_;
    const Device& device_;
    JobPatterns patterns_;
    GeometryPrecision precision_;
    RenderSettings settings_;
    SceneData scene_;
    Specialisation specialisation_;
    std::uint32_t segments_;         // that a path can have
    std::optional<PathState> kept_;  // from vertex to vertex in buffers
    Accumulation accumulation_;
    Stages& stages_;
    std::shared_ptr<const Stages::Pipelines> pipelines_;
    std::uint32_t tile_pixels_;
    FrameResources resources_;
    FrameKernels kernels_;
    Submission submission_;
    std::unique_ptr<FrameRecorder> recorder_;
    RunningSums running_sums_;
    std::uint32_t invalid_before_ = 0;      // of the device's running count, what estimates know of or have dropped
    bool knows_invalid_ = true;             // false: a render failed, so the count is to be read anew
    std::unique_ptr<PathTracing> tracing_;  // made when a path is to be traced
};

}  // namespace tandem
