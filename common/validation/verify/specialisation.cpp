#include "common/validation/verify/specialisation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include "common/error.h"
#include "common/statistics/distributions.h"
#include "common/statistics/paired_effect.h"
#include "common/statistics/sample_moments.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

// One job and the times of its rounds.
struct Contender {
    explicit Contender(std::optional<EffectSet> simulated) : effects(simulated) {}

    std::optional<EffectSet> effects;  // empty: those that the scene calls for
    std::unique_ptr<RenderJob> job;
    JobFacts facts;     // of that job, asked for once: counting instructions takes seconds
    Estimate first;     // a sample of every pixel
    Estimate estimate;  // of the last round
    std::vector<double> kernel_replicates, replicates;
    std::vector<double> seconds;  // a round
    bool device_clock = true;

    // Nothing after a stop.
    std::optional<RenderResult> render(SampleRange range, const std::stop_token& stop) {
        RenderControl control;
        control.stop = stop;
        RenderResult result = job->render(range, control);
        if (result.estimate.count() != range.count()) return std::nullopt;
        return result;
    }

    // False after a stop.
    bool make(const Scene& scene, RenderSettings settings, Renderer& renderer, const std::stop_token& stop) {
        if (stop.stop_requested()) return false;
        settings.effects = effects;
        const Stopwatch watch;
        job = renderer.prepare(scene, settings);
        const std::optional<RenderResult> once = render({0, 1}, stop);
        if (!once) return false;
        const double made_seconds = watch.seconds();
        const std::optional<RenderResult> again = render({0, 1}, stop);
        if (!again) return false;
        first = again->estimate;
        replicates.push_back(made_seconds);
        facts = job->facts();
        kernel_replicates.push_back(
            facts.variant.empty() ? facts.kernel_seconds + std::max(0.0, once->seconds - again->seconds) : 0.0);
        return true;
    }

    std::optional<double> time(SampleRange range, const std::stop_token& stop) {
        const std::optional<RenderResult> result = render(range, stop);
        if (!result) return std::nullopt;
        estimate = result->estimate;
        device_clock = device_clock && result->device_seconds.has_value();
        return result->device_seconds.value_or(result->seconds);
    }

    [[nodiscard]] SpecialisationSide side(double samples) const {
        const double sum = std::accumulate(replicates.begin(), replicates.end(), 0.0);
        return {facts, *std::ranges::max_element(kernel_replicates), kernel_replicates,
            sum / static_cast<double>(replicates.size()), seconds.empty() ? 0.0 : 1e3 * median(seconds) / samples};
    }
};

bool same_bits(const Estimate& a, const Estimate& b) {
    if (a.count() != b.count() || a.invalid() != b.invalid()) return false;
    const auto same = [](const Moments& x, const Moments& y) {
        return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
    };
    return std::ranges::equal(a.totals(), b.totals(), same);
}

struct Contenders {
    std::unique_ptr<Renderer> renderer;  // outlives the jobs
    Contender specialised{std::nullopt}, general{EffectSet::all()};

    // With a new renderer, as one may keep its kernels. False after a stop.
    bool make(const Scene& scene, const RenderSettings& settings,
        const std::function<std::unique_ptr<Renderer>()>& make_renderer, bool general_first,
        const std::stop_token& stop) {
        specialised.job.reset();
        general.job.reset();
        renderer.reset();
        renderer = make_renderer();
        RenderSettings small;
        small.width = small.height = 1;
        (void)renderer->prepare(Scene{}, small)->render({0, 1});
        return std::ranges::all_of(std::array{false, true}, [&](bool second) {
            return (second != general_first ? general : specialised).make(scene, settings, *renderer, stop);
        });
    }

    // Samples a round. It is long enough for a device to be as busy as in a render. It is short enough for many rounds:
    // general kernels may be a hundred times as slow.
    [[nodiscard]] SampleRange round(const SpecialisationOptions& options, double seconds_left) {
        constexpr double most_general_seconds = 1.0;
        const double least = std::min(0.1, 0.1 * seconds_left / static_cast<double>(options.least_rounds));
        SampleRange range{0, 1};
        const auto below = [](std::optional<double> seconds, double limit) { return seconds && *seconds < limit; };
        while (below(specialised.time(range, options.stop), least) &&
               below(general.time(range, options.stop), most_general_seconds) && range.end < (std::uint64_t{1} << 20))
            range.end *= 2;
        return range;
    }
};

// What the rounds say of time.
void conclude(const Contenders& contenders, const SampleMoments& logarithms, SpecialisationReport& report) {
    report.device_clock = contenders.specialised.device_clock && contenders.general.device_clock;
    const double half = student_quantile(0.975, logarithms.count - 1.0) * std::sqrt(logarithms.variance_of_mean());
    report.speedup = std::exp(logarithms.mean);
    report.interval = {std::exp(logarithms.mean - half), std::exp(logarithms.mean + half)};
    const double saved = 1e-3 * (report.general.milliseconds - report.specialised.milliseconds);
    if (report.interval.low > 1.0 && saved > 0.0) report.samples_to_pay = report.specialised.kernel_seconds / saved;
}

}  // namespace

SpecialisationReport measure_specialisation(const Scene& scene, const RenderSettings& settings,
    const std::function<std::unique_ptr<Renderer>()>& make_renderer, const SpecialisationOptions& options) {
    const Stopwatch watch;
    const auto seconds_left = [&] { return options.seconds - watch.seconds(); };
    SpecialisationReport report;
    report.findings = find_effects(scene, settings);
    Contenders contenders;
    auto& [renderer, specialised, general] = contenders;
    for (std::size_t replicate = 0; replicate < options.replicates; ++replicate) {
        const double before = watch.seconds();
        if (!contenders.make(scene, settings, make_renderer, replicate % 2 != 0, options.stop)) return report;
        report.made = true;
        report.identical = same_bits(specialised.first, general.first);
        report.specialised = specialised.side(1.0);
        report.general = general.side(1.0);
        if (options.keep) options.keep(report);
        // Timing says more than another replicate does.
        if (3.0 * (watch.seconds() - before) > seconds_left()) break;
    }
    const SampleRange range = contenders.round(options, std::max(0.0, seconds_left()));
    std::mt19937_64 order(options.seed);
    SampleMoments logarithms;
    constexpr double timing_share = 0.25;
    const double rounds_end = std::min(options.seconds, watch.seconds() + timing_share * options.seconds);
    while (
        report.rounds < options.most_rounds && (report.rounds < options.least_rounds || watch.seconds() < rounds_end)) {
        const bool general_first = (order() & 1) != 0;
        std::optional<double> own, all;
        if (general_first) all = general.time(range, options.stop);
        own = specialised.time(range, options.stop);
        if (!general_first) all = general.time(range, options.stop);
        if (!own || !all) break;
        report.identical = report.identical && same_bits(specialised.estimate, general.estimate);
        specialised.seconds.push_back(*own);
        general.seconds.push_back(*all);
        logarithms.add(std::log(*all / *own));
        ++report.rounds;
        if (options.progress) options.progress(std::min(1.0, watch.seconds() / options.seconds));
    }
    const double samples = static_cast<double>(range.count());
    report.specialised = specialised.side(samples);
    report.general = general.side(samples);
    if (report.rounds >= fewest_timed_rounds) conclude(contenders, logarithms, report);
    return report;
}

}  // namespace tandem
