#include "common/commands/programs.h"

#include <algorithm>

#include "common/error.h"
#include "common/validation/compare/compare.h"

namespace tandem {

std::unique_ptr<Renderer> renderer_of(const std::string& name, const BackendOptions& options,
    const ProgramOptions& program_options, const BackendList& backends, Programs& programs) {
    if (!is_command(name)) return find_backend(backends, name).create(options);
    if (!options.device.empty() || options.precision || !options.kernel.empty() || options.validation)
        throw InputError(
            "exec: devices, precisions, kernels and validation are for backends; give the command options of its own");
    auto program = std::make_unique<ProgramRenderer>(name, program_options);
    programs.push_back(program.get());
    return program;
}

bool all_follow_numbers(const Programs& programs) {
    return std::ranges::all_of(
        programs, [](const ProgramRenderer* program) { return program->info().follows_numbers; });
}

Criteria criteria_for(std::initializer_list<const Renderer*> sides, const Programs& programs) {
    const bool one_text = all_follow_numbers(programs) && std::ranges::all_of(sides, [](const Renderer* side) {
        return side->info().backend != "oracle";
    });
    return programs.empty() || one_text ? Criteria{} : CompareOptions::comparison_criteria();
}

SceneVerdict failed_verdict(const Scene& scene, const VerifyOptions& options, const RendererInfo& reference,
    const RendererInfo& candidate, const ProgramFailure& error) {
    SceneVerdict verdict;
    verdict.scene = scene.name;
    verdict.failure = error.what();
    verdict.sentence = std::string("not judged: ") + error.what();
    verdict.notes = error.log();
    verdict.settings = *options.settings;
    verdict.criteria = options.criteria;
    verdict.reference_info = reference;
    verdict.candidate_info = candidate;
    verdict.reference_name = reference.backend;
    verdict.candidate_name = candidate.backend;
    verdict.reference_seed = options.seed;
    verdict.candidate_seed = options.seed + 1;
    return verdict;
}

}  // namespace tandem
