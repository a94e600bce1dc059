// Kernels that follow paths to their end. A portion is one dispatch, of several samples of every pixel, or of one
// sample of some of them.
#pragma once

#include "vulkan/renderer/kernels/megakernel_plan.h"
#include "vulkan/renderer/recorders/frame_recorder.h"

namespace tandem {

class WholePathRecorder : public FrameRecorder {
public:
    // `stage`: the kernel that follows the paths.
    WholePathRecorder(const RecorderInput& input, Stage stage);

    void begin(const Tile& tile, SampleRange block, bool keeps_sums) override;
    void add_portion() override;
    void took(double seconds) override { plan_.took(seconds); }
    [[nodiscard]] std::uint64_t done() const override { return plan_.done(); }
    [[nodiscard]] double done_of_next() const override { return plan_.done_of_next(); }
    [[nodiscard]] bool counts_part_of_next() const override { return plan_.cuts_next(); }
    void add_frame(const Tile& tile, std::uint64_t samples) override;
    [[nodiscard]] bool cuts_frames() const override { return false; }
    [[nodiscard]] std::uint64_t side_by_side() const override { return plan_.batch(); }

protected:
    [[nodiscard]] const FrameKernels& kernels() const { return kernels_; }

private:
    // Records the kernel over the places that the dispatch names.
    virtual void record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const = 0;

    void add_share(const Tile& tile, std::uint64_t block_begin, const MegakernelShare& share, bool keeps_sums);

    FrameKernels& kernels_;
    Submission& submission_;
    Stage stage_;
    MegakernelPlan plan_;
    Tile tile_;
    std::uint64_t block_begin_ = 0;
    bool keeps_sums_ = false;
};

}  // namespace tandem
