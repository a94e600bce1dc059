#include "common/validation/specialisation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "common/error.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

// One job and the times of its rounds.
struct Contender {
    std::unique_ptr<RenderJob> job;
    Estimate estimate;  // of the first samples
    double make_seconds = 0.0;
    std::vector<double> seconds;  // a round
    bool device_clock = true;

    double render(SampleRange range, const std::stop_token& stop) {
        RenderControl control;
        control.stop = stop;
        const RenderResult result = job->render(range, control);
        if (result.estimate.count() != range.count())
            throw Error("stopped before the kernels were timed; nothing to report");
        estimate = result.estimate;
        device_clock = device_clock && result.device_seconds.has_value();
        return result.device_seconds.value_or(result.seconds);
    }
};

bool same_bits(const Estimate& a, const Estimate& b) {
    if (a.count() != b.count() || a.invalid() != b.invalid()) return false;
    const auto same = [](const Moments& x, const Moments& y) {
        return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
    };
    return std::ranges::equal(a.totals(), b.totals(), same);
}

Contender make(const Scene& scene, RenderSettings settings, std::optional<EffectSet> effects, Renderer& renderer,
    const std::stop_token& stop) {
    settings.effects = effects;
    Contender contender;
    const Clock::time_point start = Clock::now();
    contender.job = renderer.prepare(scene, settings);
    // Drivers may put compiling off until the first use.
    (void)contender.render({0, samples_per_block}, stop);
    contender.make_seconds = seconds_since(start);
    return contender;
}

SpecialisationSide side_of(const Contender& contender, double samples) {
    const double typical = median(contender.seconds);
    return {contender.job->facts(), std::max(0.0, contender.make_seconds - typical / samples * samples_per_block),
        1e3 * typical / samples};
}

}  // namespace

SpecialisationReport measure_specialisation(
    const Scene& scene, const RenderSettings& settings, Renderer& renderer, const SpecialisationOptions& options) {
    SpecialisationReport report;
    report.findings = find_effects(scene, settings);
    std::array<Contender, 2> contenders{make(scene, settings, std::nullopt, renderer, options.stop),
        make(scene, settings, EffectSet::all(), renderer, options.stop)};
    auto& [specialised, general] = contenders;
    report.identical = same_bits(specialised.estimate, general.estimate);

    // A round is long enough to be timed, and short enough for many rounds.
    constexpr double least_round_seconds = 0.02;
    SampleRange range{0, samples_per_block};
    while (specialised.render(range, options.stop) < least_round_seconds && range.end < (std::uint64_t{1} << 20))
        range.end *= 2;
    std::mt19937_64 order(options.seed);
    SampleMoments logarithms;
    const Clock::time_point start = Clock::now();
    while (report.rounds < options.most_rounds &&
           (report.rounds < options.least_rounds || seconds_since(start) < options.seconds)) {
        const bool swap = (order() & 1) != 0;
        for (const bool second : {false, true}) {
            Contender& contender = contenders[second != swap ? 1 : 0];
            contender.seconds.push_back(contender.render(range, options.stop));
        }
        logarithms.add(std::log(general.seconds.back() / specialised.seconds.back()));
        ++report.rounds;
        if (options.progress) options.progress(std::min(1.0, seconds_since(start) / options.seconds));
    }
    const double samples = static_cast<double>(range.count());
    report.identical = report.identical && same_bits(specialised.estimate, general.estimate);
    report.specialised = side_of(specialised, samples);
    report.general = side_of(general, samples);
    report.device_clock = specialised.device_clock && general.device_clock;
    const double half = student_quantile(0.975, logarithms.count - 1.0) * std::sqrt(logarithms.variance_of_mean());
    report.speedup = std::exp(logarithms.mean);
    report.interval = {std::exp(logarithms.mean - half), std::exp(logarithms.mean + half)};
    const double saved = 1e-3 * (report.general.milliseconds - report.specialised.milliseconds);
    if (report.interval.low > 1.0 && saved > 0.0) report.samples_to_pay = report.specialised.make_seconds / saved;
    return report;
}

}  // namespace tandem
