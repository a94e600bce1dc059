#include "common/cost/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/render/adaptive_sampling.h"

namespace tandem {

namespace {

// Shares of the time that is left which a goal or the floors may take, so that what comes later has a chance. Where it
// does not suffice for the soonest arm, the goal may take most_share: smaller errors have no chance then. It may take
// as much for that arm's rival.
constexpr std::array<double, cost_errors.size()> goal_share{0.25, 0.9, 1.0};
constexpr double most_share = 0.9;
constexpr double floor_share = 0.35;
// Where no goal fits, the arms that may be soonest render so many times their samples, and fewer arms each time. That
// takes this share of the time that is left, at most. The second factor is for where the first leaves one arm.
constexpr std::array growth_factors{4.0, 2.0};
constexpr double growth_share = 0.3;
constexpr std::size_t growth_arms = 8;
// Where nothing else is left to do, a goal is begun that so many measurements as long as this one would finish.
constexpr double pieces = 8.0;
constexpr double surely = 1.15;  // samples beyond the forecast, as it may be too low by chance
// A setting whose least time is so many times the soonest one's is far behind. It is left out where it takes more than
// this share of the time that is left. One other is kept, as the soonest may be so by luck; but not in pieces.
constexpr double far_behind = 1.5, far_share = 0.05;
constexpr double baseline_share = 0.5;  // of the time left for all, which how far behind the baseline is may take
// What adaptive sampling may gain beyond a forecast from samples that are nearly uniform. On the scenes of
// tests/records/accuracy/TARGET_ERROR.md 3.9 was the most.
constexpr double most_adaptive_gain = 4.0;
constexpr std::uint64_t most_samples_at_once = std::uint64_t{1} << 30;
constexpr unsigned halvings = 12;  // of the sample counts that a replicate is looked at

const ArmTrials* trials_at(const CostSamples& samples, const std::string& name, std::uint32_t stage) {
    for (const ArmTrials& arm : samples.arms)
        if (arm.name == name && arm.stage == stage) return &arm;
    return nullptr;
}

double seconds_of(const ArmFigures& arm, const std::vector<std::uint64_t>& levels) {
    return arm.seconds_at(static_cast<double>(levels.back())).value;
}

// Where the reference is not known far better than the error, the trials' own noise must not be greater, either: that
// of the reference may hide it. At half of the error its square is a quarter, and the sum of both is 1.12 times the
// error, squared.
bool is_at(const ArmTrials& trials, double error, const CostReference& reference) {
    const double mean = reference.image_mean(), most = error * error * mean * mean;
    double sum = 0.0;
    for (const Replicate& replicate : trials.replicates) sum += replicate.squared_errors.back();
    if (sum > most * static_cast<double>(trials.replicates.size())) return false;
    constexpr double far_better = 0.5;
    return reference.relative_uncertainty() <= far_better * error || between_replicates(trials) <= most;
}

bool has_replicates(const ArmTrials& trials, std::size_t count) { return trials.replicates.size() >= count; }

// What a stage lacks of `replicates`, in seconds, and the arms that it is made of.
struct Lack {
    CostStage stage;
    double seconds = 0.0;
};
Lack lack_of(
    const std::vector<ArmFigures>& figures, const CostSamples& samples, std::uint32_t stage, std::size_t replicates) {
    const auto is_arm = [&](const std::string& name) {
        return std::ranges::any_of(figures, [&](const ArmFigures& arm) { return arm.arm.name() == name; });
    };
    Lack lack;
    lack.stage.stage = stage;
    lack.stage.replicates = replicates;
    for (const ArmTrials& arm : samples.arms) {
        if (arm.stage != stage || arm.samples.empty() || has_replicates(arm, replicates)) continue;
        if (!is_arm(arm.name)) continue;  // a mix of the measurement that is continued
        lack.stage.arms.push_back({arm.name, arm.samples});
        lack.seconds += seconds_a_replicate(arm, samples) * static_cast<double>(replicates - arm.replicates.size());
    }
    return lack;
}

bool is_entered(const CostSamples& samples, std::uint32_t stage) {
    return std::ranges::any_of(samples.arms, [&](const ArmTrials& arm) { return arm.stage == stage; });
}

// Adaptive sampling and Sobol points pay off at many samples, which a short stage does not show.
bool pays_late(const ArmFigures& arm) {
    return arm.arm.settings.render.sampling == Sampling::adaptive ||
           arm.arm.settings.render.generator == Generator::sobol;
}

struct Candidate {
    const ArmFigures* arm;
    std::vector<std::uint64_t> levels;
    double seconds, soonest;  // to the error; the low end of its interval
};

// A bias is one of the mean, so that another arm of the same mean may show it first.
bool may_be_had(const std::vector<ArmFigures>& figures, const ArmFigures& arm, double error) {
    const auto shows_bias = [&](const ArmFigures& other) {
        return other.has_forecasts() && !other.arm.is_unbiased() && other.has_floor &&
               other.squared_bias.low >= error * error && have_one_mean(other.arm.settings, arm.arm.settings);
    };
    return arm.has_forecasts() && (arm.arm.keeps_estimate || !arm.has_floor || arm.is_safe_at(error)) &&
           std::ranges::none_of(figures, shows_bias);
}

std::vector<std::uint64_t> levels_of(const ArmFigures& arm, double wanted) {
    if (arm.arm.settings.render.sampling == Sampling::adaptive)
        wanted = std::max(wanted, static_cast<double>(2 * least_alike));  // below it adapts to nothing
    return levels_up_to(wanted);
}

std::optional<Candidate> candidate(const std::vector<ArmFigures>& figures, const ArmFigures& arm, double error) {
    if (!may_be_had(figures, arm, error)) return std::nullopt;
    const TimeToError time = arm.time_to(error);
    if (!time.seconds || !time.samples) return std::nullopt;
    double wanted = surely * *time.samples;
    if (time.extrapolated && arm.arm.settings.render.generator == Generator::sobol && arm.slope) {
        // The forecast is that of independent samples. An attempt that falls short is followed by another.
        const auto most = static_cast<double>(arm.points.back().samples);
        const double slowest = std::clamp(-arm.slope->high, 0.5, 1.0);
        wanted = surely * most * std::pow(*time.samples / most, 0.5 / slowest);
    } else if (time.extrapolated && time.samples_interval) {
        wanted *= std::min(std::sqrt(time.samples_interval->high / time.samples_interval->value), 2.0);
    }
    const bool may_gain = arm.arm.settings.render.sampling == Sampling::adaptive && time.extrapolated &&
                          arm.points.back().samples < 4 * least_alike;
    return Candidate{
        &arm, levels_of(arm, wanted), time.seconds->value, time.seconds->low / (may_gain ? most_adaptive_gain : 1.0)};
}

double takes_of(const Candidate& one) {
    return static_cast<double>(fewest_replicates) * seconds_of(*one.arm, one.levels);
}

// Those whose errors foretell nothing come last, and are told apart by their noise.
std::pair<double, double> by_time(const Candidate& one) { return {one.seconds, one.arm->cost_ratio.value}; }

// Arms without forecasts take part with the baseline's counts, so that they can be held against it there.
void accompany_baseline(const std::vector<ArmFigures>& figures, double left, std::vector<CostStage::Arm>& chosen) {
    const auto baseline = std::ranges::find(chosen, figures.front().arm.name(), &CostStage::Arm::name);
    if (baseline == chosen.end()) return;
    std::vector<std::uint64_t> levels = baseline->samples;
    std::erase_if(levels, [](std::uint64_t count) { return count < fewest_to_denoise; });
    for (const ArmFigures& arm : figures) {
        if (arm.has_forecasts() || levels.empty()) continue;
        const double takes = static_cast<double>(fewest_replicates) * seconds_of(arm, levels);
        if (takes > left) continue;
        left -= takes;
        chosen.push_back({arm.arm.name(), levels});
    }
}

// The `count` soonest candidates whose replicates take up to `most` seconds each, and `left` in all. The soonest two,
// the baseline and what pays late come before the rest.
std::vector<CostStage::Arm> soonest_of(
    const std::vector<ArmFigures>& figures, std::vector<Candidate> all, std::size_t count, double left, double most) {
    std::ranges::stable_sort(all, {}, by_time);
    constexpr std::size_t first = 2, late = 2;
    std::vector<const Candidate*> order;
    const auto add = [&](const Candidate& one) {
        if (std::ranges::find(order, &one) == order.end()) order.push_back(&one);
    };
    for (std::size_t i = 0; i < std::min(first, all.size()); ++i) add(all[i]);
    std::size_t paying = 0;
    for (const Candidate& one : all)
        if (one.arm == figures.data() || (pays_late(*one.arm) && paying++ < late)) add(one);
    for (std::size_t i = 0; i < std::min(count, all.size()); ++i) add(all[i]);
    std::vector<CostStage::Arm> chosen;
    for (const Candidate* one : order) {
        const double takes = takes_of(*one);
        if (takes > left || takes > most * static_cast<double>(fewest_replicates)) continue;
        left -= takes;
        chosen.push_back({one->arm->arm.name(), one->levels});
    }
    accompany_baseline(figures, left, chosen);
    return chosen;
}

// The arms that could be soonest at an error, as far as the time allows. One `alone` only where so asked.
std::vector<CostStage::Arm> contenders(
    const std::vector<ArmFigures>& figures, std::size_t index, double seconds, bool alone, bool in_pieces) {
    std::vector<Candidate> all;
    for (const ArmFigures& arm : figures)
        if (auto one = candidate(figures, arm, cost_errors[index])) all.push_back(std::move(*one));
    if (all.empty()) return {};
    std::ranges::stable_sort(all, {}, by_time);
    const auto is_behind = [most = far_behind * all[0].seconds](const Candidate& one) { return one.soonest > most; };
    const bool has_rival = all.size() > 1 && !is_behind(all[1]);
    const auto others = all.begin() + (in_pieces ? 1 : std::min<std::ptrdiff_t>(2, std::ssize(all)));
    all.erase(std::remove_if(others, all.end(),
                  [&](const Candidate& one) { return is_behind(one) && takes_of(one) > far_share * seconds; }),
        all.end());
    if (in_pieces) {
        // Pieces are too dear for what may be far behind, but for a rival.
        const double most =
            std::max(far_behind * all[0].seconds, all[std::min<std::size_t>(1, all.size() - 1)].seconds);
        std::erase_if(all, [&](const Candidate& one) { return one.seconds > most; });
        return soonest_of(figures, std::move(all), goal_arms[index], pieces * seconds, seconds);
    }
    const double share = goal_share[index] * seconds, most = std::max(share, most_share * seconds);
    const double first = takes_of(all[0]), both = has_rival ? first + takes_of(all[1]) : first;
    constexpr double rounding =
        1.0 + 1e-12;  // above the few 2^-53 of the sum, from which the parts are taken off again
    const double budget = first > share ? most : std::clamp(rounding * both, share, most);
    std::vector<CostStage::Arm> chosen = soonest_of(figures, std::move(all), goal_arms[index], budget, seconds);
    // Without its rival so much time tells less than more samples of several do, until there are such.
    if (has_rival && !alone && chosen.size() < 2) chosen.clear();
    return chosen;
}

// The seconds of the arm that is soonest at the error, of those that took part in the goal and may be recommended.
double soonest_there(const std::vector<ArmFigures>& figures, const CostSamples& samples, std::size_t index) {
    double soonest = std::numeric_limits<double>::infinity();
    for (const ArmFigures& arm : figures)
        for (std::uint32_t attempt = 0; attempt < attempts; ++attempt) {
            const ArmTrials* trials = trials_at(samples, arm.arm.name(), goal_stage(index, attempt));
            if (trials == nullptr || !arm.has_forecasts() || !arm.is_safe_at(cost_errors[index]) ||
                !has_replicates(*trials, fewest_replicates) || !is_at(*trials, cost_errors[index], samples.reference))
                continue;
            if (const TimeToError time = arm.time_to(cost_errors[index]); time.seconds)
                soonest = std::min(soonest, time.seconds->value);
        }
    return soonest;
}

// Those of a goal's last attempt that are not at the error, with twice the samples at least: the baseline, and what may
// be sooner than all that are.
std::vector<CostStage::Arm> not_there(const std::vector<ArmFigures>& figures, const CostSamples& samples,
    std::size_t index, std::uint32_t attempt, double seconds) {
    std::vector<CostStage::Arm> again;
    double left = seconds * goal_share[index];
    const double soonest = soonest_there(figures, samples, index);
    for (const ArmFigures& arm : figures) {
        const ArmTrials* before = trials_at(samples, arm.arm.name(), goal_stage(index, attempt - 1));
        if (before == nullptr || !has_replicates(*before, fewest_replicates) ||
            is_at(*before, cost_errors[index], samples.reference))
            continue;
        auto one = candidate(figures, arm, cost_errors[index]);
        if (!one || (one->soonest > soonest && &arm != figures.data())) continue;
        if (one->levels.back() <= before->samples.back())
            one->levels = levels_up_to(2.0 * static_cast<double>(before->samples.back()));
        const double takes = takes_of(*one);
        if (takes > left) continue;
        left -= takes;
        again.push_back({arm.arm.name(), std::move(one->levels)});
    }
    return again;
}

// `in_pieces`: what later measurements will finish is begun.
std::optional<CostStage> goal(const std::vector<ArmFigures>& figures, const CostSamples& samples, std::size_t index,
    double seconds, bool in_pieces) {
    for (std::uint32_t attempt = 0; attempt < attempts; ++attempt) {
        const std::uint32_t stage = goal_stage(index, attempt);
        CostStage next;
        if (is_entered(samples, stage)) {
            Lack lack = lack_of(figures, samples, stage, fewest_replicates);
            if (lack.stage.arms.empty()) continue;
            if (lack.seconds > seconds && !in_pieces) return std::nullopt;
            next = std::move(lack.stage);
            std::erase_if(next.arms, [&](const CostStage::Arm& arm) {
                return seconds_a_replicate(*trials_at(samples, arm.name, stage), samples) > seconds;
            });
        } else {
            // Longer renders have told which is soonest: to the error before, or of the growth.
            const bool alone = index > 0 || is_entered(samples, first_growth_stage);
            next.arms = attempt == 0 ? contenders(figures, index, seconds, alone, in_pieces)
                                     : not_there(figures, samples, index, attempt, seconds);
            next.stage = stage;
        }
        if (next.arms.empty()) return std::nullopt;
        next.purpose = fmt::format("to {:g} %", 100.0 * cost_errors[index]);
        return next;
    }
    return std::nullopt;
}

bool is_reached(const std::vector<ArmFigures>& figures, const CostSamples& samples, std::size_t index) {
    const auto is_judged = [&](const ArmTrials& arm) {
        return std::ranges::none_of(
            figures, [&](const ArmFigures& one) { return one.arm.name() == arm.name && !one.has_forecasts(); });
    };
    return std::ranges::any_of(samples.arms, [&](const ArmTrials& arm) {
        return is_judged(arm) && arm.stage >= goal_stage(index) && has_replicates(arm, fewest_replicates) &&
               is_at(arm, cost_errors[index], samples.reference);
    });
}

// The baseline to an error that others reached without it: users ask how far behind it is.
std::optional<CostStage> baseline_left_out(
    const std::vector<ArmFigures>& figures, const CostSamples& samples, double seconds) {
    const ArmFigures& baseline = figures.front();
    const std::string name = baseline.arm.name();
    for (std::size_t index = 0; index < cost_errors.size() && is_reached(figures, samples, index); ++index) {
        const double error = cost_errors[index];
        const bool took_part = std::ranges::any_of(samples.arms, [&](const ArmTrials& arm) {
            return arm.name == name && has_replicates(arm, fewest_replicates) &&
                   ((arm.stage >= goal_stage(index) && arm.stage < goal_stage(index + 1)) ||
                       is_at(arm, error, samples.reference));
        });
        CostStage next;
        next.stage = baseline_stage(index);
        const ArmTrials* begun = trials_at(samples, name, next.stage);
        const auto one = candidate(figures, baseline, error);
        if (took_part || !one || (begun != nullptr && has_replicates(*begun, fewest_replicates))) continue;
        next.arms.push_back({name, begun != nullptr ? begun->samples : one->levels});
        const double takes = static_cast<double>(fewest_replicates) * seconds_of(baseline, next.arms[0].samples);
        if (takes > baseline_share * seconds) return std::nullopt;
        next.purpose = fmt::format("to {:g} %", 100.0 * error);
        return next;
    }
    return std::nullopt;
}

// The arms that may be soonest at the error, with `factor` times their samples; none where that is too much for the
// first.
std::vector<CostStage::Arm> grown(
    const std::vector<ArmFigures>& figures, double error, double factor, std::size_t count, double seconds) {
    std::vector<Candidate> all;
    for (const ArmFigures& arm : figures) {
        const TimeToError time = arm.time_to(error);
        if (!may_be_had(figures, arm, error) || !(arm.variance > 0.0) || (!time.seconds && !time.unknown)) continue;
        const double wanted = factor * static_cast<double>(arm.points.back().samples);
        const double to_error = time.seconds ? time.seconds->value : std::numeric_limits<double>::infinity();
        all.push_back({&arm, levels_of(arm, wanted), to_error, to_error});
    }
    if (all.empty()) return {};
    const std::string first = std::ranges::min_element(all, {}, by_time)->arm->arm.name();
    std::vector<CostStage::Arm> chosen =
        soonest_of(figures, std::move(all), count, growth_share * seconds, growth_share * seconds);
    if (std::ranges::find(chosen, first, &CostStage::Arm::name) == chosen.end()) chosen.clear();
    return chosen;
}

std::optional<CostStage> growth(
    const std::vector<ArmFigures>& figures, const CostSamples& samples, double error, double seconds) {
    for (std::uint32_t step = 0; step < growth_steps; ++step) {
        CostStage next;
        if (is_entered(samples, first_growth_stage + step)) {
            Lack lack = lack_of(figures, samples, first_growth_stage + step, fewest_replicates);
            std::erase_if(lack.stage.arms, [&](const CostStage::Arm& arm) {
                return seconds_a_replicate(*trials_at(samples, arm.name, first_growth_stage + step), samples) > seconds;
            });
            if (lack.stage.arms.empty()) continue;
            next = std::move(lack.stage);
        } else {
            for (const double factor : growth_factors)
                if (next.arms.size() < 2) next.arms = grown(figures, error, factor, growth_arms >> step, seconds);
            next.stage = first_growth_stage + step;
        }
        if (next.arms.empty()) return std::nullopt;
        next.purpose = "more samples";
        return next;
    }
    return std::nullopt;
}

// Arms whose bias is neither found nor bounded, the cheapest first.
std::optional<CostStage> floors(const std::vector<ArmFigures>& figures, const CostSamples& samples, double seconds) {
    CostStage next;
    next.stage = floor_stage;
    next.purpose = "bounding bias";
    Lack lack = lack_of(figures, samples, floor_stage, fewest_replicates);
    if (!lack.stage.arms.empty() && lack.seconds <= seconds) {
        next.arms = std::move(lack.stage.arms);
        return next;
    }
    struct Unresolved {
        CostStage::Arm arm;
        double seconds;
    };
    std::vector<Unresolved> all;
    for (const ArmFigures& arm : figures) {
        constexpr double square = floor_bound * floor_bound;
        if (arm.has_floor || arm.squared_bias.high <= square || !(arm.variance > 0.0) || !arm.has_forecasts() ||
            trials_at(samples, arm.arm.name(), floor_stage) != nullptr)
            continue;
        // The interval of b^2 is as wide as the variance of the mean of all replicates.
        const double half = arm.squared_bias.high - arm.squared_bias.value;
        const double wanted = surely * arm.samples_for_bias * half / square / static_cast<double>(fewest_replicates);
        std::vector<std::uint64_t> levels = levels_up_to(wanted);
        const double takes = static_cast<double>(fewest_replicates) * seconds_of(arm, levels);
        all.push_back({{arm.arm.name(), std::move(levels)}, takes});
    }
    std::ranges::stable_sort(all, {}, &Unresolved::seconds);
    double left = seconds * floor_share;
    for (Unresolved& one : all) {
        if (one.seconds > left) break;
        left -= one.seconds;
        next.arms.push_back(std::move(one.arm));
    }
    if (next.arms.empty()) return std::nullopt;
    return next;
}

}  // namespace

std::vector<std::uint64_t> levels_up_to(double wanted) {
    const double capped = std::clamp(wanted, 1.0, static_cast<double>(most_samples_at_once));
    const auto count = static_cast<std::uint64_t>(std::ceil(capped));
    const std::uint64_t step = std::max(std::bit_floor(count) / 4, std::min(std::bit_ceil(count), samples_per_block));
    const std::uint64_t most = (count + step - 1) / step * step;
    // Counts below a block's are renders of their own, so only the greatest counts of a long replicate are looked at.
    const std::uint64_t least = std::max(std::bit_ceil(most) >> halvings, samples_per_block);
    std::vector<std::uint64_t> levels{most};
    for (std::uint64_t n = std::bit_floor(most * 2 / 3); n >= least; n /= 2) levels.insert(levels.begin(), n);
    return levels;
}

double seconds_a_replicate(const ArmTrials& trials, const CostSamples& samples) {
    const ArmTrials* longest = nullptr;
    for (const ArmTrials& arm : samples.arms)
        if (arm.name == trials.name && !arm.replicates.empty() &&
            (longest == nullptr || arm.samples.back() > longest->samples.back()))
            longest = &arm;
    if (longest == nullptr || trials.samples.empty()) return 0.0;
    double seconds = 0.0;
    for (const Replicate& replicate : longest->replicates) seconds += replicate.seconds.back();
    return seconds / static_cast<double>(longest->replicates.size()) * static_cast<double>(trials.samples.back()) /
           static_cast<double>(longest->samples.back());
}

std::optional<CostStage> next_stage(
    const std::vector<ArmFigures>& figures, const CostSamples& samples, double seconds) {
    if (figures.empty()) return std::nullopt;
    for (std::size_t index = 0; index < cost_errors.size(); ++index) {
        if (auto next = goal(figures, samples, index, seconds, false)) return next;
        // What is asked first is how soon 1 % is reached; a harder error takes longer than one that was not.
        const bool last = !is_reached(figures, samples, index);
        if (index == 1 || last)
            if (auto next = floors(figures, samples, seconds)) return next;
        if (!last) continue;
        if (auto next = growth(figures, samples, cost_errors[index], seconds)) return next;
        break;
    }
    if (auto next = baseline_left_out(figures, samples, seconds)) return next;
    // More replicates, of the hardest goals first.
    std::vector<std::uint32_t> stages;
    for (std::uint32_t stage = goal_stage(cost_errors.size()); stage-- > first_goal_stage;) stages.push_back(stage);
    std::uint32_t longest = first_goal_stage - 1;  // of the growth
    while (longest > first_growth_stage && !is_entered(samples, longest)) --longest;
    stages.insert(stages.end(), {longest, floor_stage, short_stage});
    for (const std::uint32_t stage : stages) {
        Lack lack = lack_of(figures, samples, stage, most_replicates);
        std::erase_if(lack.stage.arms, [&](const CostStage::Arm& arm) {
            return seconds_a_replicate(*trials_at(samples, arm.name, stage), samples) > seconds;
        });
        if (lack.stage.arms.empty()) continue;
        lack.stage.purpose = "more replicates";
        return lack.stage;
    }
    for (std::size_t index = 0; index < cost_errors.size(); ++index) {
        if (is_reached(figures, samples, index)) continue;
        return goal(figures, samples, index, seconds, true);
    }
    return std::nullopt;
}

}  // namespace tandem
