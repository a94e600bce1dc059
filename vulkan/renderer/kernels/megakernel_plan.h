// How the samples of a run of pixels are shared out over submissions of the megakernel. Each holds one dispatch, of
// several samples of every pixel. On a slow device it is one sample of some of them.
#pragma once

#include <cstdint>

#include "vulkan/devices.h"

namespace tandem {

// What a submission should last: long enough that submitting costs nothing, short enough for Ctrl-C and for drivers
// that kill what takes seconds.
inline constexpr double shortest_submission = 0.1, longest_submission = 0.3;  // seconds

// Segments of a path where first submissions were measured.
inline constexpr std::uint32_t usual_segments = 13;

// The most that one path may have, as no dispatch can stop within a path: nothing but the limit of bounces may end it.
// Such paths take at most 16383 / 13 x 1.1 ms = 1.4 s of an H200 (longest_residence), and lavapipe leaves loops after
// 65535 turns.
inline constexpr std::uint32_t most_whole_path_segments = 16383;

// One dispatch.
struct MegakernelShare {
    std::uint64_t first_sample = 0, samples = 0;
    std::uint32_t first_invocation = 0, invocations = 0;
    bool completes = false;  // its samples, for every pixel
};

class MegakernelPlan {
public:
    // A plan for a device whose speed is not known yet. `segments`: that a path can have.
    explicit MegakernelPlan(const DeviceDescription& device, std::uint32_t segments = usual_segments);

    // Samples [0, samples) of `pixels` pixels are next.
    void begin(std::uint32_t pixels, std::uint64_t samples);
    // The next share of them.
    [[nodiscard]] MegakernelShare next();
    // Whether the next share begins samples and does not complete them.
    [[nodiscard]] bool cuts_next() const;
    // Its dispatch took so long: later shares grow or shrink.
    void took(double seconds);

    // Samples of single pixels that a submission may have.
    [[nodiscard]] std::uint64_t batch() const { return batch_; }

    // Samples that are done for every pixel, the last share counting as done; and of the next few the part done.
    [[nodiscard]] std::uint64_t done() const { return done_; }
    [[nodiscard]] double done_of_next() const;

private:
    [[nodiscard]] std::uint64_t samples_of_next() const;
    [[nodiscard]] std::uint32_t invocations_of_next(std::uint64_t samples) const;

    std::uint64_t most_samples_;  // a dispatch
    std::uint64_t batch_;         // samples of single pixels a dispatch
    std::uint32_t pixels_ = 0;
    std::uint64_t wanted_ = 0, done_ = 0;
    std::uint64_t samples_ = 0;  // of the current shares
    std::uint32_t first_ = 0;    // invocation of the next share
    std::uint64_t last_ = 0;     // samples of single pixels in the last share
};

}  // namespace tandem
