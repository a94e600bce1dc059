#include "vulkan/renderer/kernels/megakernel_plan.h"

#include <algorithm>

#include "common/render/estimate.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

// Lavapipe bounds the turns of all loops of an invocation (shaders/kernels/pixel_samples.glsl): this leaves 16 thousand
// a path.
constexpr std::uint64_t most_samples_on_cpu = 4;
// Samples of single pixels in the first dispatch of a GPU that does not tell its size. They are tenths of a second on a
// slow GPU and enough to fill a fast one.
constexpr std::uint64_t first_batch_on_cpu = std::uint64_t{1} << 12, first_batch = std::uint64_t{1} << 22;
constexpr std::uint64_t most_batch = std::uint64_t{1} << 40;
// For so long, in seconds, a sample occupies one of the invocations that a GPU holds at once, where that was measured
// to be longest. It was the classic box in double precision on an H200: 1.41 ms for 360,000 pixels and 270,336
// invocations. Smaller GPUs of a kind hold fewer at once, not each for longer.
constexpr double longest_residence = 1.1e-3;

std::uint64_t usual_first_batch(const DeviceDescription& device) {
    if (device.type == DeviceType::cpu) return first_batch_on_cpu;
    if (device.abilities.resident_invocations == 0) return first_batch;
    return static_cast<std::uint64_t>(
        device.abilities.resident_invocations * (shortest_submission / longest_residence));
}

// Longer paths may take as much longer.
std::uint64_t first_batch_on(const DeviceDescription& device, std::uint32_t segments) {
    const std::uint64_t usual = usual_first_batch(device);
    return std::max<std::uint64_t>(workgroup_size, usual * usual_segments / std::max(usual_segments, segments));
}

}  // namespace

MegakernelPlan::MegakernelPlan(const DeviceDescription& device, std::uint32_t segments)
    : most_samples_(device.type == DeviceType::cpu ? most_samples_on_cpu : samples_per_block),
      batch_(first_batch_on(device, segments)) {}

void MegakernelPlan::begin(std::uint32_t pixels, std::uint64_t samples) {
    pixels_ = pixels;
    wanted_ = samples;
    done_ = 0;
    first_ = 0;
}

std::uint64_t MegakernelPlan::samples_of_next() const {
    if (first_ > 0) return samples_;
    return std::clamp<std::uint64_t>(batch_ / pixels_, 1, std::min(most_samples_, wanted_ - done_));
}

std::uint32_t MegakernelPlan::invocations_of_next(std::uint64_t samples) const {
    const std::uint64_t most = std::max<std::uint64_t>(batch_ / samples, workgroup_size);
    const std::uint32_t left = pixels_ - first_;
    const auto some = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, most));
    // A remainder that is small beside the share goes with it.
    return left - some < some / 2 ? left : some;
}

bool MegakernelPlan::cuts_next() const { return first_ == 0 && invocations_of_next(samples_of_next()) < pixels_; }

MegakernelShare MegakernelPlan::next() {
    samples_ = samples_of_next();
    MegakernelShare share{done_, samples_, first_, invocations_of_next(samples_)};
    last_ = share.invocations * samples_;
    first_ += share.invocations;
    share.completes = first_ == pixels_;
    if (share.completes) {
        first_ = 0;
        done_ += samples_;
    }
    return share;
}

void MegakernelPlan::took(double seconds) {
    constexpr double wanted = 0.2, most_growth = 8.0;  // seconds, the middle of shortest and longest submission
    if (seconds >= shortest_submission && seconds <= longest_submission) return;
    const double factor = std::clamp(wanted / std::max(seconds, 1e-6), 1.0 / most_growth, most_growth);
    // A share cut short by the end of a block tells nothing of one of full size, unless it was too long already.
    const double from = static_cast<double>(factor < 1.0 ? last_ : std::max(batch_, last_));
    batch_ = static_cast<std::uint64_t>(
        std::clamp(from * factor, static_cast<double>(workgroup_size), static_cast<double>(most_batch)));
}

double MegakernelPlan::done_of_next() const { return static_cast<double>(samples_) * first_ / pixels_; }

}  // namespace tandem
