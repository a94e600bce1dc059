#include "common/commands/old_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace tandem {

namespace {

struct OldName {
    std::string_view command;  // empty: every one
    std::string_view before, now;
    std::string_view option = {};  // of whose value the name is a word; empty: the name is an option's own
};

constexpr std::array<OldName, 7> old_names{{
    {"", "--triangle-kernel", "--triangle-test"},
    {"", "--convex-kernel", "--convex-test"},
    {"verify", "--referee", "--oracle"},
    {"bench", "--makings", "--replicates"},
    {"stability", "--kernel", "--arm"},
    {"cost", "triangle-kernel", "triangle-test", "--knob"},
    {"cost", "convex-kernel", "convex-test", "--knob"},
}};

// Where in the argument the old name stands, if it stands there; `previous` is the argument before.
std::optional<std::size_t> place_of(const OldName& old, const std::string& argument, std::string_view previous) {
    const std::string name = argument.substr(0, argument.find('='));
    if (old.option.empty()) return name == old.before ? std::optional<std::size_t>(0) : std::nullopt;
    if (name != old.option && previous != old.option) return std::nullopt;
    const std::size_t place = argument.find(old.before);
    return place == std::string::npos ? std::nullopt : std::optional(place);
}

}  // namespace

RenamedArguments with_new_names(int argc, char** argv) {
    RenamedArguments renamed;
    const std::string_view command = argc > 1 ? argv[1] : "";
    for (int i = 1; i < argc; ++i) {
        std::string argument = argv[i];
        for (const OldName& old : old_names) {
            const std::optional<std::size_t> place = place_of(old, argument, argv[i - 1]);
            if (!place || (!old.command.empty() && old.command != command)) continue;
            argument.replace(*place, old.before.size(), old.now);
            const std::string note = fmt::format("{} is now {}; the old name still works", old.before, old.now);
            if (std::ranges::find(renamed.notes, note) == renamed.notes.end()) renamed.notes.push_back(note);
        }
        renamed.arguments.push_back(std::move(argument));
    }
    return renamed;
}

}  // namespace tandem
