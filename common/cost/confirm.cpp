#include "common/cost/confirm.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/cost/schedule.h"
#include "common/statistics/distributions.h"

namespace tandem {

namespace {

constexpr double rejection_level = 0.05;

const ArmFigures* named(const std::vector<ArmFigures>& figures, const std::string& name) {
    const auto found = std::ranges::find_if(figures, [&](const ArmFigures& one) { return one.arm.name() == name; });
    return found == figures.end() ? nullptr : &*found;
}

bool is_baseline(const std::vector<ArmFigures>& figures, const ArmFigures& arm) { return &arm == figures.data(); }

// Other arms that are to be had for the error, the nearest first; the baseline is among them, whatever its time.
std::vector<const ArmFigures*> rivals_of(const std::vector<ArmFigures>& figures, const ArmFigures& best, double error) {
    std::vector<const ArmFigures*> rivals;
    for (const ArmFigures& arm : figures)
        if (&arm != &best && arm.variance > 0.0 && arm.time_to(error).seconds &&
            (is_baseline(figures, arm) || arm.is_safe_at(error)))
            rivals.push_back(&arm);
    const auto time = [&](const ArmFigures* arm) { return arm->time_to(error).seconds->value; };
    std::ranges::stable_sort(rivals, {}, time);
    const auto kept = static_cast<std::ptrdiff_t>(std::min(rivals.size(), most_rivals));
    const auto base = std::find(rivals.begin() + kept, rivals.end(), figures.data());
    const bool far_baseline = base != rivals.end();
    rivals.resize(static_cast<std::size_t>(kept));
    if (far_baseline) rivals.push_back(figures.data());
    return rivals;
}

// The arm's figures with noise and times as they were measured anew. Its floor and slope are what all replicates say.
ArmFigures renewed(const ArmFigures& before, const ArmFigures& anew) {
    ArmFigures figures = anew;
    figures.has_floor = before.has_floor;
    figures.squared_bias = before.squared_bias;
    figures.slope = before.slope;
    return figures;
}

// Half-width of the interval of log time, as far as it is how well the number of samples is known. How much renders of
// one number differ in time is left to rounds, which are paired.
double log_half_of_noise(const ArmFigures& arm, const TimeToError& time) {
    const double count = time.samples_interval ? log_half_of(*time.samples_interval) : 0.0;
    return std::max(count, arm.log_half_of_variance);
}

struct Renewed {
    ArmFigures figures;
    TimeToError time;
    const ArmTrials* trials;
};

std::optional<Renewed> renew(
    const ArmFigures& before, const std::vector<ArmFigures>& all, const CostSamples& anew, double error) {
    const ArmFigures* now = named(all, before.arm.name());
    const auto trials = std::ranges::find(anew.arms, before.arm.name(), &ArmTrials::name);
    if (now == nullptr || trials == anew.arms.end() || !(now->variance > 0.0)) return std::nullopt;
    Renewed result{renewed(before, *now), {}, &*trials};
    result.time = result.figures.time_to(error);
    if (!result.time.seconds) return std::nullopt;
    return result;
}

bool ran_together(const ArmTrials& a, const ArmTrials& b) {
    return std::ranges::any_of(a.replicates, [&](const Replicate& replicate) {
        return std::ranges::find(b.replicates, replicate.round, &Replicate::round) != b.replicates.end();
    });
}

// Its interval holds for so many rivals together.
Rival rival_of(const ArmFigures& arm, double log_ratio, double log_half, std::size_t rivals) {
    const double widened =
        normal_quantile(1.0 - 0.5 * rejection_level / static_cast<double>(rivals)) / normal_quantile(0.975);
    const double half = widened * log_half;
    return {arm.arm.name(), {std::exp(log_ratio), std::exp(log_ratio - half), std::exp(log_ratio + half)}};
}

// Seconds a sample are compared round by round, where what the machine does to both cancels.
Rival compare(const Renewed& rival, const Renewed& best, std::size_t rivals) {
    const PairedEffect paired = paired_seconds(*rival.trials, *best.trials);
    // Not hypot of three, which in libstdc++ is NaN where one is infinite.
    const double noise =
        std::hypot(log_half_of_noise(rival.figures, rival.time), log_half_of_noise(best.figures, best.time));
    return rival_of(rival.figures, std::log(rival.time.seconds->value / best.time.seconds->value),
        std::hypot(0.5 * (paired.high - paired.low), noise), rivals);
}

// A rival that was not rendered beside the best: by what was known of it before.
Rival compare_apart(const ArmFigures& rival, const Renewed& best, double error, std::size_t rivals) {
    const Estimated before = *rival.time_to(error).seconds, &now = *best.time.seconds;
    return rival_of(rival, std::log(before.value / now.value),
        std::hypot(0.5 * std::log(before.high / before.low), 0.5 * std::log(now.high / now.low)), rivals);
}

// The setting that reaches the error soonest, of those that took part.
const ArmFigures* soonest_of(
    const std::vector<ArmFigures>& took_part, const std::vector<ArmFigures>& figures, double error) {
    const ArmFigures* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const ArmFigures& one : took_part) {
        const ArmFigures* arm = named(figures, one.arm.name());
        if (arm == nullptr || !arm->is_safe_at(error)) continue;
        const TimeToError time = arm->time_to(error);
        if (!time.seconds || time.seconds->value >= least) continue;
        least = time.seconds->value;
        best = arm;
    }
    return best;
}

}  // namespace

