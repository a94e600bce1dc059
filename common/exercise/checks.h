// The four kinds of checks, on what a submission answered.
#pragma once

#include <vector>

#include "common/exercise/exercise.h"
#include "common/exercise/marker.h"

namespace tandem {

struct Trial {
    const Exercise* exercise = nullptr;
    std::vector<std::string> argument_names, result_names;
    std::vector<Values> arguments, results;
};

// The arguments of that index: the same for the same seed.
[[nodiscard]] Values drawn(const Exercise& exercise, std::uint64_t seed, std::uint32_t index);

[[nodiscard]] Mark check_values(const Trial& trial);
[[nodiscard]] Mark check_property(const Trial& trial);
[[nodiscard]] Mark check_distribution(const Trial& trial, std::uint64_t seed);
[[nodiscard]] Mark check_expectation(const Trial& trial);

}  // namespace tandem
