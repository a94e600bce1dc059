// How often equal renderers are called different: A/A verdicts with ever new seeds, counted and printed as JSON. Run by
// scripts/calibrate, which turns it into common/validation/CALIBRATION.md.
//
//     calibrate [RUNS]        verdicts an experiment, default 1000
#include <fmt/format.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/scene_loader.h"
#include "common/statistics/distributions.h"
#include "common/validation/verify.h"
#include "cpu_ref/backend.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;
using nlohmann::json;

namespace {

using MakeRenderer = std::function<std::unique_ptr<Renderer>()>;

struct Experiment {
    std::string name;
    MakeRenderer reference, candidate;
    Scene scene;
    std::uint32_t size = 16;
    std::uint64_t samples = 512;  // at the last look
    std::size_t looks = 3;
    double declared = 0.05;
    bool paired = false;
};

// Every kind of pixel: noisy, heavy-tailed, rarely lit, constant and black.
Radiance mixed(std::uint32_t x, std::uint32_t y, SampleRandom& random) {
    const std::uint32_t kind = (x / 5 + y / 3) % 5;
    if (kind == 0) return {0.5, 0.25, 0.125};
    if (kind == 1) return {0.0, 0.0, 0.0};
    if (kind == 2) return random.uniform() < 0.02 ? Radiance{20.0, 10.0, 5.0} : Radiance{0.0, 0.0, 0.0};
    const double value = kind == 3 ? random.exponential() : 0.5 * random.pareto();
    return {value, 0.8 * value, 0.6 * value};
}

Radiance exponential(std::uint32_t, std::uint32_t, SampleRandom& random) {
    return {random.exponential(), random.exponential(), random.exponential()};
}

MakeRenderer synthetic(Sampler sampler, std::string name) {
    return [=] { return std::make_unique<SyntheticRenderer>(sampler, name); };
}

MakeRenderer cpu(Precision precision) {
    return [=] {
        BackendOptions options;
        options.precision = precision;
        options.threads = 1;
        return cpu_backend().create(options);
    };
}

std::vector<Experiment> experiments() {
    const std::string folder = TANDEM_SOURCE_DIR "/scenes/";
    const MakeRenderer single = cpu(Precision::single_precision), doubled = cpu(Precision::double_precision);
    const MakeRenderer all_kinds = synthetic(mixed, "cpu"), smooth = synthetic(exponential, "cpu");
    const Scene box = load_scene(folder + "cornell-classic.json"),
                sky = load_scene(folder + "closed-forms/even-sky.json"),
                light = load_scene(folder + "closed-forms/polygon-light.json");
    return {
        {"synthetic, exponential, one look", smooth, smooth, {}, 32, 128, 1},
        {"synthetic, exponential, three looks", smooth, smooth, {}, 32, 512, 3},
        {"synthetic, all kinds of pixels, one look", all_kinds, all_kinds, {}, 32, 128, 1},
        {"synthetic, all kinds of pixels, three looks", all_kinds, all_kinds, {}, 32, 512, 3},
        {"synthetic, all kinds of pixels, three looks, default level", all_kinds, all_kinds, {}, 32, 512, 3, 0.01},
        {"CPU, cornell-classic, one look", single, single, box, 12, 128, 1},
        {"CPU, cornell-classic, three looks", single, single, box, 12, 512, 3},
        {"CPU, cornell-classic, three looks, default level", single, single, box, 12, 512, 3, 0.01},
        {"CPU, even-sky with its closed form, three looks", single, single, sky, 8, 512, 3},
        {"CPU, polygon-light with its closed form, three looks", single, single, light, 8, 512, 3},
        {"CPU, float against double with paired seeds, cornell-classic, three looks", single, doubled, box, 12, 512, 3,
            0.05, true},
    };
}

struct Count {
    unsigned runs = 0, alarms = 0;
    [[nodiscard]] json to_json(double declared) const {
        const Interval exact = clopper_pearson_interval(alarms, runs, 0.05),
                       wilson = wilson_interval(alarms, runs, 0.05);
        return {{"runs", runs}, {"alarms", alarms}, {"declared", declared},
            {"clopper_pearson", {exact.low, exact.high}}, {"wilson", {wilson.low, wilson.high}}};
    }
};

struct Result {
    Count verdicts;
    std::map<std::string, Count> levels;  // p of the last look at or below the declared rate, each level by itself
};

SceneVerdict verdict_of(const Experiment& experiment, Renderer& reference, Renderer& candidate, std::uint64_t run) {
    VerifyOptions options;
    options.settings = verification_settings(experiment.scene, experiment.size);
    if (experiment.scene.primitives.empty()) options.settings->width = options.settings->height = experiment.size;
    options.max_samples = experiment.samples;
    options.max_looks = experiment.looks;
    options.budget_seconds = 1e6;  // the looks depend on max_samples alone
    options.seed = 2 * run + 1;
    options.paired = experiment.paired;
    options.criteria.false_alarm = experiment.declared;
    options.criteria.margins.image = 1e-9;  // agreement is out of reach: every look is taken
    return verify_scene(experiment.scene, reference, candidate, options);
}

Result run(const Experiment& experiment, unsigned runs) {
    Result result;
    std::mutex mutex;
    std::atomic<unsigned> next = 0;
    const auto work = [&] {
        const auto reference = experiment.reference(), candidate = experiment.candidate();
        for (unsigned k = next++; k < runs; k = next++) {
            const SceneVerdict verdict = verdict_of(experiment, *reference, *candidate, k);
            const std::scoped_lock lock(mutex);
            ++result.verdicts.runs;
            if (verdict.verdict == Verdict::disagree) ++result.verdicts.alarms;
            for (const LevelResult& level : verdict.judgement.levels) {
                Count& count = result.levels[level.name];
                ++count.runs;
                if (level.p <= experiment.declared) ++count.alarms;
            }
        }
    };
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) workers.emplace_back(work);
    workers.clear();
    return result;
}

}  // namespace

int main(int argc, char** argv) {
    const unsigned runs = argc > 1 ? static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10)) : 1000;
    if (runs == 0) {
        fmt::print(stderr, "calibrate: '{}' is no number of runs\n", argv[1]);
        return 2;
    }
    json report = json::array();
    for (const Experiment& experiment : experiments()) {
        fmt::print(stderr, "{}\n", experiment.name);
        const Result result = run(experiment, runs);
        json levels;
        for (const auto& [name, count] : result.levels) levels[name] = count.to_json(experiment.declared);
        const RenderSettings settings = verification_settings(experiment.scene, experiment.size);
        report.push_back({{"name", experiment.name}, {"looks", experiment.looks}, {"samples", experiment.samples},
            {"width", settings.width}, {"height", settings.height},
            {"verdicts", result.verdicts.to_json(experiment.declared)}, {"levels", levels}});
    }
    fmt::print("{}\n", report.dump(2));
    return 0;
}
