// The mark of a submission: right, to a stated accuracy; wrong, with evidence; or undecided, with the reason.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/exercise/exercise.h"
#include "common/exercise/sandbox.h"

namespace tandem {

enum class MarkKind {
    right,
    wrong,
    undecided,  // no fault was found, but the answer is too noisy to say that there is none
};

struct Mark {
    MarkKind kind = MarkKind::wrong;
    std::string summary;                 // one line, without the kind
    std::vector<std::string> evidence;   // lines: the numbers that are off, or what the compiler says
    std::vector<std::string> errs_like;  // causes, the likeliest first, at most three
    bool ran = false;                    // it compiled, and gave numbers
};

// `text` is the submission. Throws DeviceError and Error where no mark can be given.
[[nodiscard]] Mark mark_of(const Exercise& exercise, const std::string& text, std::uint64_t seed);

[[nodiscard]] std::string_view name_of(MarkKind kind);  // "right"

}  // namespace tandem
