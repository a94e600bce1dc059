#include "common/commands/verify_presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "common/commands/command.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"

namespace tandem {

namespace {

// 64 pixels. The image's mean is known from as many paths as at 128, a tile's from four times as many. So a scene is
// decided in less time. What it costs is where in a tile a fault lies.
constexpr const char* small = "64";

std::vector<std::string> scenes_in(const std::string& preset, const std::string& folder) {
    std::vector<std::string> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(shipped_file(folder), error))
        if (entry.path().extension() == ".json") files.push_back(entry.path().string());
    if (files.empty())
        throw InputError(
            fmt::format("--preset {}: there is no scene in {}/; install the program with its scenes, run it in the "
                        "folder that holds "
                        "scenes/, or name scenes",
                preset, folder));
    std::ranges::sort(files);
    return files;
}

}  // namespace

VerifyPreset verify_preset(const std::string& name) {
    std::vector<std::string> scenes = scenes_in(name, "scenes");
    if (name == "driver") return {name, scenes, small, 600.0};
    if (name == "full") {
        std::ranges::move(scenes_in(name, "scenes/closed-forms"), std::back_inserter(scenes));
        return {name, scenes, "", 7200.0};
    }
    // One scene for each group of effects, soon decided.
    std::vector<std::string> chosen;
    for (const char* one : {"furnace", "glass", "miniature", "model", "moons", "motion"})
        chosen.push_back(shipped_file(fmt::format("scenes/{}.json", one)));
    return {name, chosen, small, 60.0};
}

double duration_from(const std::string& text, const std::string& option) {
    struct Unit {
        const char* name;
        double seconds;
    };
    constexpr std::array units{Unit{"", 1.0}, Unit{"s", 1.0}, Unit{"min", 60.0}, Unit{"h", 3600.0}};
    const std::size_t number = std::min(text.find_first_not_of("0123456789."), text.size());
    std::string unit = text.substr(number);
    std::erase(unit, ' ');
    const auto found = std::ranges::find_if(units, [&](const Unit& one) { return unit == one.name; });
    double value = 0.0;
    if (found != units.end() && CLI::detail::lexical_cast(text.substr(0, number), value)) value *= found->seconds;
    if (found == units.end() || !(value > 0.0 && value <= most_seconds))
        throw InputError(fmt::format("{}: '{}' is no time above 0; write 600, 90s, 10min or 2h", option, text));
    return value;
}

std::string duration(double seconds) {
    if (seconds < 100.0) return fmt::format("{:.2g} s", seconds);
    if (seconds < 6000.0) return fmt::format("{:.2g} min", seconds / 60.0);
    return fmt::format("{:.3g} h", seconds / 3600.0);
}

}  // namespace tandem
