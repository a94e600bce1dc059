#include "common/experiment/runner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "common/error.h"
#include "common/render/random.h"
#include "common/statistics/paired_effect.h"
#include "common/stopwatch.h"
#include "common/text.h"
#include "common/validation/verdict/verdict.h"

namespace tandem {

namespace {

constexpr std::array<const char*, 6> identity_names{
    "nothing-to-compare", "identical", "agrees", "undecided", "differs", "not-applicable"};

// An arm while it runs.
struct Contender {
    std::unique_ptr<ArmRun> run;  // null: not timed
    ArmSamples samples;
};

void gate(const Arm& arm, const std::optional<ArmOutput>& baseline, Contender& contender) {
    const std::optional<ArmOutput> output = contender.run->output();
    ArmSamples& samples = contender.samples;
    if (!output || !baseline) {
        samples.identity = Identity::nothing_to_compare;
        return;
    }
    if (output->digest == baseline->digest) {
        samples.identity = Identity::identical;
        return;
    }
    samples.identity = Identity::differs;
    samples.reason = "its result is not the baseline's, bit for bit";
    if (!arm.same_bits && output->estimate && baseline->estimate) {
        const Judgement judgement = judge(sampled_image_of(*baseline->estimate), sampled_image_of(*output->estimate),
            nullptr, Criteria{}, LookShare{});
        samples.identity = judgement.verdict == Verdict::agree      ? Identity::agrees
                           : judgement.verdict == Verdict::disagree ? Identity::differs
                                                                    : Identity::undecided;
        samples.reason = sentence_of(judgement, Criteria{}, "the baseline", arm.name);
    }
    if (samples.identity == Identity::differs) contender.run.reset();
}

// A stop leaves out the arms that are not made yet.
std::vector<Contender> make_contenders(
    const Family& family, const Workload& workload, const std::vector<std::string>& only, const std::stop_token& stop) {
    std::vector<Contender> contenders;
    std::optional<ArmOutput> baseline;
    for (const Arm& arm : family.arms(workload)) {
        if (!contenders.empty() && (!asked_for(arm.name, only) || stop.stop_requested())) continue;
        Contender contender{nullptr, {arm.name, arm.text, Identity::nothing_to_compare, {}, {}}};
        try {
            contender.run = arm.make();
            if (contenders.empty()) baseline = contender.run->output();
            gate(arm, baseline, contender);
        } catch (const UnsupportedError& refusal) {
            if (contenders.empty() && family.everywhere) throw;
            contender.run.reset();
            contender.samples.identity = Identity::not_applicable;
            contender.samples.reason = refusal.what();
        }
        contenders.push_back(std::move(contender));
        if (!contenders.front().run) break;  // what refused the baseline refuses all
    }
    if (!contenders.empty() && !contenders.front().run) {
        const ArmSamples refused = contenders.front().samples;
        const std::vector<Arm> arms = family.arms(workload);
        for (std::size_t i = 1; i < arms.size(); ++i)
            if (asked_for(arms[i].name, only))
                contenders.push_back({nullptr, {arms[i].name, arms[i].text, refused.identity, refused.reason, {}}});
    }
    if (contenders.empty()) throw Error("the family " + family.name + " has no arms");
    return contenders;
}

// The mean of `runs` runs.
ClockReadings reading(ArmRun& run, std::uint64_t runs) {
    ClockReadings sum;
    for (std::uint64_t i = 0; i < runs; ++i)
        for (const auto& [clock, seconds] : run.run()) sum[clock] += seconds;
    for (auto& [clock, seconds] : sum) seconds /= static_cast<double>(runs);
    return sum;
}

// Orders of blocks: Fisher and Yates, from the counter-based generator.
void shuffle(std::vector<std::size_t>& order, std::uint64_t seed, std::uint64_t block) {
    for (std::size_t k = order.size(); k > 1; --k) {
        const std::uint32_t bits = random_block(seed, 1, block, static_cast<std::uint32_t>(k))[0];
        std::swap(order[k - 1], order[static_cast<std::size_t>(std::uint64_t{bits} * k >> 32)]);
    }
}

void run_block(std::vector<Contender>& contenders, ExperimentSamples& samples, std::uint64_t block) {
    std::vector<std::size_t> order(contenders.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    shuffle(order, samples.seed, block);
    for (const std::size_t i : order) {
        if (!contenders[i].run) continue;
        for (const auto& [clock, seconds] : reading(*contenders[i].run, samples.runs_a_reading))
            contenders[i].samples.seconds[clock].push_back(seconds);
    }
}

// A device that idled while arms were made runs at a lower clock. It takes up to so long to come back, and less after
// short pauses. Its readings scatter little meanwhile, so that no test of a few blocks can tell them for warm-up.
constexpr double longest_warm_up = 0.5, warm_up_a_second = 0.3;

// Runs all contenders in turn, untimed, until then.
void warm_up(const std::vector<Contender>& contenders, double end, const std::stop_token& stop,
    const std::function<double()>& now) {
    const auto runs = [](const Contender& contender) { return contender.run != nullptr; };
    if (std::ranges::none_of(contenders, runs)) return;
    while (now() < end && !stop.stop_requested())
        for (const Contender& contender : contenders)
            if (contender.run) (void)contender.run->run();
}

// How many blocks would make every ratio's interval narrow, as their scatter so far foretells.
double blocks_needed(const ExperimentSamples& samples, double narrow) {
    double most = 0.0;
    for (std::size_t arm = 1; arm < samples.arms.size(); ++arm) {
        const std::vector<double> ratios = log_ratios(samples, arm);
        if (ratios.empty()) continue;
        const MeanEstimate estimate = trimmed_mean_estimate(ratios);
        const double half_width = student_quantile(0.975, estimate.dof) * std::sqrt(estimate.variance) / narrow;
        most = std::max(most, half_width * half_width * static_cast<double>(ratios.size()));
    }
    return most;
}

// So that samples can be looked at while the contenders run on.
void publish(const std::vector<Contender>& contenders, ExperimentSamples& samples) {
    samples.arms.clear();
    for (const Contender& contender : contenders) samples.arms.push_back(contender.samples);
}

std::vector<double> compared(const ExperimentSamples& samples, std::size_t arm, double (*difference)(double, double)) {
    const auto find = [&](std::size_t i) -> const std::vector<double>* {
        const auto found = samples.arms[i].seconds.find(samples.clock);
        return found == samples.arms[i].seconds.end() ? nullptr : &found->second;
    };
    const std::vector<double>*baseline = find(0), *own = find(arm);
    std::vector<double> result;
    if (baseline == nullptr || own == nullptr) return result;
    const std::size_t blocks = std::min(baseline->size(), own->size());
    for (std::size_t i = std::min(warm_up_blocks(samples), blocks); i < blocks; ++i)
        result.push_back(difference((*own)[i], (*baseline)[i]));
    return result;
}

}  // namespace

const char* name_of(Identity identity) { return identity_names[static_cast<std::size_t>(identity)]; }

Identity identity_named(const std::string& name) {
    const auto found = std::ranges::find(identity_names, name);
    if (found == identity_names.end()) throw InputError("'" + name + "' is no outcome of the identity gate");
    return static_cast<Identity>(found - identity_names.begin());
}

// FNV-1a over the totals.
std::uint64_t digest_of(const Estimate& estimate) {
    std::uint64_t digest = 0xcbf29ce484222325u;
    const auto add = [&](const void* data, std::size_t bytes) {
        const auto* byte = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < bytes; ++i) digest = (digest ^ byte[i]) * 0x100000001b3u;
    };
    const std::array<std::uint64_t, 4> header{
        estimate.width(), estimate.height(), estimate.count(), estimate.invalid()};
    add(header.data(), sizeof header);
    const Estimate::Plane totals = estimate.totals();
    add(totals.data(), totals.size() * sizeof totals[0]);
    return digest;
}

ExperimentSamples run_experiment(const Family& family, const Workload& workload, const RunnerOptions& options) {
    const auto now = options.now ? options.now : std::function<double()>(steady_seconds);
    ExperimentSamples samples;
    samples.family = family.name;
    samples.clock = family.clock;
    samples.along = family.along;
    samples.workload = workload;
    samples.seed = options.seed;
    const double made_start = now();
    std::vector<Contender> contenders = make_contenders(family, workload, options.only, options.stop);
    const double made = now();
    // One run of each outside of the blocks: what happens once only is no part of any block.
    double shortest = std::numeric_limits<double>::infinity(), longest = 0.0;
    for (Contender& contender : contenders) {
        if (!contender.run || options.stop.stop_requested()) continue;
        (void)reading(*contender.run, 1);
        const double second = reading(*contender.run, 1).at("total");
        shortest = std::min(shortest, second);
        longest = std::max(longest, second);
    }
    samples.runs_a_reading =
        shortest >= options.least_reading || !(shortest > 0.0)
            ? 1
            : static_cast<std::uint64_t>(std::max(1.0,
                  std::min({1000.0, std::ceil(options.least_reading / shortest), options.longest_reading / longest})));
    warm_up(contenders, made + std::min({longest_warm_up, warm_up_a_second * (made - made_start), options.seconds}),
        options.stop, now);
    const double start = now();
    samples.made_seconds = start - made_start;
    std::size_t blocks = 0, next_look = options.least_blocks;
    for (; samples.ended.empty(); ++blocks) {
        if (options.stop.stop_requested()) {
            samples.ended = "stopped";
        } else if (!contenders.front().run) {
            samples.ended = "not applicable";
        } else if (blocks >= options.fewest_blocks && now() - start >= options.seconds) {
            samples.ended = "budget";
        } else if (blocks >= options.most_blocks) {
            samples.ended = "blocks";
        } else if (blocks >= next_look && now() - start >= options.least_seconds) {
            publish(contenders, samples);
            const double needed = blocks_needed(samples, options.narrow);
            if (needed <= static_cast<double>(blocks)) samples.ended = "narrow";
            // Looking often and stopping at the first narrow interval would prefer those that are narrow by chance,
            // which cover too seldom. As Stein 1945, plan once from the scatter seen, then look again.
            const double planned = std::min(1.1 * needed, static_cast<double>(options.most_blocks));
            next_look = std::max(blocks + options.least_blocks / 2, static_cast<std::size_t>(planned));
        }
        if (!samples.ended.empty()) break;
        run_block(contenders, samples, blocks);
        if (options.progress) options.progress(std::min(1.0, (now() - start) / options.seconds));
    }
    samples.seconds = now() - start;
    publish(contenders, samples);
    return samples;
}

std::vector<double> log_ratios(const ExperimentSamples& samples, std::size_t arm) {
    return compared(samples, arm, [](double own, double baseline) { return std::log(own / baseline); });
}

std::vector<double> differences(const ExperimentSamples& samples, std::size_t arm) {
    return compared(samples, arm, [](double own, double baseline) { return own - baseline; });
}

std::size_t warm_up_blocks(const ExperimentSamples& samples) {
    // A false alarm for each of many arms would add up: the level is shared among them.
    const double alpha = 0.01 / static_cast<double>(std::max<std::size_t>(1, samples.arms.size()));
    std::size_t most = 0;
    for (const ArmSamples& arm : samples.arms) {
        const auto found = arm.seconds.find(samples.clock);
        if (found != arm.seconds.end()) most = std::max(most, warm_up_length(found->second, std::max(alpha, 0.002)));
    }
    return most;
}

}  // namespace tandem
