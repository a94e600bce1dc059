// How often equal renderers are called different: verdicts with ever new seeds, counted. A line of JSON is printed for
// each experiment as it is done. Run by scripts/measure/calibrate, which turns them into
// tests/records/calibration/CALIBRATION.md.
//
//     calibrate list
//     calibrate run [ID...] [--runs N] [--first K] [--time SECONDS] [--threads T] [--scenes FOLDER]
//
// Without an ID all experiments are run, N verdicts each (1000), numbered from K (0). After `--time` seconds of one no
// further verdict of it is begun. FOLDER is that of the shipped scenes.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/error.h"
#include "common/processors.h"
#include "common/validation/verify/verify.h"
#include "tests/calibration/experiments.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

struct Choice {
    std::vector<std::string> ids;
    unsigned runs = 1000, first = 0, threads = usable_processors();
    double seconds = 1e9;
    std::filesystem::path scenes = TANDEM_SOURCE_DIR "/scenes";
};

// Verdicts, and for each level by itself how often the p of the last look came out at or below the declared rate.
struct Counts {
    unsigned runs = 0, alarms = 0;
    std::map<std::string, std::pair<unsigned, unsigned>> levels;  // name -> (runs, alarms)
    std::string reference_device, candidate_device;
    double identical = 0.0;  // sum of PairedResult::identical_fraction

    void add(const SceneVerdict& verdict, double declared) {
        ++runs;
        if (verdict.verdict == Verdict::disagree) ++alarms;
        for (const LevelResult& level : verdict.judgement.levels) {
            auto& [level_runs, level_alarms] = levels[level.name];
            ++level_runs;
            if (level.p <= declared) ++level_alarms;
        }
        identical += verdict.paired.identical_fraction;
        reference_device = verdict.reference_info.device;
        candidate_device = verdict.candidate_info.device;
    }
};

RenderSettings settings_of(const Experiment& experiment, const Scene& scene) {
    RenderSettings settings = verification_settings(scene, experiment.size);
    if (experiment.scene.empty()) settings.width = settings.height = experiment.size;
    return settings;
}

SceneVerdict verdict_of(const Experiment& experiment, const Scene& scene, Renderer& reference, Renderer& candidate,
    Renderer* other_precision, std::uint64_t run) {
    VerifyOptions options;
    options.settings = settings_of(experiment, scene);
    options.max_samples = experiment.samples;
    options.max_looks = experiment.looks;
    options.budget_seconds = 1e6;  // the looks depend on max_samples alone
    options.seed = 2 * run + 1;
    options.paired = experiment.paired;
    options.criteria.false_alarm = experiment.declared;
    options.criteria.margins.image = 1e-9;  // agreement is out of reach: every look is taken
    if (experiment.beyond) {
        options.criteria.margins.image = options.criteria.margins.tile = 1e9;
        options.criteria.paired_resolution = {0.0, 0.0};
    }
    options.other_precision = other_precision;
    return verify_scene(scene, reference, candidate, options);
}

json run(const Experiment& experiment, const Choice& choice) {
    const auto start = std::chrono::steady_clock::now();
    const auto elapsed = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const Scene scene = experiment.load(choice.scenes);
    Counts counts;
    std::mutex mutex;
    std::exception_ptr failure;
    std::atomic<unsigned> next = 0;
    const auto work = [&] {
        try {
            const auto reference = experiment.reference(), candidate = experiment.candidate();
            const auto other = experiment.other_precision ? experiment.other_precision() : nullptr;
            while (elapsed() < choice.seconds) {
                const unsigned k = next++;
                if (k >= choice.runs) return;
                const SceneVerdict verdict =
                    verdict_of(experiment, scene, *reference, *candidate, other.get(), std::uint64_t{choice.first} + k);
                const std::scoped_lock lock(mutex);
                counts.add(verdict, experiment.declared);
            }
        } catch (...) {
            const std::scoped_lock lock(mutex);
            failure = std::current_exception();
            next = choice.runs;
        }
    };
    {
        std::vector<std::jthread> workers;
        for (unsigned i = 0; i < choice.threads; ++i) workers.emplace_back(work);
    }
    if (failure) std::rethrow_exception(failure);
    const RenderSettings settings = settings_of(experiment, scene);
    json line{{"id", experiment.id}, {"name", experiment.name}, {"pair", name_of(experiment.pair)},
        {"looks", experiment.looks}, {"samples", experiment.samples}, {"width", settings.width},
        {"height", settings.height}, {"paired", experiment.paired}, {"declared", experiment.declared},
        {"first", choice.first}, {"runs", counts.runs}, {"alarms", counts.alarms}, {"seconds", elapsed()},
        {"reference_device", counts.reference_device}, {"candidate_device", counts.candidate_device},
        {"levels", json::object()}};
    if (experiment.paired && counts.runs > 0) line["identical_fraction"] = counts.identical / counts.runs;
    for (const auto& [name, count] : counts.levels)
        line["levels"][name] = {{"runs", count.first}, {"alarms", count.second}};
    return line;
}

// Throws std::exception on what is no number or no option.
Choice choice_of(const std::vector<std::string>& arguments) {
    Choice choice;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        if (!argument.starts_with("--")) {
            choice.ids.push_back(argument);
            continue;
        }
        if (i + 1 == arguments.size()) throw InputError(argument + " wants a value");
        const std::string& value = arguments[++i];
        const auto number = [&](double least) {
            std::size_t used = 0;
            double result = -1.0;
            try {
                result = std::stod(value, &used);
            } catch (const std::exception&) {
                used = 0;
            }
            if (used != value.size() || !(result >= least) || result > 1e9)
                throw InputError(fmt::format("{} wants a number from {} to 1e9, not '{}'", argument, least, value));
            return result;
        };
        if (argument == "--runs")
            choice.runs = static_cast<unsigned>(number(1));
        else if (argument == "--first")
            choice.first = static_cast<unsigned>(number(0));
        else if (argument == "--threads")
            choice.threads = static_cast<unsigned>(number(1));
        else if (argument == "--time")
            choice.seconds = number(0);
        else if (argument == "--scenes")
            choice.scenes = value;
        else
            throw InputError("there is no option " + argument);
    }
    return choice;
}

std::vector<Experiment> chosen(const std::vector<std::string>& ids) {
    std::vector<Experiment> all = experiments(), result;
    for (const std::string& id : ids) {
        const auto found = std::ranges::find(all, id, &Experiment::id);
        if (found == all.end()) throw InputError("there is no experiment '" + id + "'; see `calibrate list`");
        result.push_back(*found);
    }
    return ids.empty() ? all : result;
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    try {
        if (arguments == std::vector<std::string>{"list"}) {
            for (const Experiment& experiment : experiments()) fmt::print("{}\n", experiment.id);
            return 0;
        }
        if (arguments.empty() || arguments.front() != "run") {
            fmt::print(stderr,
                "usage: calibrate list | run [ID...] [--runs N] [--first K] [--time SECONDS] [--threads T] "
                "[--scenes FOLDER]\n");
            return 2;
        }
        const Choice choice = choice_of({arguments.begin() + 1, arguments.end()});
        for (const Experiment& experiment : chosen(choice.ids)) {
            fmt::print("{}\n", run(experiment, choice).dump());
            std::fflush(stdout);
        }
        return 0;
    } catch (const InputError& error) {
        fmt::print(stderr, "calibrate: {}\n", error.what());
        return 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "calibrate: {}\n", error.what());
        return 1;
    }
}
