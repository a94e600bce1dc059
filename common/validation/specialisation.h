// What leaving out the absent effects is worth on one renderer (DESIGN.md section 7): the same samples by kernels made
// for the scene and by the general ones, held against each other bit by bit and timed in turn.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/effects.h"
#include "common/renderer.h"
#include "common/statistics/distributions.h"

namespace tandem {

struct SpecialisationOptions {
    double seconds = 10.0;  // of timing, after the kernels are made
    std::size_t least_rounds = 5, most_rounds = 200;
    std::uint64_t seed = 1;  // of the order within a round
    std::stop_token stop;
    std::function<void(double fraction)> progress;
};

struct SpecialisationSide {
    JobFacts facts;
    double make_seconds = 0.0;  // wall clock of making the job, kernels and first use included
    double milliseconds = 0.0;  // a sample of every pixel, median of the rounds
};

struct SpecialisationReport {
    std::vector<EffectFinding> findings;
    SpecialisationSide specialised, general;
    bool identical = false;  // the two estimates of the same samples, bit for bit
    std::size_t rounds = 0;
    bool device_clock = false;  // times are the device's own
    double speedup = 1.0;       // general over specialised time, geometric mean of the rounds
    Interval interval;          // of the speed-up, 95 %
    // Samples after which the time saved has paid for making the specialised job, the general kernels being at hand;
    // empty: the time saved cannot be told from none.
    std::optional<double> samples_to_pay;
};

// Throws what prepare() throws; settings.effects is replaced.
[[nodiscard]] SpecialisationReport measure_specialisation(
    const Scene& scene, const RenderSettings& settings, Renderer& renderer, const SpecialisationOptions& options);

}  // namespace tandem
