// A command under mpirun. It is split into items, as by tandem plan, and each free rank runs the next one.
#pragma once

#include <string>

#include "common/commands/command.h"

namespace tandem {

// Whether a command of that name is shared out so.
[[nodiscard]] bool has_items_for_ranks(const std::string& command);

// Rank 0 prints and writes what merge-results would; the others do what it asks for, and say nothing.
[[nodiscard]] ExitStatus items_by_ranks(const CLI::App& command, const CommandContext& context);

}  // namespace tandem
