// Splits a command into items, and runs one of them. The commands plan and work and the ranks of mpirun share it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/commands/command.h"
#include "common/distribution/plan.h"

namespace tandem {

// Those of a parsed command that tandem plan knows, whose --json, --junit and --report are for all of them together.
// `read` gets the files that were read for it. Throws InputError where it cannot be split.
[[nodiscard]] std::vector<PlanItem> plan_items(
    const CLI::App& command, const CommandContext& context, std::vector<std::string>& read);

// Does an item in a process of its own, and puts its result into the folder. False, with what was told: it has none,
// and `status` is that of the command. `over`: asked all the time; a reason ends the item, by StoppedError.
struct ItemOutcome {
    bool has_result = false;
    int status = 0;
    std::string told;  // its last line, without a result
};
[[nodiscard]] ItemOutcome do_item(const PlanItem& item, const std::filesystem::path& folder,
    const std::function<std::string()>& over, const CommandContext& context);

struct VerdictFiles {
    std::string junit, report;  // empty: none
};

// Prints and writes what the items that have results say together, which are none of render. The exit status is that
// of the command that was split.
[[nodiscard]] ExitStatus merge_reports_of(const std::vector<PlanItem>& items, const std::filesystem::path& folder,
    const VerdictFiles& files, const CommandContext& context);

}  // namespace tandem
