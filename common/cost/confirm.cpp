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
    if (!figures.seconds_a_sample) figures.seconds_a_sample = before.seconds_a_sample;
    return figures;
}

// How far the logarithm's interval reaches below and above its value.
struct Reach {
    double low = 0.0, high = 0.0;
};
Reach reach_of(const Estimated& figure) {
    return {std::log(figure.value / figure.low), std::log(figure.high / figure.value)};
}

// That of log time, as far as it is how well the number of samples is known. How much renders of one number differ in
// time is left to rounds, which are paired.
Reach reach_of_noise(const ArmFigures& arm, const TimeToError& time) {
    const Reach count = time.samples_interval ? reach_of(*time.samples_interval) : Reach{};
    return {std::max(count.low, arm.log_half_of_variance), std::max(count.high, arm.log_half_of_variance)};
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

// The ratio of two times, whose logarithms reach so far and differ by `log_ratio`. `more` is a half-width of both. The
// interval holds for so many rivals together. `dof`: of what is known least, as few rounds have far tails.
Rival rival_of(
    const ArmFigures& arm, double log_ratio, Reach rival, Reach best, double more, double dof, std::size_t rivals) {
    const double widened =
        student_quantile(1.0 - 0.5 * rejection_level / static_cast<double>(rivals), dof) / student_quantile(0.975, dof);
    // Not hypot of three, which in libstdc++ is NaN where one is infinite.
    const double low = widened * std::hypot(more, std::hypot(rival.low, best.high));
    const double high = widened * std::hypot(more, std::hypot(rival.high, best.low));
    return {arm.arm.name(), {std::exp(log_ratio), std::exp(log_ratio - low), std::exp(log_ratio + high)}};
}

// Seconds a sample are compared round by round, where what the machine does to both cancels.
Rival compare(const Renewed& rival, const Renewed& best, std::size_t rivals) {
    const PairedEffect paired = paired_seconds(*rival.trials, *best.trials);
    return rival_of(rival.figures, std::log(rival.time.seconds->value / best.time.seconds->value),
        reach_of_noise(rival.figures, rival.time), reach_of_noise(best.figures, best.time),
        0.5 * (paired.high - paired.low), paired.dof, rivals);
}

// A rival that was not rendered beside the best: by what was known of it before. What the machine did since to the
// best's samples is taken out.
Rival compare_apart(
    const ArmFigures& rival, const ArmFigures& best_before, const Renewed& best, double error, std::size_t rivals) {
    const auto a_sample = [](const TimeToError& time) { return time.seconds->value / *time.samples; };
    const TimeToError time = rival.time_to(error), before = best_before.time_to(error);
    const double drift = before.seconds ? a_sample(best.time) / a_sample(before) : 1.0;
    return rival_of(rival, std::log(drift * time.seconds->value / best.time.seconds->value), reach_of(*time.seconds),
        reach_of(*best.time.seconds), 0.0,
        static_cast<double>(std::min(rival.replicates, best.figures.replicates)) - 1.0, rivals);
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
            result.rivals.push_back(compare_apart(*rival, *first, *best, error, rivals.size()));
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

// Each arm's last stage in that range.
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

// The stages that measure anew what was chosen before them: the error's own. Where these have no two arms, the last
// growth that has: what it renders was chosen by the growth before.
StageRange anew_for(const CostSamples& samples, std::size_t index) {
    const StageRange own{goal_stage(index), goal_stage(index + 1)};
    if (last_of(samples, own).arms.size() >= 2) return own;
    for (std::uint32_t stage = first_goal_stage; stage-- > first_growth_stage;)
        if (last_of(samples, {stage, stage + 1}).arms.size() >= 2) return {stage, stage + 1};
    return own;
}

// Figures of the stages, with the floors that all samples tell: what is known to be biased is no choice.
std::vector<ArmFigures> figures_until(const std::vector<CostArm>& arms, const CostSamples& samples, std::uint32_t until,
    const std::vector<ArmFigures>& all) {
    std::vector<ArmFigures> figures = analyse_cost(arms, samples, {short_stage, until});
    for (ArmFigures& arm : figures)
        if (const ArmFigures* whole = named(all, arm.arm.name())) {
            arm.has_floor = whole->has_floor;
            arm.squared_bias = whole->squared_bias;
        }
    return figures;
}

}  // namespace

std::vector<Confirmation> confirm(const std::vector<CostArm>& arms, const CostSamples& samples) {
    std::vector<Confirmation> result;
    const std::vector<ArmFigures> all = analyse_cost(arms, samples);
    for (std::size_t index = 0; index < cost_errors.size(); ++index) {
        const StageRange stages = anew_for(samples, index);
        const CostSamples anew = last_of(samples, stages);
        if (anew.arms.empty()) continue;
        std::vector<CostArm> measured;
        for (const CostArm& arm : arms)
            if (std::ranges::find(anew.arms, arm.name(), &ArmTrials::name) != anew.arms.end()) measured.push_back(arm);
        const std::vector<ArmFigures> before = figures_until(arms, samples, stages.from, all);
        const std::vector<ArmFigures> now = analyse_cost(measured, anew);
        if (auto one = confirm_at(cost_errors[index], before, now, anew)) result.push_back(std::move(*one));
    }
    return result;
}

}  // namespace tandem
