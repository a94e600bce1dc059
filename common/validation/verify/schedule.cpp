#include "common/validation/verify/schedule.h"

#include <algorithm>
#include <cmath>

#include "common/render/estimate.h"

namespace tandem {

namespace {

constexpr std::uint64_t least_batches = 2;            // to have a variance between batches
constexpr std::uint64_t most_scheduled_batches = 64;  // at the last look; more would only cost calls
constexpr std::uint64_t most_paired_batches = 4;
// Where calls cost time of their own, batches grow until that is less than so much of the samples' time. At least so
// many batches remain.
constexpr double most_of_calls = 0.25;
constexpr std::uint64_t few_batches = 16;
constexpr std::size_t most_spare_looks = 2;
constexpr std::size_t most_paired_looks = 6;
constexpr double seconds_to_explain = 2.0, least_to_explain = 0.1, most_to_explain = 0.2;  // the latter of the budget

std::uint64_t round_down(double samples, std::uint64_t multiple) {
    // 2^50 samples are out of reach; the cut keeps the conversion defined.
    return static_cast<std::uint64_t>(std::clamp(samples, 0.0, 0x1p50)) / multiple * multiple;
}

}  // namespace

double seconds_of_looks(double budget_seconds) {
    return std::clamp(budget_seconds - seconds_to_explain, (1.0 - most_to_explain) * budget_seconds,
        (1.0 - least_to_explain) * budget_seconds);
}

double budget_of_looks(double seconds) {
    return std::clamp(
        seconds + seconds_to_explain, seconds / (1.0 - least_to_explain), seconds / (1.0 - most_to_explain));
}

Schedule make_schedule(const ScheduleRequest& request) {
    Schedule schedule;
    const double sample = request.seconds_per_sample_reference + request.seconds_per_sample_candidate;
    const double budget = seconds_of_looks(std::max(0.0, request.budget_seconds));

    schedule.batch_samples = samples_per_block;
    const auto of_batch = [&] { return sample + request.seconds_a_call / static_cast<double>(schedule.batch_samples); };
    const auto samples_wanted = [&] {
        return std::min(budget / std::max(of_batch(), 1e-12), static_cast<double>(request.max_samples));
    };
    while (samples_wanted() > static_cast<double>(schedule.batch_samples * most_scheduled_batches))
        schedule.batch_samples *= 2;
    while (of_batch() > (1.0 + most_of_calls) * sample) {
        schedule.batch_samples *= 2;
        if (samples_wanted() >= static_cast<double>(schedule.batch_samples * few_batches)) continue;
        schedule.batch_samples /= 2;
        break;
    }
    const double both = of_batch();
    double affordable = budget / std::max(both, 1e-12);

    const std::uint64_t batch = schedule.batch_samples;
    // The paired phase costs the candidate's time alone; an eighth of the budget at most.
    if (request.paired) {
        const double paired_seconds = static_cast<double>(batch) * request.seconds_per_sample_candidate;
        const double batches = 0.125 * request.budget_seconds / std::max(paired_seconds, 1e-12);
        schedule.paired_batches = std::clamp(round_down(batches, 1), least_batches, most_paired_batches);
        affordable -= static_cast<double>(schedule.paired_batches) * paired_seconds / std::max(both, 1e-12);
    }
    affordable = std::min(affordable, static_cast<double>(request.max_samples));
    const std::uint64_t last = std::max(round_down(affordable, batch), least_batches * batch);
    for (std::uint64_t samples = last; samples >= least_batches * batch && schedule.looks.size() < request.max_looks;
         samples = round_down(static_cast<double>(samples) / 2.0, batch))
        schedule.looks.insert(schedule.looks.begin(), samples);
    for (std::uint64_t samples = 2 * last;
         samples <= request.max_samples && schedule.spare_looks.size() < most_spare_looks; samples *= 2)
        schedule.spare_looks.push_back(samples);
    schedule.paired_batches = std::min(schedule.paired_batches, schedule.looks.front() / batch);
    const double most_pairs = std::min(budget / std::max(both, 1e-12), static_cast<double>(request.max_samples));
    for (std::uint64_t batches = 2 * schedule.paired_batches;
         batches > 0 && static_cast<double>(batches * batch) <= most_pairs &&
         schedule.paired_looks.size() < most_paired_looks;
         batches *= 2)
        schedule.paired_looks.push_back(batches);
    return schedule;
}

}  // namespace tandem
