// Other programs as sides of verify: `exec:COMMAND` (common/external/README.md).
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "common/commands/command.h"
#include "common/external/program_renderer.h"
#include "common/validation/verify/verify.h"

namespace tandem {

// The renderers that are other programs.
using Programs = std::vector<ProgramRenderer*>;

// By a backend's name, or a command, which joins `programs`. Throws InputError.
[[nodiscard]] std::unique_ptr<Renderer> renderer_of(const std::string& name, const BackendOptions& options,
    const ProgramOptions& program_options, const BackendList& backends, Programs& programs);

[[nodiscard]] bool all_follow_numbers(const Programs& programs);

// Those of compare, unless all sides follow MODEL.md to its numbers. Another program's samples have a distribution of
// their own, and it puts film samples and edges its own way.
[[nodiscard]] Criteria criteria_for(std::initializer_list<const Renderer*> sides, const Programs& programs);

// What is told of a scene that a program did not render.
[[nodiscard]] SceneVerdict failed_verdict(const Scene& scene, const VerifyOptions& options,
    const RendererInfo& reference, const RendererInfo& candidate, const ProgramFailure& error);

}  // namespace tandem
