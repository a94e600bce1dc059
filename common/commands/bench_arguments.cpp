#include "common/commands/bench_arguments.h"

#include <fmt/format.h>

#include "common/files/write_file.h"

namespace tandem {

void check_outputs(
    const BenchArguments& arguments, const CommandContext& context, const std::vector<std::string>& inputs) {
    check_outputs(context, {{"--csv", arguments.csv}}, inputs);
    if (!arguments.resume.empty()) check_outputs({{"--csv", arguments.csv}}, {arguments.resume});
}

CampaignOptions campaign_options(const BenchArguments& arguments, const CommandTime& time) {
    CampaignOptions options;
    options.seconds = time.left();
    options.narrow = arguments.narrow;
    options.replicates = arguments.replicates;
    options.seed = arguments.seed;
    options.only = arguments.arms;
    options.stop = time.token();
    return options;
}

std::vector<std::string> words_of(
    const BenchArguments& arguments, const CampaignPart& part, const std::string& known, const std::string& file) {
    std::vector<std::string> words{"bench", "--json", file, "--time", fmt::format("{}", part.seconds), "--narrow",
        fmt::format("{}", arguments.narrow), "--seed", fmt::format("{}", part.seed), "--replicates",
        fmt::format("{}", part.replicates)};
    const auto add = [&](const char* option, const std::vector<std::string>& values) {
        for (const std::string& value : values) words.insert(words.end(), {option, value});
    };
    if (!known.empty()) add("--resume", {known});
    if (arguments.arm_library.empty())
        add("--scene", {arguments.scene});
    else
        add("--arm-library", {arguments.arm_library});
    if (!arguments.device.empty()) add("--device", {arguments.device});
    add("--family", arguments.families);
    add("--arm", arguments.arms);
    add("--size", arguments.sizes);
    return words;
}

void tell_results(const BenchArguments& arguments, const CommandContext& context, const BenchResults& results,
    const std::vector<Claim>& claims) {
    fmt::print("{}", to_text(results, claims));
    nlohmann::json report = to_json(results, claims);
    if (context.stop.stop_requested()) report["stopped"] = true;
    write_json(context, report);
    if (!arguments.csv.empty()) write_text_file(arguments.csv, to_csv(results), context.read);
}

}  // namespace tandem
