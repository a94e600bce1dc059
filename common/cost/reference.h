// The long reference of `tandem cost`: the transport equation without a bounce limit, in two independent halves. They
// are stored in files. So they can be continued, and used for measurements on other devices.
#pragma once

#include "common/cost/run_cost.h"
#include "common/error.h"

namespace tandem {

// Continues `earlier`, or begins, until about `seconds` are spent on it in all (by its own account), or a stop.
[[nodiscard]] CostReference render_reference(
    RenderJob& job, std::optional<CostReference> earlier, double seconds, const CostControl& control);

// The reference of a request: request.reference_file where one is named, else the one of request.earlier, else one
// rendered for `seconds` and kept in request.references. Throws InputError where a file is of another image.
[[nodiscard]] CostReference long_reference(
    const Scene& scene, const CostRequest& request, double seconds, const CostControl& control);

// Renders request.reference_file for `seconds` more, or begins it. It is written before this returns.
[[nodiscard]] CostReference render_reference_file(
    const Scene& scene, const CostRequest& request, double seconds, const CostControl& control);

// All settings of an arm in words: equal for equal bits.
[[nodiscard]] std::string text_of(const ArmSettings& settings, const RendererInfo& info);

[[nodiscard]] InputError other_measurement();

}  // namespace tandem
