// Every option of every command, with a letter less, without a value, and by the words of other renderers: what is
// told.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/layer_pass.h"
#include "common/error.h"
#include "tests/refusal.h"

using namespace tandem;

namespace {

// All commands, of a program without backends: none of them is run.
struct Commands {
    Program program{};
    InterruptWatch interrupts;
    FilesRead read;
    CommandContext context{program, "", {}, "", -1, false, {}, interrupts, read};
    CLI::App app{"", "tandem"};
    Commands() {
        for (const auto add : {add_render_command, add_verify_command, add_compare_command, add_effects_command,
                 add_bench_command, add_cost_command, add_trace_command, add_stability_command, add_export_command,
                 add_import_command, add_judges_command, add_devices_command, add_exercise_command})
            add(app, context);
    }
    [[nodiscard]] std::string refusal(const std::vector<std::string>& arguments) const {
        return tandem::refusal([&] { check_arguments(app, arguments); });
    }
};

}  // namespace

TEST_CASE("an option with a letter less or more is told with the one that was meant") {
    const Commands commands;
    int count = 0;
    for (const CLI::App* command : commands.app.get_subcommands({}))
        for (const CLI::Option* option : command->get_options()) {
            if (option->get_lnames().empty()) continue;
            const std::string name = option->get_lnames().front();
            for (const std::string& slip :
                {name.substr(0, name.size() - 1), name.substr(0, 1) + name, name.substr(0, 1) + name.substr(2)}) {
                const auto begins = [&](const CLI::Option* other) {
                    return other->get_name().starts_with("--" + slip);
                };
                const bool of_several = std::ranges::count_if(command->get_options(), begins) > 1;
                if (command->get_option_no_throw("--" + slip) != nullptr || name.size() < 4 || of_several) continue;
                CAPTURE(slip);
                const std::string line = commands.refusal({command->get_name(), "--" + slip, "1"});
                CHECK(contains(line, "--" + slip + ": no such option"));
                CHECK(contains(line, "did you mean --" + name + "?"));
                ++count;
            }
            CHECK(commands.refusal({command->get_name(), "-" + name, "1"}) != "");
        }
    CHECK(count > 300);
}

TEST_CASE("words of other renderers lead to the option") {
    const Commands commands;
    const std::vector<std::array<std::string, 3>> words{{"render", "spp", "samples"}, {"render", "resolution", "size"},
        {"render", "width", "size"}, {"render", "max-depth", "bounces"}, {"render", "out", "output"},
        {"render", "output-file", "output"}, {"render", "noise", "target-error"}, {"render", "rr-depth", "roulette"},
        {"render", "sampler", "generator"}, {"render", "nthreads", "threads"}, {"verify", "spp", "samples"},
        {"verify", "tolerance", "margin"}, {"verify", "timeout", "time"}, {"verify", "xml", "junit"},
        {"cost", "gpu", "device"}};
    for (const auto& [command, word, meant] : words) {
        CAPTURE(word);
        for (const std::string& given : {"--" + word, "-" + word, "--" + word + "=5"})
            CHECK(contains(commands.refusal({command, given}), "did you mean --" + meant + "?"));
    }
}

TEST_CASE("an empty value is refused for every option, and a gap in every list") {
    const Commands commands;
    int count = 0;
    for (const CLI::App* command : commands.app.get_subcommands({})) {
        const std::string of = command->get_name();
        CHECK(contains(commands.refusal({of, ""}), "an argument is empty"));
        for (const CLI::Option* option : command->get_options()) {
            if (option->get_lnames().empty() || option->get_expected_max() == 0) continue;
            const std::string name = "--" + option->get_lnames().front();
            CAPTURE(name);
            for (const std::vector<std::string>& words :
                {std::vector<std::string>{of, name, ""}, {of, name, " "}, {of, name + "="}}) {
                CHECK(contains(commands.refusal(words), name + ": its value is empty"));
                ++count;
            }
            CHECK(commands.refusal({of, name, "a"}) == "");
            CHECK(commands.refusal({of, name + "=a=b,c"}) == "");
            for (const char* list : {",", "a,", ",a", "a,,b"})
                CHECK(contains(commands.refusal({of, name, list}), "has an empty place") ==
                      (option->get_delimiter() == ','));
        }
    }
    CHECK(count > 200);
}

TEST_CASE("numbers below 0, names after -- and values that look like commands are no options") {
    const Commands commands;
    CHECK(commands.refusal({"render", "--exposure", "-1", "a"}) == "");
    CHECK(commands.refusal({"render", "--", "--spp"}) == "");
    CHECK(commands.refusal({"render", "verify", "--output", "cost", "-v", "-obox.png"}) == "");
    CHECK(commands.refusal({"render", "-oa=b.png"}) == "");
    CHECK(commands.refusal({"render", "-o=box.png"}) == "-o=box.png: write -o VALUE or --output=VALUE");
    CHECK(contains(commands.refusal({"\xff"}), "no UTF-8"));
}

TEST_CASE("what a process under the validation layer ends with is clean, messages, or no look at all") {
    using Outcome = LayerPass::Outcome;
    CHECK(layer_pass_from(0, "tandem: a remark about the scene\n").outcome == Outcome::clean);
    const LayerPass told =
        layer_pass_from(2, "tandem: the Vulkan validation layer reports:\\x0a  SYNC-1\\x0a  SYNC-2\n");
    CHECK(told.outcome == Outcome::messages);
    CHECK(told.text == "SYNC-1\n  SYNC-2");
    CHECK(layer_pass_from(134, "terminate called\n").outcome == Outcome::messages);
    const LayerPass none = layer_pass_from(4, "tandem: validation was asked for, but there is no layer\n");
    CHECK(none.outcome == Outcome::not_run);
    CHECK(none.text == "validation was asked for, but there is no layer");
}
