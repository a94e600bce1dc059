#include "common/experiment/campaign.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "common/error.h"
#include "common/experiment/analysis.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

// An arm that passed the gate before, and is made only to be timed.
class KnownRun : public ArmRun {
public:
    explicit KnownRun(std::unique_ptr<ArmRun> run) : run_(std::move(run)) {}
    [[nodiscard]] ClockReadings run() override { return run_->run(); }

private:
    std::unique_ptr<ArmRun> run_;
};

Family without_gate(Family family) {
    family.arms = [arms = family.arms](const Workload& workload) {
        std::vector<Arm> all = arms(workload);
        for (Arm& arm : all) arm.make = [make = arm.make] { return std::make_unique<KnownRun>(make()); };
        return all;
    };
    return family;
}

struct Experiment {
    const Family* family;
    const Workload* workload;

    [[nodiscard]] bool made(const ExperimentSamples& samples) const {
        return samples.family == family->name && samples.workload.name == workload->name;
    }
};

// Whether all arms of the experiment are known well enough, over all its replicates.
bool is_known(const BenchResults& results, const Experiment& experiment, const CampaignOptions& options) {
    std::vector<ExperimentSamples> own;
    for (const ExperimentSamples& samples : results.samples)
        if (experiment.made(samples)) own.push_back(samples);
    if (!own.empty() && own.front().ended == "not applicable") return true;
    for (const Arm& arm : experiment.family->arms(*experiment.workload)) {
        const auto has_it = [&](const ExperimentSamples& samples) {
            return std::ranges::find(samples.arms, arm.name, &ArmSamples::arm) != samples.arms.end();
        };
        if (asked_for(arm.name, options.only) &&
            std::ranges::count_if(own, has_it) < static_cast<std::ptrdiff_t>(fewest_resampled_processes))
            return false;
    }
    return std::ranges::all_of(analyse(own), [&](const ArmResult& arm) {
        return !arm.timed() || arm.arm == arm.baseline ||
               (arm.ratio_high() <= arm.ratio() * (1.0 + options.narrow) &&
                   arm.ratio_low() >= arm.ratio() * (1.0 - options.narrow));
    });
}

std::vector<Experiment> unknown_experiments(
    const BenchResults& results, const std::vector<Family>& families, const CampaignOptions& options) {
    std::vector<Experiment> unknown;
    std::size_t most = 0;
    for (const Family& family : families) most = std::max(most, family.workloads.size());
    for (std::size_t i = 0; i < most; ++i)
        for (const Family& family : families)
            if (i < family.workloads.size())
                if (const Experiment one{&family, &family.workloads[i]}; !is_known(results, one, options))
                    unknown.push_back(one);
    return unknown;
}

// What one more replicate of the experiment takes at least, as the last one did; 0 where there was none.
struct LeastSeconds {
    double preparation = 0.0, blocks = 0.0;
    [[nodiscard]] double all() const { return preparation + blocks; }
};

LeastSeconds least_seconds(const BenchResults& results, const Experiment& experiment) {
    const auto last = std::ranges::find_if(results.samples.rbegin(), results.samples.rend(),
        [&](const ExperimentSamples& samples) { return experiment.made(samples); });
    if (last == results.samples.rend()) return {};
    std::size_t blocks = 1;
    for (const ArmSamples& arm : last->arms)
        for (const auto& [clock, readings] : arm.seconds) blocks = std::max(blocks, readings.size());
    const double fewest = static_cast<double>(RunnerOptions{}.fewest_blocks) / static_cast<double>(blocks);
    return {last->made_seconds, last->seconds * std::min(1.0, fewest)};
}

}  // namespace

unsigned run_campaign(const std::vector<Family>& families, const CampaignOptions& options, BenchResults& results) {
    const auto now = options.now ? options.now : std::function<double()>(steady_seconds);
    const double start = now(), end = start + options.seconds;
    std::uint64_t done = results.samples.size();
    for (unsigned replicate = 0; replicate < options.replicates; ++replicate) {
        const std::vector<Experiment> round = unknown_experiments(results, families, options);
        double whole_round = 0.0;  // seconds that go to no block
        for (const Experiment& one : round) whole_round += least_seconds(results, one).preparation;
        double left_to_make = whole_round * (options.replicates - replicate);
        for (std::size_t i = 0; i < round.size(); ++i) {
            const auto& [family, workload] = round[i];
            if (options.stop.stop_requested()) return replicate;
            const LeastSeconds least = least_seconds(results, round[i]);
            if (replicate > 0 && now() + least.all() > end) return replicate;
            const double rounds = options.replicates - replicate;
            RunnerOptions runner;
            runner.seconds = std::max(0.0, end - now() - left_to_make) /
                             (static_cast<double>(round.size()) * rounds - static_cast<double>(i));
            runner.narrow = options.narrow;
            runner.seed = options.seed + 1000 * ++done;
            runner.only = options.only;
            runner.stop = options.stop;
            runner.now = options.now;
            runner.progress = [&](double) {
                if (options.progress)
                    options.progress((now() - start) / options.seconds, family->name + " at " + workload->name);
            };
            ExperimentSamples samples =
                run_experiment(replicate == 0 ? *family : without_gate(*family), *workload, runner);
            if (samples.arms.front().seconds.empty() && samples.ended == "stopped")
                return replicate;  // before any block
            results.samples.push_back(std::move(samples));
            left_to_make -= least.preparation;
            if (options.keep) options.keep(results);
        }
    }
    return options.replicates;
}

ArmCount count_arms(
    const std::vector<Family>& families, const std::vector<std::string>& only, const BenchResults& results) {
    ArmCount count;
    for (const Family& family : families)
        for (const Workload& workload : family.workloads) {
            const std::vector<Arm> arms = family.arms(workload);
            for (std::size_t i = 0; i < arms.size(); ++i) {
                if (i > 0 && !asked_for(arms[i].name, only)) continue;
                ++count.all;
                const auto tells = [&](const ExperimentSamples& samples) {
                    return Experiment{&family, &workload}.made(samples) &&
                           std::ranges::find(samples.arms, arms[i].name, &ArmSamples::arm) != samples.arms.end();
                };
                if (std::ranges::none_of(results.samples, tells)) ++count.missing;
            }
        }
    return count;
}

void merge(BenchResults& results, BenchResults other, const std::string& whose) {
    for (const char* fact : {"name", "driver_name", "driver_version", "device_uuid", "spirv_hash", "arm_library_hash"})
        if (results.device.value(fact, "") != other.device.value(fact, ""))
            throw input_error(whose, std::string("/device/") + fact, "is not what this device has",
                "resume on the same device, driver and build");
    if (results.scene != other.scene)
        throw input_error(whose, "/scene", "is another scene", "resume with the same one");
    for (nlohmann::json& family : other.families) {
        const auto same = [&](const nlohmann::json& known) { return known.at("name") == family.at("name"); };
        if (std::ranges::none_of(results.families, same)) results.families.push_back(std::move(family));
    }
    std::ranges::move(other.samples, std::back_inserter(results.samples));
}

std::vector<CampaignPart> parts_of(const CampaignOptions& options, unsigned processes) {
    const unsigned count = std::min(processes, options.replicates);
    std::vector<CampaignPart> parts;
    for (unsigned i = 0; i < count; ++i)
        parts.push_back({options.seconds / count, options.replicates / count + (i < options.replicates % count ? 1 : 0),
            options.seed + 1'000'000ull * (i + 1)});
    return parts;
}

}  // namespace tandem
