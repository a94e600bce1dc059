// Records the commands for samples of a tile: an interface with one implementation for each kernel shape. A job chooses
// tile and samples, submits, and decides when to stop.
#pragma once

#include <memory>

#include "common/render/estimate.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/recorders/frame_kernels.h"
#include "vulkan/resources/image.h"

namespace tandem {

// Names of recordings, for pre-recorded ones to be found again.
enum class RecordingKind : std::uint32_t {
    clearing,
    first_clearing,
    sampling,
    accumulating,
    whole_paths,
    first_whole_paths,
    listing,
    asking,
    restoring,
    downloading,
    counting,
    showing
};

[[nodiscard]] inline Submission::Key recording_key(RecordingKind kind, std::uint64_t first, std::uint64_t second = 0,
    std::uint64_t third = 0, std::uint64_t fourth = 0) {
    return {static_cast<std::uint32_t>(kind), first, second, third, fourth};
}

// The image that a frame ends in.
struct FrameTarget {
    vk::Image image;
    vk::ImageView view;
    ImageUse before, after;  // of the frame's commands, which leave the image ready for the latter
    // With a swapchain's image the stage of `before` waits for `acquired`, and `rendered` is signalled. Else null.
    vk::Semaphore acquired, rendered;
};

class FrameRecorder {
public:
    FrameRecorder() = default;
    virtual ~FrameRecorder() = default;
    FrameRecorder(const FrameRecorder&) = delete;
    FrameRecorder& operator=(const FrameRecorder&) = delete;

    // The samples of a block are next, in portions: one for each submission. `keeps_sums`: they are added to the sums
    // of the block before.
    virtual void begin(const Tile& tile, SampleRange block, bool keeps_sums) = 0;
    // Adds the next portion.
    virtual void add_portion() = 0;
    // Its submission took so long: later portions grow or shrink.
    virtual void took(double seconds) = 0;
    // Samples that are done for every pixel, the last portion counting as done; and of the next sample the part done.
    [[nodiscard]] virtual std::uint64_t done() const = 0;
    [[nodiscard]] virtual double done_of_next() const = 0;
    // Whether a stop may drop what is done of the next sample; else that sample's portions are to be added, too.
    [[nodiscard]] virtual bool drops_parts() const { return true; }
    // Whether the next portion counts invalid samples of a sample that later ones complete.
    [[nodiscard]] virtual bool counts_part_of_next() const { return false; }

    // Adds samples [0, samples) of a tile, all at once.
    virtual void add_frame(const Tile& tile, std::uint64_t samples) = 0;
    // Later frames end in this image. Throws UnsupportedError where the kernel shape has none.
    virtual void set_target(const FrameTarget& target);
    // Whether patterns want a frame in portions.
    [[nodiscard]] virtual bool cuts_frames() const = 0;
    // Samples of single pixels for which a tile may hold several blocks side by side; 0: blocks follow each other.
    [[nodiscard]] virtual std::uint64_t side_by_side() const = 0;
};

// What recorders are made of. The references must outlive them.
struct RecorderInput {
    const Device& device;
    Stages& stages;
    const Scene& scene;  // need not outlive them
    const SceneData& data;
    const RenderSettings& settings;
    const Specialisation& specialisation;
    const JobPatterns& patterns;
    std::uint32_t segments;  // that a path can have
    FrameKernels& kernels;
    Submission& submission;
};

// The recorder of the kernel shape. Throws UnsupportedError where shape, patterns and scene do not go together.
[[nodiscard]] std::unique_ptr<FrameRecorder> make_recorder(const RecorderInput& input);

}  // namespace tandem
