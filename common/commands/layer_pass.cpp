#include "common/commands/layer_pass.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "common/commands/child_process.h"
#include "common/commands/command.h"
#include "common/external/child.h"

namespace tandem {

namespace {

constexpr std::string_view layer_report = "the Vulkan validation layer reports:";  // vulkan/core/validation.cpp

std::string error_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    text = text.substr(text.rfind('\n') + 1);
    constexpr std::string_view program = "tandem: ";
    return text.starts_with(program) ? text.substr(program.size()) : text;
}

// The program escapes line ends within its one line of error; and no space about them.
std::string in_lines(std::string text) {
    constexpr std::string_view end = "\\x0a", spaces = " \n";
    for (std::size_t at = text.find(end); at != std::string::npos; at = text.find(end))
        text.replace(at, end.size(), "\n");
    const std::size_t begin = text.find_first_not_of(spaces);
    if (begin == std::string::npos) return "";
    return text.substr(begin, text.find_last_not_of(spaces) + 1 - begin);
}

}  // namespace

const char* name_of(LayerPass::Outcome outcome) {
    switch (outcome) {
        case LayerPass::Outcome::clean:
            return "clean";
        case LayerPass::Outcome::messages:
            return "messages";
        case LayerPass::Outcome::too_slow:
            return "too slow";
        case LayerPass::Outcome::not_run:
            break;
    }
    return "not run";
}

LayerPass layer_pass_from(int status, const std::string& errors) {
    if (status == static_cast<int>(ExitStatus::fine)) return {LayerPass::Outcome::clean, ""};
    if (const std::size_t at = errors.find(layer_report); at != std::string::npos) {
        return {LayerPass::Outcome::messages, in_lines(errors.substr(at + layer_report.size()))};
    }
    if (status >= 128)
        return {LayerPass::Outcome::messages,
            fmt::format("the program was ended by signal {}; {}", status - 128, error_line(errors))};
    return {LayerPass::Outcome::not_run, error_line(errors)};
}

LayerPass look_under_layer(
    const std::string& scene, const std::vector<std::string>& options, double seconds, const std::stop_token& stop) {
    const TemporaryFile log, image;
    const std::string picture = image.name() + ".pfm";
    std::vector<std::string> words{"/proc/self/exe", "render", scene, "-o", picture, "--backend", "vulkan",
        "--validation", "--size", "64", "--samples", "2", "--time", fmt::format("{}", seconds)};
    words.insert(words.end(), options.begin(), options.end());
    constexpr double poll_seconds = 0.02;  // how late a stop may be heeded
    Child child(words, log.name(), false);
    while (!child.ended_within(poll_seconds))
        if (stop.stop_requested()) return {LayerPass::Outcome::too_slow, ""};
    std::remove(picture.c_str());
    if (child.exit_status() == static_cast<int>(ExitStatus::undecided)) return {LayerPass::Outcome::too_slow, ""};
    std::ifstream file(log.name());
    return layer_pass_from(child.exit_status(), {std::istreambuf_iterator<char>(file), {}});
}

}  // namespace tandem
