#include "common/cost/hierarchy_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem {

namespace {

std::string short_duration(double seconds) {
    return seconds < 1.0 ? fmt::format("{:.3g} ms", 1e3 * seconds) : fmt::format("{:.3g} s", seconds);
}

std::string samples(double count) {
    return std::isfinite(count) ? fmt::format("{:.3g}", std::max(0.0, count)) : "any number";
}

// Count at which what is saved in building is spent in rendering.
double even(double saved, double seconds_a_sample, double ratio) {
    const double lost = seconds_a_sample * (ratio - 1.0);
    return lost == 0.0 ? std::numeric_limits<double>::infinity() : saved / lost;
}

}  // namespace

HierarchyCost hierarchy_cost(const ArmFigures& arm, const ArmFigures& baseline) {
    const CostPoint& last = baseline.points.back();
    HierarchyCost cost;
    cost.build_seconds = arm.arm.hierarchy_seconds.value();
    cost.baseline_build_seconds = baseline.arm.hierarchy_seconds.value();
    cost.baseline_seconds_a_sample = last.seconds.value / static_cast<double>(last.samples);
    cost.seconds_a_sample = cost.baseline_seconds_a_sample * arm.time_ratio.value;
    const double saved = cost.baseline_build_seconds - cost.build_seconds;
    const bool slower = arm.time_ratio.low > 1.0, faster = arm.time_ratio.high < 1.0;
    const auto at = [&](double ratio) { return even(saved, cost.baseline_seconds_a_sample, ratio); };
    if ((saved > 0.0 && slower) || (saved < 0.0 && faster)) {
        cost.pays = saved > 0.0 ? PaysFor::few_samples : PaysFor::many_samples;
        const double a = at(arm.time_ratio.low), b = at(arm.time_ratio.high);
        cost.even_samples = {at(arm.time_ratio.value), std::min(a, b), std::max(a, b)};
        // No render has less than a sample.
        if (cost.even_samples.high < 1.0) cost.pays = saved > 0.0 ? PaysFor::no_count : PaysFor::any_count;
    } else if (faster) {
        cost.pays = PaysFor::any_count;
    } else if (slower) {
        cost.pays = PaysFor::no_count;
    } else if (saved != 0.0) {
        cost.even_samples.low = at(saved > 0.0 ? arm.time_ratio.high : arm.time_ratio.low);
    }
    return cost;
}

std::string sentence_on_building(const ArmFigures& arm, const ArmFigures& baseline) {
    if (arm.arm.knob != hierarchy_knob || !arm.arm.hierarchy_seconds || !baseline.arm.hierarchy_seconds) return "";
    const HierarchyCost cost = hierarchy_cost(arm, baseline);
    const Estimated& at = cost.even_samples;
    const std::string range =
        fmt::format("{} samples a pixel ({} to {})", samples(at.value), samples(at.low), samples(at.high));
    const auto judgement = [&]() -> std::string {
        switch (cost.pays) {
            case PaysFor::any_count:
                return "it pays for any number of samples";
            case PaysFor::no_count:
                return "it pays for no number of samples";
            case PaysFor::few_samples:
                return fmt::format("it pays up to {}", range);
            case PaysFor::many_samples:
                return fmt::format("it pays from {} on", range);
            case PaysFor::unknown:
                break;
        }
        if (at.low < 1.0) return "which one pays is not known";
        return fmt::format("{} pays up to {} samples a pixel at least, and more may not",
            cost.build_seconds < cost.baseline_build_seconds ? "it" : "the baseline", samples(at.low));
    };
    return fmt::format("{} builds its hierarchy in {}, the baseline in {}; a sample of the image takes {} and {}: {}",
        arm.arm.name(), short_duration(cost.build_seconds), short_duration(cost.baseline_build_seconds),
        short_duration(cost.seconds_a_sample), short_duration(cost.baseline_seconds_a_sample), judgement());
}

}  // namespace tandem
