// tandem stability: the hard cases of scenes/hard on every backend, precision, intersection test and guard.
#include "common/stability/stability.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <mutex>
#include <set>
#include <span>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/command_time.h"
#include "common/commands/console.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "common/self_test/self_test.h"
#include "common/stability/catalogue.h"
#include "common/text.h"

namespace tandem {

namespace {

using stability::CaseResult;
using stability::Outcome;
using stability::StabilityReport;

struct StabilityArguments {
    std::string catalogue = "scenes/hard/catalogue.json", device;
    std::vector<std::string> cases, backends, precisions;
    stability::StabilityOptions options;
};

double per_billion(std::uint64_t count, std::uint64_t rays) {
    return rays == 0 ? 0.0 : 1e9 * static_cast<double>(count) / static_cast<double>(rays);
}

nlohmann::json to_json(const CaseResult& result) {
    nlohmann::json written{{"id", result.id}, {"name", result.name}, {"backend", result.backend},
        {"precision", result.precision}, {"kernel", result.kernel}, {"rays", result.rays}, {"misses", result.misses},
        {"false_hits", result.false_hits}, {"self_hits", result.self_hits},
        {"misses_per_billion", per_billion(result.misses, result.rays)},
        {"false_hits_per_billion", per_billion(result.false_hits, result.rays)},
        {"self_hits_per_billion", per_billion(result.self_hits, result.rays)}, {"worst_ulp", result.worst_ulp},
        {"bound", result.bound}, {"bound_derivation", result.bound_text},
        {"nanoseconds_per_ray", result.nanoseconds_per_ray}, {"aimed_at_seams", result.aimed},
        {"outcome", stability::outcome_names[static_cast<std::size_t>(result.outcome)]}};
    if (!result.remark.empty()) written["remark"] = result.remark;
    return written;
}

// The self-test of the device that the benches share; nothing where all compute as this program does.
std::optional<DeviceSelfTest> test_device(const std::vector<stability::Bench>& benches) {
    for (const stability::Bench& bench : benches)
        if (const std::optional<DeviceSelfTest> test = self_test_of(*bench.renderer)) return test;
    return std::nullopt;
}

nlohmann::json to_json(const std::optional<DeviceSelfTest>& test) {
    return test ? tandem::to_json(std::vector{*test}).front() : nlohmann::json();
}

nlohmann::json to_json(const StabilityReport& report, const std::vector<stability::Bench>& benches) {
    nlohmann::json cases = nlohmann::json::array(), skipped = nlohmann::json::array(),
                   devices = nlohmann::json::array();
    std::uint64_t aimed = 0;
    for (const CaseResult& result : report.results) {
        cases.push_back(to_json(result));
        if (result.aimed) aimed += result.rays;
    }
    for (const stability::Skipped& s : report.skipped)
        skipped.push_back(
            {{"backend", s.backend}, {"precision", s.precision}, {"kernel", s.kernel}, {"reason", s.reason}});
    for (const stability::Bench& bench : benches) {
        const RendererInfo info = bench.renderer->info();
        devices.push_back({{"backend", bench.backend}, {"precision", name_of(bench.precision, precision_names)},
            {"device", info.device}, {"driver", info.driver}});
    }
    return {{"cases", cases}, {"unsupported", skipped}, {"devices", devices}, {"rays_aimed_at_seams", aimed},
        {"complete", report.not_run == 0}, {"arms_not_run", report.not_run},
        {"verdict", report.failed()      ? "fail"
                    : report.not_run > 0 ? "undecided"
                                         : "pass"}};
}

void print_arm(const CaseResult& r) {
    fmt::print("{:8} {:7} {:10} {:15} {:>9} {:>9.4g} {:>9.4g} {:>9.4g} {:>9.3g} {:>7.3g} {:>7.4g}  {}{}\n",
        escaped(r.id), r.backend, r.precision, r.kernel, r.rays, per_billion(r.misses, r.rays),
        per_billion(r.false_hits, r.rays), per_billion(r.self_hits, r.rays), r.worst_ulp, r.bound,
        r.nanoseconds_per_ray, stability::outcome_names[static_cast<std::size_t>(r.outcome)],
        r.remark.empty() ? "" : " (" + r.remark + ")");
}

void print_arms(std::span<const CaseResult> results) {
    if (results.empty()) return;
    fmt::print(
        "Misses, false hits and self-hits per 10^9 rays; worst error and bound in units of the last place of the "
        "largest coordinate\n");
    fmt::print("{:8} {:7} {:10} {:15} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7} {:>7}  {}\n", "case", "backend", "precision",
        "arm", "rays", "misses", "false", "self", "worst", "bound", "ns/ray", "outcome");
    for (const CaseResult& result : results) print_arm(result);
    fmt::print("\n");
}

using Counts = std::array<std::size_t, 3>;  // of outcomes

std::string told(const Counts& counts) {
    return fmt::format("{} passed, {} failed as expected, {} failed", counts[0], counts[1], counts[2]);
}

// A case is a run of results.
void print_cases(const std::vector<CaseResult>& results) {
    fmt::print("{:8} {:>12}  {:18} {}\n", "case", "rays", "outcome", "arms");
    for (auto first = results.begin(); first != results.end();) {
        const auto end = std::find_if(first, results.end(), [&](const CaseResult& r) { return r.id != first->id; });
        Counts counts{};
        std::uint64_t rays = 0;
        for (auto r = first; r != end; ++r) {
            ++counts[static_cast<std::size_t>(r->outcome)];
            rays += r->rays;
        }
        fmt::print("{:8} {:>12}  {:18} {}; {}\n", escaped(first->id), rays,
            stability::outcome_names[static_cast<std::size_t>(counts[2] > 0 ? Outcome::fail : Outcome::pass)],
            told(counts), escaped(first->name));
        first = end;
    }
}

// A line a case; arms where one failed, or all where asked for.
void print_report(const StabilityReport& report, bool verbose) {
    std::vector<CaseResult> arms;
    std::ranges::copy_if(report.results, std::back_inserter(arms),
        [&](const CaseResult& r) { return verbose || r.outcome == Outcome::fail; });
    print_cases(report.results);
    fmt::print("\n");
    print_arms(arms);
    if (verbose)
        for (const stability::Skipped& s : report.skipped)
            fmt::print("left out: {} {} {}: {}\n", s.backend, s.precision, s.kernel, s.reason);
    Counts counts{};
    for (const CaseResult& r : report.results) ++counts[static_cast<std::size_t>(r.outcome)];
    fmt::print("Arms: {}{}\n", told(counts),
        report.not_run == 0 ? std::string() : fmt::format(", {} not run", report.not_run));
}

// Those of arithmetic. Half storage rounds what is carried between kernels, which given rays do not have.
constexpr auto judged_precisions = std::span(precision_names).first<4>();

// Every backend in every precision that it has, as far as the options let it.
std::vector<stability::Bench> make_benches(const StabilityArguments& arguments, const CommandContext& context) {
    std::vector<stability::Bench> benches;
    std::string reason = "no backend is left";
    for (const std::string& name : arguments.backends) static_cast<void>(find_backend(context.program.backends, name));
    for (const Backend& backend : context.program.backends)
        for (std::size_t i = 0; i < judged_precisions.size(); ++i) {
            if (arguments.backends.empty() && backend.name == backend_to_read) continue;
            if (!asked_for(backend.name, arguments.backends) || !asked_for(judged_precisions[i], arguments.precisions))
                continue;
            BackendOptions options;
            options.precision = static_cast<Precision>(i);
            if (backend.name == "vulkan") options.device = arguments.device;
            try {
                benches.push_back({backend.name, *options.precision, backend.create(options)});
            } catch (const UnsupportedError& error) {
                reason = error.what();
            } catch (const DeviceError& error) {
                if (!arguments.backends.empty()) throw;
                reason = error.what();
                fmt::print(stderr, "tandem: {} is left out: {}\n", backend.name, reason);
                break;
            }
        }
    if (benches.empty()) throw InputError("nothing to run: " + reason);
    return benches;
}

// The catalogue, and the scenes of the cases with what these read. Bad ones are refused before the first case runs.
std::vector<std::string> files_of(const std::vector<stability::HardCase>& cases, const std::string& catalogue) {
    std::set<std::string> scenes;
    for (const stability::HardCase& hard_case : cases) {
        scenes.insert(hard_case.scene_files.begin(), hard_case.scene_files.end());
        if (!hard_case.scene_file.empty()) scenes.insert(hard_case.scene_file);
    }
    std::vector<std::string> files{catalogue};
    for (const std::string& file : scenes) (void)load_scene(file, &files);
    return files;
}

ExitStatus conclude(const StabilityReport& report, const std::vector<stability::Bench>& benches,
    const std::optional<DeviceSelfTest>& test, const CommandContext& context, const CommandTime& time) {
    nlohmann::json written = to_json(report, benches);
    written["device_self_test"] = to_json(test);
    print_report(report, context.verbose);
    if (test) fmt::print("Self-test of {}: {}\n", test->device, in_short(test->result));
    write_json(context, written);
    const bool failed = report.failed();
    if (report.not_run == 0) return failed ? ExitStatus::disagree : ExitStatus::fine;
    const ExitStatus status = time.too_short(
        fmt::format("{} of {} arms were not run", report.not_run, report.not_run + report.results.size()));
    return failed ? ExitStatus::disagree : status;
}

ExitStatus stability_command(
    const StabilityArguments& arguments, const CommandContext& context, const CommandTime& time) {
    const std::string catalogue = shipped_file(arguments.catalogue);
    std::vector<stability::HardCase> cases = stability::load_catalogue(catalogue);
    std::vector<std::string> known;
    for (const stability::HardCase& hard_case : cases) known.push_back(hard_case.id);
    for (const std::string& id : arguments.cases)
        if (std::ranges::find(known, id) == known.end())
            throw InputError(fmt::format("--case: there is no case '{}' in {}; {}its README.md lists them", id,
                catalogue, did_you_mean(id, known)));
    if (!arguments.cases.empty())
        std::erase_if(
            cases, [&](const auto& c) { return std::ranges::find(arguments.cases, c.id) == arguments.cases.end(); });
    check_outputs(context, {}, files_of(cases, catalogue));
    const std::vector<stability::Bench> benches = [&] {
        const NothingToKeep starting(context.interrupts);
        return make_benches(arguments, context);
    }();
    stability::StabilityOptions options = arguments.options;
    options.seconds = time.left();
    options.stop = time.token();
    const std::optional<DeviceSelfTest> test = test_device(benches);
    std::mutex mutex;
    StabilityReport so_far;
    options.keep = [&](const StabilityReport& report) {
        const std::lock_guard lock(mutex);
        so_far = report;
    };
    const auto last_resort = time.at_any_rate([&] {
        const std::lock_guard lock(mutex);
        return conclude(so_far, benches, test, context, time);
    });
    StabilityReport report;
    {
        ProgressLine line;
        options.progress = [&](double fraction, const std::string& now) { line.update(fraction, now); };
        report = run_cases(cases, benches, options);
    }
    last_resort->done();
    if (report.results.empty() && report.not_run == 0)
        throw InputError("--arm: no case has such an arm" +
                         (report.skipped.empty() ? std::string() : ": " + report.skipped.front().reason));
    return conclude(report, benches, test, context, time);
}

std::vector<std::string> arm_names() {
    std::vector<std::string> names{"default"};
    names.insert(names.end(), triangle_kernel_names.begin(), triangle_kernel_names.end());
    names.insert(names.end(), convex_kernel_names.begin(), convex_kernel_names.end());
    names.insert(names.end(), guard_names.begin(), guard_names.end());
    return names;
}

}  // namespace

void add_stability_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand(
        "stability", "Run the numerically hard cases on every backend, precision, intersection test and guard");
    const auto arguments = std::make_shared<StabilityArguments>();
    command->add_option("--case", arguments->cases, "Cases by id (default: all)")->delimiter(',')->type_name("ID");
    command->add_option("--backend", arguments->backends, "cpu, vulkan or oracle (default: all)")->delimiter(',');
    command->add_option("--precision", arguments->precisions, "single, double, contracted or mixed (default: all)")
        ->delimiter(',')
        ->check(one_of_names(judged_precisions));
    command
        ->add_option("--arm", arguments->options.kernel,
            "One arm alone: a triangle test, a convex test, a guard, or default (the arm of image cases)")
        ->check(one_of(arm_names()));
    command->add_option("--device", arguments->device, device_help);
    command
        ->add_option("--time", arguments->options.seconds,
            "Seconds for everything. Slow arms trace fewer rays. What gets no time is listed")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str();
    command->add_option("--catalogue", arguments->catalogue, "File of the cases")
        ->capture_default_str()
        ->type_name("FILE");
    add_common_options(*command, context,
        "  tandem stability\n"
        "  tandem stability --case 2,8-1e6 --backend cpu --json hard.json\n"
        "  tandem stability --arm moller-trumbore --time 20\n"
        "Printed is a line a case, and each arm that fails; -v prints all arms. "
        "Exit status: 0; 1 where a case fails, or passes although a failure is expected; 3 where arms were not run.");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] {
            const CommandTime time(context, arguments->options.seconds);
            return time.work([&] { return stability_command(*arguments, context, time); });
        };
    });
}

}  // namespace tandem
