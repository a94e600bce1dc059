#include "common/validation/verdict/sample_pairs.h"

#include <algorithm>
#include <cmath>

#include "common/statistics/distributions.h"
#include "common/statistics/multiple_tests.h"

namespace tandem {

std::vector<SampleState> compare_samples(
    const Estimate::Plane& reference, const Estimate::Plane& candidate, double tolerance) {
    std::vector<SampleState> states(reference.size() / channel_count, SampleState::dark);
    for (std::size_t i = 0; i < reference.size(); ++i) {
        const double a = reference[i].sum, b = candidate[i].sum, larger = std::max(std::abs(a), std::abs(b));
        if (larger == 0.0) continue;
        SampleState& state = states[i / channel_count];
        if (std::abs(b - a) > tolerance * larger)
            state = SampleState::parted;
        else
            state = std::max(state, SampleState::same);
    }
    return states;
}

SampleCount count(const std::vector<SampleState>& states) {
    SampleCount result;
    for (const SampleState state : states) result.add(state);
    return result;
}

double share_limit(const SampleCount& count) {
    constexpr double error = 1e-4;
    if (count.lit == 0) return 1.0;
    return binomial_upper_limit(static_cast<unsigned>(count.parted), static_cast<unsigned>(count.lit), error);
}

LevelResult sample_level(const std::string& name, const std::vector<SampleRegion>& regions) {
    LevelResult result;
    result.name = name;
    result.test = "binomial tail of parted samples, Bonferroni";
    result.tests = regions.size();
    std::vector<double> p_values;
    for (const SampleRegion& one : regions) {
        RegionComparison region;
        region.reference = static_cast<double>(one.count.lit);
        region.candidate = static_cast<double>(one.count.parted);
        region.relative = one.count.share();
        if (one.count.parted > 0 && one.tolerated < 1.0)
            region.p = binomial_upper_tail(
                static_cast<unsigned>(one.count.parted), static_cast<unsigned>(one.count.lit), one.tolerated);
        p_values.push_back(region.p);
        if (p_values.size() > 1 && !(region.p < result.worst.p)) continue;
        result.worst = region;
        result.place = one.place;
    }
    if (!p_values.empty()) result.p = bonferroni(p_values);
    return result;
}

}  // namespace tandem
