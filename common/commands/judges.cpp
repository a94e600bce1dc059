// tandem judges: what the rules of other projects say of two images, beside Tandem's verdict.
#include "common/validation/judges/judges.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/error.h"
#include "common/text.h"
#include "common/validation/compare/compare.h"

namespace tandem {

namespace {

struct JudgesArguments {
    std::string a, b;
};

ExitStatus judges(const JudgesArguments& arguments, const CommandContext& context) {
    const NothingToKeep at_work(context.interrupts);
    check_outputs(context, {}, {arguments.a, arguments.b});
    const Image a = read_image(arguments.a), b = read_image(arguments.b);
    const JudgedPair pair = judged_pair(a, b);
    // Before anything is printed, as it may refuse the images.
    std::optional<SceneVerdict> verdict;
    if (!pair.reference_variance.empty()) verdict = compare_images({{arguments.a, a}}, {{arguments.b, b}});
    nlohmann::json findings = nlohmann::json::array();
    for (const JudgeFinding& finding : ask_judges(pair)) {
        fmt::print("{:28} {:10} {:>10.4g} against {:<8.4g} {}\n", finding.name, finding.notices() ? "differ" : "alike",
            finding.score, finding.limit, finding.rule);
        findings.push_back({{"judge", finding.name}, {"notices", finding.notices()}, {"score", finding.score},
            {"limit", finding.limit}, {"rule", finding.rule}});
    }
    if (verdict) {
        fmt::print("{:28} {:10} {}\n", "tandem compare", name_of(verdict->verdict), escaped(verdict->sentence));
        findings.push_back({{"judge", "tandem compare"}, {"notices", verdict->verdict == Verdict::disagree},
            {"verdict", name_of(verdict->verdict)}, {"sentence", verdict->sentence}});
    } else {
        fmt::print("The other judges need variances: name files that tandem render wrote as .exr.\n");
    }
    write_json(context, {{"judges", findings}});
    return ExitStatus::fine;
}

}  // namespace

void add_judges_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("judges", "Apply published rules for equal images to two images");
    const auto arguments = std::make_shared<JudgesArguments>();
    command->add_option("a", arguments->a, "The reference: an image, best an .exr of tandem render")
        ->required()
        ->type_name("IMAGE");
    command->add_option("b", arguments->b, "The image that is judged")->required()->type_name("IMAGE");
    add_common_options(*command, context,
        "  tandem render scenes/cornell-classic.json -o a.exr --size 64\n"
        "  tandem render scenes/cornell-classic.json -o b.exr --size 64 --seed 1\n"
        "  tandem judges a.exr b.exr\n\n"
        "Each rule has its project's own threshold, or a rule of thumb where there is none. How often each is wrong: "
        "tests/records/judges/JUDGES.md.\n"
        "Exit status: 0; 2 for images that cannot be judged.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return judges(*arguments, context); }; });
}

}  // namespace tandem
