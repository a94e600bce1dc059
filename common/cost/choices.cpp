// Choices by the figures of `tandem cost`: the fastest arm to an error, and the settings that are worth measuring
// together.
#include <algorithm>
#include <utility>

#include "common/cost/analysis.h"

namespace tandem {

namespace {

// Roulette does without a limit of bounces, and MIS belongs to one integrator, so that a mix can have but one of each
// two.
bool exclude_each_other(const CostArm& a, const CostArm& b) {
    const auto ends_paths = [](const CostArm& arm) { return arm.knob == "bounces" || arm.knob == "roulette"; };
    const auto finds_light = [](const CostArm& arm) { return arm.knob == "integrator" || arm.knob == "mis"; };
    // What samples no light, or from both ends, has no choice of it (check_settings).
    const auto lightless = [](const CostArm& one, const CostArm& other) {
        return one.knob == "light-sampling" && other.knob == "integrator" &&
               other.setting != integrator_names[static_cast<std::size_t>(Integrator::next_event)];
    };
    // Adaptive sampling refuses what hides the scatter of a pixel's samples (check_sampling).
    const auto clash = [](const CostArm& one, const CostArm& other) {
        return one.knob == "sampling" &&
               (other.setting == "sobol" || other.setting == "bidirectional" || other.setting == "plain");
    };
    return a.knob == b.knob || (ends_paths(a) && ends_paths(b)) || (finds_light(a) && finds_light(b)) || clash(a, b) ||
           clash(b, a) || lightless(a, b) || lightless(b, a);
}

}  // namespace

const ArmFigures* soonest(const std::vector<ArmFigures>& figures, double relative_error, bool forecasts) {
    const ArmFigures* best = nullptr;
    double least = 0.0;
    const TimeToError of_baseline = figures.front().time_to(relative_error);
    for (const ArmFigures& arm : figures) {
        const bool baseline = &arm == figures.data();
        const TimeToError time = arm.time_to(relative_error);
        if (!time.seconds || (!baseline && !arm.is_safe_at(relative_error))) continue;
        if (time.extrapolated && !forecasts && !baseline) continue;
        const bool may_be_as_slow = of_baseline.seconds && time.seconds->high >= of_baseline.seconds->low;
        if (!baseline && !arm.cost_differs && may_be_as_slow) continue;
        if (best != nullptr && time.seconds->value >= least) continue;
        best = &arm;
        least = time.seconds->value;
    }
    return best;
}

namespace {

constexpr double aim = 0.01;  // error that mixes are to reach soonest
constexpr double hardest = cost_errors.back();

// What does without the baseline's limit of bounces at the least cost, where that limit may leave a greater error than
// the hardest one. A higher limit may leave one, too, which few samples do not show. So the cheapest of the highest
// limit is there besides: roulette has 256 bounces, as the reference. A floor of half the aim is no reason to leave an
// arm out: it needs at most 1 / (1 - 1/4) times the samples for it.
std::vector<std::size_t> limitless(const std::vector<ArmFigures>& figures) {
    const ArmFigures& base = figures.front();
    if (base.squared_bias.high <= hardest * hardest) return {};
    const auto bounces_of = [&](std::size_t i) { return figures[i].arm.settings.render.bounces; };
    std::vector<std::size_t> all;
    for (std::size_t i = 1; i < figures.size(); ++i) {
        const ArmFigures& arm = figures[i];
        const bool hinders = arm.has_floor && arm.squared_bias.value > 0.25 * aim * aim;
        if ((arm.arm.knob == "bounces" || arm.arm.knob == "roulette") && bounces_of(i) > bounces_of(0) && !hinders)
            all.push_back(i);
    }
    std::ranges::stable_sort(all, {}, [&](std::size_t i) { return figures[i].cost_ratio.value; });
    if (all.empty()) return {};
    const std::size_t most = std::ranges::max(all, {}, bounces_of);
    const auto first_of_most =
        std::ranges::find_if(all, [&](std::size_t i) { return bounces_of(i) == bounces_of(most); });
    std::vector<std::size_t> chosen{all.front()};
    if (*first_of_most != all.front()) chosen.push_back(*first_of_most);
    return chosen;
}

// The best of each knob. A knob counts where a setting beats the baseline significantly and has no floor. From bounces
// and roulette the better one.
std::vector<std::size_t> best_of_each(const std::vector<ArmFigures>& figures) {
    std::vector<std::size_t> best;
    for (std::size_t i = 1; i < figures.size(); ++i) {
        const ArmFigures& arm = figures[i];
        if (arm.arm.knob == "mix" || arm.has_floor || !arm.is_safe_at(aim) || !arm.cost_differs ||
            arm.cost_ratio.value >= 1.0)
            continue;
        const auto same =
            std::ranges::find_if(best, [&](std::size_t j) { return exclude_each_other(figures[j].arm, arm.arm); });
        if (same == best.end())
            best.push_back(i);
        else if (arm.cost_ratio.value < figures[*same].cost_ratio.value)
            *same = i;
    }
    return best;
}

}  // namespace

std::vector<std::vector<std::size_t>> mixed_settings(const std::vector<ArmFigures>& figures) {
    std::vector<std::vector<std::size_t>> mixes;
    const auto add = [&](std::vector<std::size_t> mix) {
        std::ranges::sort(mix);
        if (mix.size() >= 2 && std::ranges::find(mixes, mix) == mixes.end()) mixes.push_back(std::move(mix));
    };
    const std::vector<std::size_t> best = best_of_each(figures);
    // These, and of the best what goes with them.
    const auto with_best = [&](std::vector<std::size_t> mix) {
        for (const std::size_t one : best)
            if (std::ranges::none_of(mix, [&](std::size_t other) {
                    return one == other || exclude_each_other(figures[one].arm, figures[other].arm);
                }))
                mix.push_back(one);
        return mix;
    };
    add(best);
    const std::vector<std::size_t> whole = limitless(figures);
    for (std::size_t i = 1; i < figures.size(); ++i) {
        const CostArm& late = figures[i].arm;
        if (late.setting != "sobol" && late.setting != "adaptive") continue;
        add(with_best({i}));
        for (const std::size_t one : whole) {
            add(with_best({i, one}));
            add({i, one});  // what is best with independent samples may be worse with these: paths without MIS, say
        }
    }
    return mixes;
}

}  // namespace tandem
