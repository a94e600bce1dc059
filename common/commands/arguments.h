// Checks the words of a command line before CLI11 reads them. They are words that CLI11 would misread, or refuse with a
// less helpful message.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem {

// Throws InputError for an argument that is no UTF-8 text or empty, and for an option that the command has not. The
// error names the option that was meant: near in spelling, or of the same meaning in another renderer. `arguments`
// lacks the program's name.
void check_arguments(const CLI::App& app, const std::vector<std::string>& arguments);

// The command that a misspelt or related `name` means; empty: none.
[[nodiscard]] std::string command_meant(const CLI::App& app, const std::string& name);

// One of the names; another is refused with the nearest.
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> names);

template <class Names>
[[nodiscard]] CLI::Validator one_of_names(const Names& names) {
    return one_of({names.begin(), names.end()});
}

}  // namespace tandem
