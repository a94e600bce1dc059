// The four kinds of checks, on what a submission answered.
#pragma once

#include <vector>

#include "common/exercise/exercise.h"
#include "common/exercise/mark_picture.h"

namespace tandem {

struct Trial {
    const Exercise* exercise = nullptr;
    std::vector<std::string> argument_names, result_names;
    std::vector<Values> arguments, results;
};

// The arguments of that index: the same for the same seed.
[[nodiscard]] Values drawn(const Exercise& exercise, std::uint64_t seed, std::uint32_t index);

// `worst`, if any, gets the index of the arguments that a wrong answer's evidence is from.
[[nodiscard]] Mark check_values(const Trial& trial, std::size_t* worst = nullptr);
[[nodiscard]] Mark check_property(const Trial& trial);
// `picture`, if any, gets that of another density.
[[nodiscard]] Mark check_distribution(
    const Trial& trial, std::uint64_t seed, std::optional<MarkPicture>* picture = nullptr);
[[nodiscard]] Mark check_expectation(const Trial& trial);

}  // namespace tandem
