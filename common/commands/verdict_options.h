// What `verify` and `compare` share: the options of a verdict, and its text.
#pragma once

#include <string>
#include <vector>

#include "common/commands/command.h"
#include "common/self_test/self_test.h"
#include "common/validation/report/junit.h"
#include "common/validation/verify/scene_verdict.h"

namespace tandem {

// Margins, and where the verdict is written.
struct CriteriaArguments {
    std::string image_margin, tile_margin;
    std::string report, junit;
};

void add_criteria(CLI::App& command, CriteriaArguments& arguments, const Criteria& defaults);

// `criteria` with the margins that are given. Throws InputError.
[[nodiscard]] Criteria criteria_from(const CriteriaArguments& arguments, Criteria criteria);

// check_outputs of --json, --junit and of --report, whose scenes have these names.
void check_outputs(const CriteriaArguments& arguments, const CommandContext& context,
    const std::vector<std::string>& scenes, const std::vector<std::string>& inputs);

void print_verdict(const SceneVerdict& verdict, bool verbose);

// Prints the overall verdict, writes --json, --junit and --report, and gives the exit status. `layer`: scenes of which
// Vulkan's validation layer has messages, and these. They are no disagreement, but fail the run.
[[nodiscard]] ExitStatus conclude(const std::string& command, const std::vector<SceneVerdict>& verdicts,
    const CriteriaArguments& arguments, const CommandContext& context, const std::vector<std::string>& not_run = {},
    const std::vector<DeviceSelfTest>& self_tests = {}, const LayerMessages& layer = {});

}  // namespace tandem
