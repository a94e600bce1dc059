// The six stages of the thesis: a portion is whole samples, or some path segments of one.
#pragma once

#include "vulkan/renderer/kernels/stage_plan.h"
#include "vulkan/renderer/recorders/frame_recorder.h"

namespace tandem {

class StageRecorder : public FrameRecorder {
public:
    explicit StageRecorder(const RecorderInput& input);

    void begin(const Tile& tile, SampleRange block, bool keeps_sums) override;
    void add_portion() override;
    void took(double seconds) override;
    [[nodiscard]] std::uint64_t done() const override { return plan_.done(); }
    [[nodiscard]] double done_of_next() const override { return plan_.done_of_next(); }
    void add_frame(const Tile& tile, std::uint64_t samples) override;
    [[nodiscard]] bool cuts_frames() const override { return fixed_batch_; }
    [[nodiscard]] std::uint64_t side_by_side() const override { return 0; }

protected:
    [[nodiscard]] const FrameKernels& kernels() const { return kernels_; }
    [[nodiscard]] Submission& submission() { return submission_; }
    // Adds all that is left of the block.
    void add_rest() { add_shares(plan_.rest()); }

private:
    // Orders the kernels of a segment after the writes of those before.
    virtual void order_segment(const vk::raii::CommandBuffer& commands) const = 0;
    // Records a kernel over the rays of its segment.
    virtual void record_segment(
        const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const = 0;

    // Whether a finished sample waits for a stage of its own to add it to the sums; else paths do that as they end.
    [[nodiscard]] virtual bool accumulates() const { return true; }
    // What the first recording of a frame or a block has besides, and a number that tells such recordings apart.
    virtual void record_preparation(const vk::raii::CommandBuffer&) const {}
    [[nodiscard]] virtual std::uint64_t preparation_key() const { return 0; }
    // Whether the device knows how many rays a segment has.
    [[nodiscard]] virtual bool counts_rays() const = 0;

    void add_shares(const std::vector<StageShare>& shares);
    void add_clearing();
    void add_sampling(const StageShare& share);
    void add_accumulating(std::uint64_t sample);
    void add_question();
    void record_sampling(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings,
        std::uint32_t sum_parity, const StageShare& share) const;

    FrameKernels& kernels_;
    Submission& submission_;
    bool fixed_batch_;
    StagePlan plan_;
    Tile tile_;
    SampleRange block_{0, 0};
};

}  // namespace tandem
