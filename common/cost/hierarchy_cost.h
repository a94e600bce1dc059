// The time to build a hierarchy against the time to trace it (the knob hierarchy-quality of `tandem cost`). It tells
// which quality is fastest for how many samples. A render's seconds hold the time to trace alone.
#pragma once

#include <string>

#include "common/cost/analysis.h"

namespace tandem {

// Where an arm takes less time than the baseline, building included.
enum class PaysFor {
    any_count,     // from one sample on
    no_count,      // from one sample on it takes longer
    few_samples,   // builds sooner, renders slower
    many_samples,  // the reverse
    unknown        // builds otherwise, and which one renders sooner is not known
};
struct HierarchyCost {
    double build_seconds = 0.0, baseline_build_seconds = 0.0;
    double seconds_a_sample = 0.0, baseline_seconds_a_sample = 0.0;  // at the greatest count of the baseline
    PaysFor pays = PaysFor::unknown;
    // Samples a pixel at which both take as long, building included: for few_samples and many_samples. For unknown only
    // `low` is known: below it the one that builds sooner is sooner, whichever renders sooner.
    Estimated even_samples{0.0, 0.0, 0.0};
};

// `arm` and `baseline` know how long their hierarchies take to build.
[[nodiscard]] HierarchyCost hierarchy_cost(const ArmFigures& arm, const ArmFigures& baseline);

// "hierarchy-quality low builds in 41 ms, the baseline in 163 ms; ..."; empty of other arms.
[[nodiscard]] std::string sentence_on_building(const ArmFigures& arm, const ArmFigures& baseline);

}  // namespace tandem
