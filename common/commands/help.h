// The pages of --help and --help-all: what the command does, how it is called, examples, options. Lines are wrapped.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tandem {

// Options of this group stand under --help-all alone.
inline constexpr const char* rare_options = "Options that few need";

class HelpPage : public CLI::FormatterBase {
public:
    [[nodiscard]] std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
};

}  // namespace tandem
