// The six stages of the thesis: a portion is a number of path segments, over one or several samples.
#pragma once

#include "vulkan/renderer/recorders/frame_recorder.h"

namespace tandem {

class StageRecorder : public FrameRecorder {
public:
    explicit StageRecorder(const RecorderInput& input);

    void begin(const Tile& tile, SampleRange block, bool keeps_sums) override;
    void add_portion() override;
    void took(double seconds) override;
    [[nodiscard]] std::uint64_t done() const override { return done_; }
    [[nodiscard]] double done_of_next() const override { return static_cast<double>(segment_) / segments_; }
    void add_frame(const Tile& tile, std::uint64_t samples) override;
    [[nodiscard]] bool cuts_frames() const override { return fixed_batch_; }
    [[nodiscard]] std::uint64_t side_by_side() const override { return 0; }

protected:
    [[nodiscard]] const FrameKernels& kernels() const { return kernels_; }

private:
    // Orders the kernels of a segment after the writes of those before.
    virtual void order_segment(const vk::raii::CommandBuffer& commands) const = 0;
    // Records a kernel over the rays of its segment.
    virtual void record_segment(
        const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const = 0;

    [[nodiscard]] std::uint64_t add_segments(std::uint64_t most);
    void add_clearing();
    void add_sampling(std::uint64_t sample, std::uint32_t first_segment, std::uint32_t end_segment);
    void add_accumulating(std::uint64_t sample);
    void record_sampling(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings,
        std::uint32_t sum_parity, std::uint32_t first_segment, std::uint32_t end_segment) const;

    FrameKernels& kernels_;
    Submission& submission_;
    std::uint32_t segments_;  // of a sample
    bool fixed_batch_;
    std::uint64_t batch_;  // segments of a portion
    Tile tile_;
    SampleRange block_{0, 0};
    std::uint64_t done_ = 0;     // samples of the block
    std::uint32_t segment_ = 0;  // of the next sample, which a slow device begins in one portion and ends in another
    std::uint64_t last_ = 0;     // segments of the last portion
};

}  // namespace tandem
