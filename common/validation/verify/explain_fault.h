// Explains a disagreement: the pixel and sample to trace, what parts the paths, the features that the difference needs,
// and the suspected parts. Where both sides miss a closed form alike, it says what that tells. It uses the time that is
// left, and changes no verdict.
#pragma once

#include <functional>
#include <string>

#include "common/stopwatch.h"
#include "common/validation/verify/scene_verdict.h"
#include "common/validation/verify/verify.h"

namespace tandem {

struct FaultRequest {
    const Scene& scene;
    Renderer& reference;
    Renderer& candidate;
    const VerifyOptions& options;
    bool follow_numbers = false;                             // both sides draw the same numbers
    bool same_samples = false;                               // ... and their samples part by rounding alone
    double prepare_seconds = 0.0, seconds_per_sample = 0.0;  // of both sides
    double reference_seconds_per_sample = 0.0;
    const Stopwatch& watch;  // since the verdict began
    std::function<void(const std::string& what)> report;
};

// Sets the verdict's worst pixel, fault_place, signature, likeness, partings, elimination, data_trial,
// precision_trial, suspects, ranking and missed_form. A device that is lost meanwhile takes no verdict back: what is
// known by then stays.
void explain_fault(SceneVerdict& verdict, const FaultRequest& request);

}  // namespace tandem
