// The exercises: their tasks and reference answers. Answers come from the code of a backend wherever one has it.
#pragma once

#include <span>
#include <vector>

#include "common/exercise/exercise.h"

namespace tandem {

[[nodiscard]] std::span<const Exercise> exercises();  // number n is exercises()[n - 1]

// By subject, in the order of their numbers.
[[nodiscard]] std::vector<Exercise> exercises_of_geometry();
[[nodiscard]] std::vector<Exercise> exercises_of_sampling();
[[nodiscard]] std::vector<Exercise> exercises_of_scattering();
[[nodiscard]] std::vector<Exercise> exercises_of_light();

}  // namespace tandem
