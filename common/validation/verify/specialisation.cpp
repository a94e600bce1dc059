#include "common/validation/verify/specialisation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "common/error.h"
#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

template <class Value>
Value unless_stopped(std::optional<Value> value) {
    if (!value) throw Error("stopped before the kernels were timed; nothing to report");
    return *std::move(value);
}

// One job and the times of its rounds.
struct Contender {
    explicit Contender(std::optional<EffectSet> simulated) : effects(simulated) {}

    std::optional<EffectSet> effects;  // empty: those that the scene calls for
    std::unique_ptr<RenderJob> job;
    Estimate estimate;  // of the first samples
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

    void make(const Scene& scene, RenderSettings settings, Renderer& renderer, const std::stop_token& stop) {
        settings.effects = effects;
        const Stopwatch watch;
        job = renderer.prepare(scene, settings);
        const double first = unless_stopped(render({0, 1}, stop)).seconds;
        replicates.push_back(watch.seconds());
        const double again = unless_stopped(render({0, 1}, stop)).seconds;
        const JobFacts facts = job->facts();
        kernel_replicates.push_back(facts.variant.empty() ? facts.kernel_seconds + std::max(0.0, first - again) : 0.0);
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
        return {job->facts(), *std::ranges::max_element(kernel_replicates), kernel_replicates,
            sum / static_cast<double>(replicates.size()), 1e3 * median(seconds) / samples};
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

    // With a new renderer, as one may keep its kernels.
    void make(const Scene& scene, const RenderSettings& settings,
        const std::function<std::unique_ptr<Renderer>()>& make_renderer, bool general_first,
        const std::stop_token& stop) {
        specialised.job.reset();
        general.job.reset();
        renderer.reset();
        renderer = make_renderer();
        RenderSettings small;
        small.width = small.height = 1;
        (void)renderer->prepare(Scene{}, small)->render({0, 1});
        for (const bool second : {false, true})
            (second != general_first ? general : specialised).make(scene, settings, *renderer, stop);
    }
};

}  // namespace

SpecialisationReport measure_specialisation(const Scene& scene, const RenderSettings& settings,
    const std::function<std::unique_ptr<Renderer>()>& make_renderer, const SpecialisationOptions& options) {
    SpecialisationReport report;
    report.findings = find_effects(scene, settings);
    Contenders contenders;
    for (std::size_t replicate = 0; replicate < options.replicates; ++replicate)
        contenders.make(scene, settings, make_renderer, replicate % 2 != 0, options.stop);
    auto& [renderer, specialised, general] = contenders;

    // A round is long enough for a device to be as busy as it is in a render, and short enough for many rounds: general
    // kernels may be a hundred times as slow.
    constexpr double least_round_seconds = 0.1, most_general_seconds = 1.0;
    SampleRange range{0, 1};
    while (unless_stopped(specialised.time(range, options.stop)) < least_round_seconds &&
           unless_stopped(general.time(range, options.stop)) < most_general_seconds &&
           range.end < (std::uint64_t{1} << 20))
        range.end *= 2;
    std::mt19937_64 order(options.seed);
    SampleMoments logarithms;
    const Stopwatch watch;
    while (report.rounds < options.most_rounds &&
           (report.rounds < options.least_rounds || watch.seconds() < options.seconds)) {
        const bool general_first = (order() & 1) != 0;
        std::optional<double> own, all;
        if (general_first) all = general.time(range, options.stop);
        own = specialised.time(range, options.stop);
        if (!general_first) all = general.time(range, options.stop);
        if (!own || !all) break;
        specialised.seconds.push_back(*own);
        general.seconds.push_back(*all);
        logarithms.add(std::log(*all / *own));
        ++report.rounds;
        if (options.progress) options.progress(std::min(1.0, watch.seconds() / options.seconds));
    }
    if (report.rounds < options.least_rounds) throw Error("stopped before enough rounds were timed; nothing to report");
    const double samples = static_cast<double>(range.count());
    report.identical = same_bits(specialised.estimate, general.estimate);
    report.specialised = specialised.side(samples);
    report.general = general.side(samples);
    report.device_clock = specialised.device_clock && general.device_clock;
    const double half = student_quantile(0.975, logarithms.count - 1.0) * std::sqrt(logarithms.variance_of_mean());
    report.speedup = std::exp(logarithms.mean);
    report.interval = {std::exp(logarithms.mean - half), std::exp(logarithms.mean + half)};
    const double saved = 1e-3 * (report.general.milliseconds - report.specialised.milliseconds);
    if (report.interval.low > 1.0 && saved > 0.0) report.samples_to_pay = report.specialised.kernel_seconds / saved;
    return report;
}

}  // namespace tandem
