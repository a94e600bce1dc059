// Finds the scenes that come with the program, from any folder, in the source tree and in an installation.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tandem {

// The file that `name` means: itself where it exists; else, beside the program, that path (scenes/glass.json), or the
// scene of that name (glass, closed-forms/polygon-light). What is found nowhere stays as it is.
[[nodiscard]] std::string shipped_file(const std::string& name);

// What a command's SCENE may be.
inline constexpr const char* scene_help = "Scene file, or the name of a shipped scene";

// Puts shipped_file in the place of what was typed. Throws InputError where a shipped scene has nearly that name.
[[nodiscard]] CLI::Validator scene_name();

}  // namespace tandem
