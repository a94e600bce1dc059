#include "vulkan/renderer/kernels/stage_plan.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "vulkan/core/device_selection.h"
#include "vulkan/renderer/kernels/megakernel_plan.h"

namespace tandem {

namespace {

// Places of the first run, with one segment. It takes less than half a second where a ray takes lavapipe 100 us, ten
// times as long as any measured.
constexpr std::uint64_t first_places_on_cpu = std::uint64_t{1} << 12, first_places = std::uint64_t{1} << 20;
constexpr double wanted_seconds = 0.5 * (shortest_submission + longest_submission);
constexpr std::uint64_t most_growth = 4;        // from a submission to the next
constexpr std::uint64_t first_segments = 1024;  // in a submission: milliseconds of empty dispatches
// With more segments the device is asked whether all paths have ended: empty dispatches would take longer.
constexpr std::uint32_t many_segments = 256;

}  // namespace

StagePlan::StagePlan(const DeviceDescription& device, std::uint32_t segments, std::uint32_t fixed)
    : segments_(segments),
      fixed_(fixed),
      first_budget_(device.type == DeviceType::cpu ? first_places_on_cpu : first_places),
      most_places_(static_cast<std::uint32_t>(first_budget_)),
      most_segments_(first_segments) {}

void StagePlan::begin(std::uint32_t places, std::uint64_t samples) {
    places_ = places;
    wanted_ = samples;
    done_ = 0;
    first_place_ = segment_ = 0;
    sample_seconds_ = 0.0;
    left_out_ = false;
}

// The run in hand has all its segments. Whether that completes the sample.
bool StagePlan::end_run() {
    segment_ = 0;
    first_place_ += run_places_;
    if (first_place_ < places_) return false;
    first_place_ = 0;
    ++done_;
    return true;
}

// The next `segments` of the run in hand; a new run has so many places.
StageShare StagePlan::share(std::uint32_t places, std::uint64_t segments) {
    if (segment_ == 0) run_places_ = places;
    StageShare share{done_, first_place_, run_places_, segment_, 0};
    share.end_segment = segment_ = static_cast<std::uint32_t>(std::min<std::uint64_t>(segments_, segment_ + segments));
    if (segment_ == segments_) share.completes = end_run();
    return share;
}

std::vector<StageShare> StagePlan::whole_segments(std::uint64_t count) {
    std::vector<StageShare> shares;
    while (count > 0 && done_ < wanted_) {
        shares.push_back(share(places_, count));
        count -= shares.back().end_segment - shares.back().first_segment;
    }
    return shares;
}

std::vector<StageShare> StagePlan::rest() { return whole_segments(std::numeric_limits<std::uint64_t>::max()); }

// Seconds of a sample of all places, if it is known. It is never fewer than it took with more places, as dispatches
// take some however few they have.
std::optional<double> StagePlan::foretold_sample() const {
    if (!last_sample_) return std::nullopt;
    return *last_sample_ * std::max(1.0, static_cast<double>(places_) / last_sample_places_);
}

std::vector<StageShare> StagePlan::next() {
    if (fixed_ > 0) return last_ = whole_segments(fixed_);
    const bool begins_sample = first_place_ == 0 && segment_ == 0;
    const std::optional<double> sample = begins_sample ? foretold_sample() : std::nullopt;
    if (sample && *sample <= longest_submission) {
        const auto count = static_cast<std::uint64_t>(std::max(1.0, wanted_seconds / std::max(*sample, 1e-6)));
        return last_ = whole_segments(std::min(count, wanted_ - done_) * segments_);
    }
    std::uint32_t places = run_places_;
    std::uint64_t budget = later_budget_;
    if (segment_ == 0) {
        budget = first_budget_;
        const std::uint32_t left = places_ - first_place_;
        const std::uint64_t most = std::min<std::uint64_t>(budget, most_places_);
        places = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(most, std::min(workgroup_size, left), left));
        if (left - places < places / 2) places = left;  // a small remainder goes with it
    }
    std::uint64_t segments = std::clamp<std::uint64_t>(budget / places, 1, most_segments_);
    if (segment_ < ended_by_) segments = std::min<std::uint64_t>(segments, ended_by_ - segment_);
    return last_ = {share(places, segments)};
}

void StagePlan::adapt(const StageShare& last, double seconds) {
    const bool begins_run = last.first_segment == 0;
    std::uint64_t& budget = begins_run ? first_budget_ : later_budget_;
    const std::uint64_t segments = last.end_segment - last.first_segment;
    if (seconds > longest_submission) {
        most_segments_ = std::max(
            first_segments, static_cast<std::uint64_t>(static_cast<double>(segments) * wanted_seconds / seconds));
        budget = static_cast<std::uint64_t>(static_cast<double>(last.size()) * wanted_seconds / seconds);
    } else if (seconds < shortest_submission) {
        // One that was cut short tells nothing against a larger one.
        const double growth = std::min<double>(most_growth, wanted_seconds / std::max(seconds, 1e-6));
        budget = std::max(budget, static_cast<std::uint64_t>(static_cast<double>(last.size()) * growth));
        most_segments_ = std::max(most_segments_, most_growth * segments);
        const std::uint64_t places = most_growth * std::uint64_t{last.places};
        if (begins_run)
            most_places_ = static_cast<std::uint32_t>(
                std::clamp<std::uint64_t>(places, most_places_, std::numeric_limits<std::uint32_t>::max()));
    }
    budget = std::max<std::uint64_t>(budget, 1);
    if (begins_run) later_budget_ = first_budget_;
}

void StagePlan::took(double seconds) {
    if (fixed_ > 0 || last_.empty()) return;
    const StageShare& last = last_.back();
    const auto samples = static_cast<double>(last_.size());
    const bool whole = last.completes && last.first_place == 0 && last.first_segment == 0;
    if (whole) sample_seconds_ = 0.0;
    sample_seconds_ += seconds / samples;
    if (!whole || samples == 1.0) adapt(last, seconds);
    if (!last.completes) return;
    last_sample_ = left_out_ ? std::nullopt : std::optional(sample_seconds_);
    last_sample_places_ = places_;
    sample_seconds_ = 0.0;
    left_out_ = false;
}

std::uint32_t StagePlan::doubtful_segment() const { return fixed_ == 0 && segments_ > many_segments ? segment_ : 0; }

bool StagePlan::leave_out_rest_of_run() {
    ended_by_ = std::max(segment_, 1u);
    last_sample_.reset();
    left_out_ = true;
    const bool completes = end_run();
    if (completes) left_out_ = false;
    sample_seconds_ = 0.0;
    return completes;
}

double StagePlan::done_of_next() const {
    const double all = static_cast<double>(places_) * segments_;
    return (static_cast<double>(first_place_) * segments_ + static_cast<double>(run_places_) * segment_) / all;
}

}  // namespace tandem
