// Presets of `tandem verify`: which scenes, how large, and how long in all.
#pragma once

#include <string>
#include <vector>

namespace tandem {

struct VerifyPreset {
    std::string name;
    std::vector<std::string> scenes;  // files: of the working directory, else those that came with the program
    std::string size;                 // as --size has it
    double total_seconds = 0.0;
};

// `name`: smoke, driver or full. Throws InputError where the scenes are not there.
[[nodiscard]] VerifyPreset verify_preset(const std::string& name);

// "600", "90s", "10min" or "2h" to seconds above 0; `option` names it in the error. Throws InputError.
[[nodiscard]] double duration_from(const std::string& text, const std::string& option);

// "45 s", "4.5 min" or "2.1 h".
[[nodiscard]] std::string duration(double seconds);

}  // namespace tandem
