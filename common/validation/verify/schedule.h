// When to look, and so where `verify` spends its time. Sample counts are fixed in advance, from speed alone and never
// from results. So the error rates of all looks add up to the declared ones.
#pragma once

#include <cstdint>
#include <vector>

namespace tandem {

struct Schedule {
    std::uint64_t batch_samples = 0;   // a batch is one call of each renderer; a multiple of samples_per_block
    std::vector<std::uint64_t> looks;  // samples a pixel and side at each look, ascending, multiples of batch_samples
    // Up to two further doublings, which have their shares of the error rates. They are rendered only if the renderers
    // turn out so much faster than measured that the budget allows them. That happens when another load on the machine
    // has ended.
    std::vector<std::uint64_t> spare_looks;
    std::uint64_t paired_batches = 0;  // compared with paired seeds before the first look
    // Total paired batches at each further look. Such looks come before an agreement, while pairs resolve less than
    // declared and time is left. They have their shares of the false alarms.
    std::vector<std::uint64_t> paired_looks;
};

// The part of a budget in which looks end. The rest is for judging, for uneven speed, and for explaining a
// disagreement: traces, likeness, oracle. It is two seconds, but at least a tenth and at most a fifth of the budget.
[[nodiscard]] double seconds_of_looks(double budget_seconds);
// The budget whose looks may take so long.
[[nodiscard]] double budget_of_looks(double seconds);

struct ScheduleRequest {
    double seconds_per_sample_reference = 0.0;  // a sample of every pixel
    double seconds_per_sample_candidate = 0.0;
    double seconds_a_call = 0.0;    // of both, beside: that a program takes to start
    double budget_seconds = 120.0;  // what is left of it
    std::uint64_t max_samples = 0;
    std::size_t max_looks = 6;
    bool paired = true;
};

// Looks double up to what the budget or max_samples allow; the least one has two batches. Both sides get equally many
// samples. The differences are then symmetric under the null, whatever the tails, and the tests rest on that. The best
// unequal split would save less than a quarter of the time up to a ratio of speeds of ten.
[[nodiscard]] Schedule make_schedule(const ScheduleRequest& request);

}  // namespace tandem
