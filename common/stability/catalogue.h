// The catalogue of hard cases as a file: scenes/hard/catalogue.json.
#pragma once

#include <string>
#include <vector>

#include "common/stability/hard_case.h"

namespace tandem::stability {

// Throws InputError, naming file, JSON pointer and mend.
[[nodiscard]] std::vector<HardCase> load_catalogue(const std::string& file);

}  // namespace tandem::stability
