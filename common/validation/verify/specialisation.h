// What a renderer gains by leaving out absent effects. The same samples are rendered by kernels specialised for the
// scene and by the general ones. Both are timed in turn, and compared bit by bit.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/render/effects.h"
#include "common/render/renderer.h"
#include "common/statistics/interval.h"

namespace tandem {

struct SpecialisationReport;

struct SpecialisationOptions {
    double seconds = 10.0;  // for making kernels and timing; least_rounds are planned even where they take longer
    std::size_t least_rounds = 5, most_rounds = 200;
    std::size_t replicates = 2;  // >= 1, of the kernels, each by a new renderer; of more than one, what time allows
    std::uint64_t seed = 1;      // of the order within a round
    std::stop_token stop;        // cuts all of it
    std::function<void(const SpecialisationReport&)> keep;  // what there is before the rounds
    std::function<void(double fraction)> progress;
};

// Rounds without which nothing is said of time: one interval needs two.
inline constexpr std::size_t fewest_timed_rounds = 2;

struct SpecialisationSide {
    JobFacts facts;
    // Wall clock of making the kernels. It is what the renderer says, and what a first sample takes longer than a
    // second one, as drivers may put compiling off until then. 0 where they were compiled with the program
    // (JobFacts::variant). The longest of the replicates: drivers that remember kernels make them faster the next time.
    // Those that keep them from one run to the next may do so at the first, which nothing tells: the time is then too
    // short.
    double kernel_seconds = 0.0;
    std::vector<double> kernel_replicates;
    double make_seconds = 0.0;  // wall clock of all preparation and a first sample, mean of the replicates
    double milliseconds = 0.0;  // a sample of every pixel, median of the rounds
};

struct SpecialisationReport {
    std::vector<EffectFinding> findings;
    SpecialisationSide specialised, general;
    bool made = false;          // both kinds of kernels; otherwise findings are all that is known
    bool identical = false;     // the two estimates of the same samples, bit for bit
    std::size_t rounds = 0;     // below fewest_timed_rounds: nothing is known of time
    bool device_clock = false;  // times are the device's own
    double speedup = 1.0;       // general over specialised time, geometric mean of the rounds
    Interval interval;          // of the speed-up, 95 %
    // Samples after which the time saved has paid for making the specialised kernels, the general ones being at hand.
    // It is from kernel_seconds, so perhaps too few. 0 where none are made. Empty: the time saved cannot be told from
    // none.
    std::optional<double> samples_to_pay;
};

// Makes both kinds of kernels in alternate order, after a small job that takes the driver's own start upon itself.
// After a stop it concludes from what is done. Throws what prepare() throws; settings.effects is replaced.
[[nodiscard]] SpecialisationReport measure_specialisation(const Scene& scene, const RenderSettings& settings,
    const std::function<std::unique_ptr<Renderer>()>& make_renderer, const SpecialisationOptions& options);

}  // namespace tandem
