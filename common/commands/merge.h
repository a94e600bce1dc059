// What merge and merge-results share: one image of parts.
#pragma once

#include "common/commands/command.h"

namespace tandem {

struct MergeArguments {
    std::vector<std::string> parts;
    std::string output;
    bool allow_gaps = false, sums = false;
    double exposure = 1.0;
};

// Writes the image, and says of what it is made.
[[nodiscard]] ExitStatus merge_parts(const MergeArguments& arguments, const CommandContext& context);

}  // namespace tandem