std::optional<Confirmation> confirm_at(
    double error, const std::vector<ArmFigures>& figures, const std::vector<ArmFigures>& now, const CostSamples& anew) {
    const ArmFigures* first = soonest(figures, error);
    if (first != nullptr && named(now, first->arm.name()) == nullptr) first = soonest_of(now, figures, error);
    if (first == nullptr) return std::nullopt;
    const std::optional<Renewed> best = renew(*first, now, anew, error);
    if (!best) return std::nullopt;
    Confirmation result;
    result.relative_error = error;
    result.first = result.recommended = first->arm.name();
    result.seconds = *best->time.seconds;
    result.forecast = best->time.extrapolated;
    result.rounds = best->trials->replicates.size();
    const std::vector<const ArmFigures*> rivals = rivals_of(figures, *first, error);
    bool any = false;
    for (const ArmFigures* rival : rivals) {
        const std::optional<Renewed> again = renew(*rival, now, anew, error);
        if (!again || !ran_together(*again->trials, *best->trials)) {
            result.rivals.push_back(compare_apart(*rival, *best, error, rivals.size()));
            continue;
        }
        result.rivals.push_back(compare(*again, *best, rivals.size()));
        any = true;
        const Rival& last = result.rivals.back();
        if (last.time_ratio.high < 1.0 && again->time.seconds->value < result.seconds.value) {
            result.recommended = last.name;
            result.seconds = *again->time.seconds;
            result.forecast = again->time.extrapolated;
        }
    }
    if (!any) return std::nullopt;
    std::ranges::stable_sort(result.rivals, {}, [](const Rival& rival) { return rival.time_ratio.value; });
    const bool all_slower = std::ranges::all_of(result.rivals, [](const Rival& r) { return r.time_ratio.low > 1.0; });
    result.outcome = result.recommended != result.first ? Confirmed::refuted
                     : all_slower                       ? Confirmed::shown
                                                        : Confirmed::open;
    return result;
}

namespace {

// Of each arm its last stage of those.
CostSamples last_of(const CostSamples& samples, StageRange stages) {
    CostSamples last;
    last.reference = samples.reference;
    last.width = samples.width;
    for (const ArmTrials& arm : samples.arms) {
        if (arm.stage < stages.from || arm.stage >= stages.until || arm.replicates.size() < fewest_replicates) continue;
        std::erase_if(last.arms, [&](const ArmTrials& one) { return one.name == arm.name && one.stage < arm.stage; });
        if (std::ranges::find(last.arms, arm.name, &ArmTrials::name) == last.arms.end()) last.arms.push_back(arm);
    }
    return last;
}

}  // namespace

std::vector<Confirmation> confirm(const std::vector<CostArm>& arms, const CostSamples& samples) {
    std::vector<Confirmation> result;
    for (std::size_t index = 0; index < cost_errors.size(); ++index) {
        StageRange stages{goal_stage(index), goal_stage(index + 1)};
        CostSamples anew = last_of(samples, stages);
        if (anew.arms.empty()) {
            stages = {first_growth_stage, first_goal_stage};
            anew = last_of(samples, stages);
        }
        if (anew.arms.empty()) continue;
        std::vector<CostArm> measured;
        for (const CostArm& arm : arms)
            if (std::ranges::find(anew.arms, arm.name(), &ArmTrials::name) != anew.arms.end()) measured.push_back(arm);
        const std::vector<ArmFigures> before = analyse_cost(arms, samples, {short_stage, stages.from});
        const std::vector<ArmFigures> now = analyse_cost(measured, anew);
        if (auto one = confirm_at(cost_errors[index], before, now, anew)) result.push_back(std::move(*one));
    }
    return result;
}

}  // namespace tandem
