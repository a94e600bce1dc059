// The experiment runner on synthetic clocks of known effects. Intervals cover at their rate, equal arms show nothing,
// warm-up is found, and claims are judged by their rules.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/error.h"
#include "common/experiment/analysis.h"
#include "common/experiment/campaign.h"
#include "common/experiment/claims.h"
#include "common/experiment/results.h"

using namespace tandem;

namespace {

// A clock of its own: what arms take is added to it.
struct SyntheticClock {
    double now = 0.0;
    std::mt19937_64 random;
    double drift = 0.0;  // relative a second: a machine that gets slower while it is measured

    explicit SyntheticClock(std::uint64_t seed) : random(seed) {}

    // Log-normal jitter of 3 %, and one run in twenty half as long again: what schedulers do.
    double noisy(double seconds) {
        std::lognormal_distribution<double> jitter(0.0, 0.03);
        std::bernoulli_distribution straggler(0.05);
        const double taken = seconds * jitter(random) * (straggler(random) ? 1.5 : 1.0) * (1.0 + drift * now);
        now += taken;
        return taken;
    }
};

class SyntheticRun : public ArmRun {
public:
    SyntheticRun(SyntheticClock& clock, double seconds, double busy, std::optional<std::uint64_t> digest)
        : clock_(clock), seconds_(seconds), busy_(busy), digest_(digest) {}
    ClockReadings run() override {
        const double extra = busy_;
        clock_.now += extra;
        return {{"total", clock_.noisy(seconds_) + extra}};
    }
    std::optional<ArmOutput> output() override {
        return digest_ ? std::optional(ArmOutput{*digest_, nullptr}) : std::nullopt;
    }

private:
    SyntheticClock& clock_;
    double seconds_, busy_;
    std::optional<std::uint64_t> digest_;
};

// `busy` seconds of waiting are put into each arm after the baseline.
Family family_of(SyntheticClock& clock, const std::vector<double>& busy) {
    Family family;
    family.name = "synthetic";
    family.along = "size";
    family.workloads = {{"small", {{"size", 1.0}}}};
    family.arms = [&clock, busy](const Workload&) {
        std::vector<Arm> arms{
            {"baseline", "", [&clock] { return std::make_unique<SyntheticRun>(clock, 0.01, 0.0, 7); }}};
        for (std::size_t i = 0; i < busy.size(); ++i)
            arms.push_back({"arm-" + std::to_string(i), "",
                [&clock, wait = busy[i]] { return std::make_unique<SyntheticRun>(clock, 0.01, wait, 7); }});
        return arms;
    };
    return family;
}

RunnerOptions options_on(SyntheticClock& clock, std::uint64_t seed) {
    RunnerOptions options;
    options.seconds = 3.0;
    options.seed = seed;
    options.now = [&clock] { return clock.now; };
    return options;
}

std::vector<ArmResult> measured(SyntheticClock& clock, const std::vector<double>& busy, std::uint64_t seed) {
    const Family family = family_of(clock, busy);
    return analyse({run_experiment(family, family.workloads[0], options_on(clock, seed))});
}

// Experiments whose count of misses is itself random: bounds that a sound runner breaks once in 10^4 times, normal
// approximation to the binomial.
double most_misses(int experiments, double rate) {
    return rate * experiments + 3.7 * std::sqrt(rate * (1.0 - rate) * experiments);
}

ExperimentSamples samples_of(
    const std::string& workload, double size, const std::vector<double>& baseline, const std::vector<double>& arm) {
    ExperimentSamples samples;
    samples.family = "f";
    samples.clock = "total";
    samples.along = "size";
    samples.workload = {workload, {{"size", size}}};
    samples.arms = {{"a", "", Identity::identical, "", {{"total", baseline}}},
        {"b", "", Identity::identical, "", {{"total", arm}}}};
    return samples;
}

// Times around `centre` in a fixed zigzag, so that the interval is narrow but not empty.
std::vector<double> zigzag(double centre, double relative, std::size_t count = 20) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i)
        values.push_back(centre * (1.0 + relative * (static_cast<double>(i * 7 % 11) / 5.0 - 1.0)));
    return values;
}

}  // namespace

namespace {

// A run on a device that idles for a second while an arm is made, and takes three times as long until 0.4 s after.
class IdledRun : public ArmRun {
public:
    IdledRun(SyntheticClock& clock, std::shared_ptr<double> awake) : clock_(clock), awake_(std::move(awake)) {
        clock_.now += 1.0;
        *awake_ = clock_.now + 0.4;
    }
    ClockReadings run() override {
        const double taken = clock_.now < *awake_ ? 0.03 : 0.01;
        clock_.now += taken;
        return {{"total", taken}};
    }

private:
    SyntheticClock& clock_;
    std::shared_ptr<double> awake_;
};

}  // namespace

TEST_CASE("a device that idled while arms were made is at its full clock before the first block") {
    SyntheticClock clock(1);
    const auto awake = std::make_shared<double>(0.0);
    Family family = family_of(clock, {});
    family.arms = [&](const Workload&) {
        const auto make = [&] { return std::make_unique<IdledRun>(clock, awake); };
        return std::vector<Arm>{{"first", "", make}, {"second", "", make}};
    };
    const ExperimentSamples samples = run_experiment(family, family.workloads[0], options_on(clock, 1));
    for (const ArmSamples& arm : samples.arms) {
        REQUIRE(!arm.seconds.at("total").empty());
        CHECK(std::ranges::max(arm.seconds.at("total")) == doctest::Approx(0.01));
    }
    RunnerOptions hurried = options_on(clock, 1);
    hurried.seconds = 0.01;  // not more time for it than there is for the blocks
    CHECK(std::ranges::max(run_experiment(family, family.workloads[0], hurried).arms[0].seconds.at("total")) ==
          doctest::Approx(0.03));
}

TEST_CASE("a busy-wait of known length is reported with a covering interval, at the declared rate") {
    constexpr int experiments = 200;
    int misses = 0, ratio_misses = 0;
    for (int i = 0; i < experiments; ++i) {
        SyntheticClock clock(static_cast<std::uint64_t>(i));
        const ArmResult arm = measured(clock, {0.0005}, static_cast<std::uint64_t>(i) + 1000)[1];
        CHECK(arm.difference.low < arm.difference.high);
        misses += arm.difference.low > 0.0005 || arm.difference.high < 0.0005 ? 1 : 0;
        // The median of the baseline's noise is 0.01, and so the ratio 1.05 but for the noise's own scale.
        ratio_misses += arm.ratio_low() > 1.055 || arm.ratio_high() < 1.045 ? 1 : 0;
    }
    MESSAGE(misses << " of " << experiments << " intervals missed");
    CHECK(misses <= most_misses(experiments, 0.05));
    CHECK(ratio_misses <= most_misses(experiments, 0.05));
}

TEST_CASE(
    "equal arms show no effect, beyond the declared rate of false alarms a family" * doctest::test_suite("full")) {
    constexpr int experiments = 200;
    int families = 0, single = 0;
    for (int i = 0; i < experiments; ++i) {
        SyntheticClock clock(static_cast<std::uint64_t>(i) + 50000);
        bool any = false;
        for (const ArmResult& arm : measured(clock, {0.0, 0.0, 0.0}, static_cast<std::uint64_t>(i))) {
            if (arm.arm == "baseline") continue;
            any = any || arm.p_family <= 0.05;
            single += arm.log_ratio.low > 0.0 || arm.log_ratio.high < 0.0 ? 1 : 0;
        }
        families += any ? 1 : 0;
    }
    MESSAGE(families << " families and " << single << " of " << 3 * experiments << " arms gave a false alarm");
    CHECK(families <= most_misses(experiments, 0.05));
    CHECK(single <= most_misses(3 * experiments, 0.05));
}

TEST_CASE("the smallest detectable effect is detected four times in five" * doctest::test_suite("full")) {
    constexpr int experiments = 200;
    int found = 0;
    double smallest = 0.0;
    for (int i = 0; i < experiments; ++i) {
        SyntheticClock clock(static_cast<std::uint64_t>(i) + 900);
        smallest +=
            measured(clock, {0.0}, static_cast<std::uint64_t>(i))[1].smallest_detectable_relative() / experiments;
    }
    for (int i = 0; i < experiments; ++i) {
        SyntheticClock clock(static_cast<std::uint64_t>(i) + 7000);
        // Ten milliseconds times what the mean experiment says that it can see.
        found += measured(clock, {0.01 * smallest}, static_cast<std::uint64_t>(i))[1].log_ratio.low > 0.0 ? 1 : 0;
    }
    CAPTURE(smallest);
    CHECK(found >= 0.8 * experiments - 3.7 * std::sqrt(0.16 * experiments) - 0.05 * experiments);
    CHECK(found < experiments);
}

TEST_CASE("drift cancels within blocks") {
    SyntheticClock clock(3);
    clock.drift = 1.0;  // twice as slow after a second
    const ArmResult arm = measured(clock, {0.0}, 5)[1];
    CHECK(arm.ratio_low() < 1.0);
    CHECK(arm.ratio_high() > 1.0);
    CHECK(arm.ratio_high() - arm.ratio_low() < 0.1);
}

TEST_CASE("an experiment ends when it is sure enough, or when its time is up") {
    SyntheticClock clock(1);
    const Family family = family_of(clock, {0.001});
    RunnerOptions options = options_on(clock, 1);
    options.narrow = 0.05;
    const ExperimentSamples sure = run_experiment(family, family.workloads[0], options);
    CHECK(sure.ended == "narrow");
    CHECK(sure.seconds < options.seconds);
    options.narrow = 1e-6;
    options.seconds = 0.5;
    const ExperimentSamples hurried = run_experiment(family, family.workloads[0], options);
    CHECK(hurried.ended == "budget");
    CHECK(hurried.seconds < 0.6);
    options.seconds = 0.0;
    CHECK(run_experiment(family, family.workloads[0], options).arms[0].seconds.at("total").size() == 5);
}

TEST_CASE("an arm whose result differs is not timed, and one that cannot run says why") {
    SyntheticClock clock(1);
    Family family = family_of(clock, {0.0});
    const auto arms = family.arms;
    family.arms = [&](const Workload& workload) {
        std::vector<Arm> all = arms(workload);
        all.push_back({"wrong", "", [&] { return std::make_unique<SyntheticRun>(clock, 0.01, 0.0, 8); }});
        all.push_back({"absent", "", []() -> std::unique_ptr<ArmRun> { throw UnsupportedError("one queue only"); }});
        return all;
    };
    const auto results = analyse({run_experiment(family, family.workloads[0], options_on(clock, 1))});
    REQUIRE(results.size() == 4);
    CHECK(results[1].identity == Identity::identical);
    CHECK(results[1].timed());
    CHECK(results[2].identity == Identity::differs);
    CHECK(!results[2].timed());
    CHECK(results[3].identity == Identity::not_applicable);
    CHECK(results[3].reason == "one queue only");
    CHECK(!results[3].timed());
}

TEST_CASE("blocks run every arm once, in an order that the seed decides") {
    std::vector<int> order;
    Family family;
    family.workloads = {{"only", {}}};
    class Noted : public ArmRun {
    public:
        Noted(std::vector<int>& order_, int number) : order(order_), own(number) {}
        ClockReadings run() override {
            order.push_back(own);
            return {{"total", 0.01 + 0.001 * static_cast<double>(order.size() % 7)}};
        }
        std::vector<int>& order;
        int own;
    };
    family.arms = [&](const Workload&) {
        std::vector<Arm> arms;
        for (int i = 0; i < 4; ++i)
            arms.push_back({std::to_string(i), "", [&order, i] { return std::make_unique<Noted>(order, i); }});
        return arms;
    };
    RunnerOptions options;
    options.most_blocks = 24;
    options.seconds = 1e9;
    options.narrow = 1e-9;
    options.now = [] { return 0.0; };  // nothing takes time, so that there is no untimed run but the two of each
    const auto run = [&](std::uint64_t seed) {
        options.seed = seed;
        order.clear();
        (void)run_experiment(family, family.workloads[0], options);
        return std::vector<int>(order.begin() + 8, order.end());  // after two runs of each to settle
    };
    const std::vector<int> once = run(1);
    REQUIRE(once.size() == 96);
    std::vector<int> firsts(4);
    for (std::size_t block = 0; block < 24; ++block) {
        std::vector<int> sorted(once.begin() + static_cast<std::ptrdiff_t>(4 * block),
            once.begin() + static_cast<std::ptrdiff_t>(4 * block + 4));
        ++firsts[static_cast<std::size_t>(sorted[0])];
        std::ranges::sort(sorted);
        CHECK(sorted == std::vector<int>{0, 1, 2, 3});
    }
    // Each arm comes first at some time: 24 draws leave one of four out once in 250 seeds, and this seed is fixed.
    CHECK(std::ranges::min(firsts) > 0);
    CHECK(run(1) == once);
    CHECK(run(2) != once);
}

TEST_CASE("warm-up is found where there is some, and hardly ever where there is none") {
    std::mt19937_64 random(5);
    std::normal_distribution<double> noise(1.0, 0.02);
    int alarms = 0, found = 0;
    constexpr int series_count = 300;
    for (int i = 0; i < series_count; ++i) {
        std::vector<double> series(60);
        std::ranges::generate(series, [&] { return noise(random); });
        alarms += warm_up_length(series) > 0 ? 1 : 0;
        for (std::size_t k = 0; k < 9; ++k) series[k] *= 1.3;
        const std::size_t length = warm_up_length(series);
        // Ranks of a few slow blocks after the change may lengthen it a little.
        found += length >= 9 && length <= 16 ? 1 : 0;
    }
    CHECK(alarms <= most_misses(series_count, 0.02));
    CHECK(found >= 0.95 * series_count);
    CHECK(warm_up_length(std::vector<double>{}) == 0);
}

TEST_CASE("trimmed means forget stragglers and keep shifts") {
    CHECK(trimmed_mean({1.0, 2.0, 3.0, 4.0, 100.0}) == 3.0);
    CHECK(trimmed_mean({5.0}) == 5.0);
    // Yuen's example of Wilcox 2012, section 4.3.3 in kind: winsorised squares over h (h - 1).
    const MeanEstimate estimate = trimmed_mean_estimate(std::vector<double>{1.0, 2.0, 3.0, 4.0, 100.0});
    CHECK(estimate.dof == 2.0);
    // Winsorised: 2 2 3 4 4; squares 4; over 3 * 2.
    CHECK(estimate.variance == doctest::Approx(4.0 / 6.0));
}

TEST_CASE("several processes count as one level above their blocks") {
    // Processes that differ among each other far more than their blocks: only resampled processes tell.
    ProcessBlocks processes;
    for (int p = 0; p < 6; ++p) processes.push_back(zigzag(0.10 + 0.02 * (p % 3), 0.01));
    const PairedEffect all = paired_effect(processes);
    CHECK(all.processes == 6);
    CHECK(all.high - all.low > 0.01);
    processes.resize(2);
    const PairedEffect two = paired_effect(processes);
    CHECK(two.high - two.low < 0.01);  // of these two processes alone
}

TEST_CASE("arms whose every replicate has its own luck are still told apart at the declared rate" *
          doctest::test_suite("full")) {
    // Two replicates of the same arm differ by 2 %, and what one block shows lasts into the next ones: seen on an H200.
    constexpr int experiments = 300;
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    int misses = 0, single_misses = 0;
    for (int i = 0; i < experiments; ++i) {
        ProcessBlocks replicates(8);
        for (std::vector<double>& blocks : replicates) {
            const double luck = 0.02 * normal(random);
            double mood = 0.03 * normal(random);
            for (int block = 0; block < 20; ++block) {
                mood = 0.9 * mood + 0.013 * normal(random);
                blocks.push_back(0.05 + luck + mood + 0.01 * normal(random));
            }
        }
        const PairedEffect effect = paired_effect(replicates);
        misses += effect.low > 0.05 || effect.high < 0.05 ? 1 : 0;
        replicates.resize(1);
        const PairedEffect single = paired_effect(replicates);
        single_misses += single.low > 0.05 || single.high < 0.05 ? 1 : 0;
    }
    MESSAGE(misses << " of " << experiments << " intervals missed; " << single_misses << " from one replicate");
    CHECK(misses <= most_misses(experiments, 0.05));
    // One replicate cannot know: what the replicates are for.
    CHECK(single_misses > experiments / 3);
}

TEST_CASE("a crossover lies between the sizes at which either side was surely better") {
    const std::vector<ExperimentSamples> samples{samples_of("1", 1.0, zigzag(1.0, 0.01), zigzag(1.2, 0.01)),
        samples_of("4", 4.0, zigzag(4.0, 0.01), zigzag(4.0, 0.01)),
        samples_of("16", 16.0, zigzag(16.0, 0.01), zigzag(16.0 / 1.2, 0.01))};
    const auto list = crossovers(analyse(samples), "size", "f");
    REQUIRE(list.size() == 1);
    CHECK(list[0].exists);
    CHECK(list[0].faster_above);
    CHECK(list[0].below == 1.0);
    CHECK(list[0].above == 16.0);
    // log ratios + and - log 1.2: the middle of the logarithms.
    CHECK(list[0].at == doctest::Approx(4.0).epsilon(0.02));
    CHECK(!crossovers(analyse({samples[0], samples[1]}), "size", "f")[0].exists);
}

TEST_CASE("claims are confirmed, refuted, below resolution or not applicable by their rules") {
    const auto noisy = zigzag(1.0, 0.2);
    auto mirrored = noisy;
    std::ranges::reverse(mirrored);
    const std::vector<ExperimentSamples> samples{samples_of("fast", 1.0, zigzag(1.0, 0.001), zigzag(0.9, 0.002)),
        samples_of("same", 2.0, zigzag(1.0, 0.001), zigzag(1.0, 0.002)), samples_of("noisy", 3.0, noisy, mirrored)};
    const auto verdict = [&](const char* size, Predicted predicted) {
        Claim claim;
        claim.contrast = {.family = "f", .arm = "b", .workload = size};
        claim.predicted = predicted;
        return judge_claims({claim}, samples)[0].verdict;
    };
    CHECK(verdict("size=1", Predicted::less) == ClaimVerdict::confirmed);
    CHECK(verdict("size=1", Predicted::more) == ClaimVerdict::refuted);
    CHECK(verdict("size=1", Predicted::no_difference) == ClaimVerdict::refuted);
    CHECK(verdict("size=1", Predicted::no_more) == ClaimVerdict::confirmed);
    CHECK(verdict("size=2", Predicted::less) == ClaimVerdict::refuted);
    CHECK(verdict("size=2", Predicted::more) == ClaimVerdict::refuted);
    CHECK(verdict("size=2", Predicted::no_difference) == ClaimVerdict::confirmed);
    CHECK(verdict("size=2", Predicted::no_more) == ClaimVerdict::confirmed);
    for (const Predicted predicted : {Predicted::less, Predicted::more, Predicted::no_difference, Predicted::no_more})
        CHECK(verdict("largest", predicted) == ClaimVerdict::below_resolution);
    CHECK(verdict("size=9", Predicted::less) == ClaimVerdict::not_applicable);

    Claim growing;
    growing.contrast = {.family = "f", .arm = "b", .workload = "smallest"};
    growing.over = Contrast{.family = "f", .arm = "b", .workload = "size=2"};
    const ClaimResult result = judge_claims({growing}, samples)[0];
    CHECK(result.verdict == ClaimVerdict::confirmed);
    CHECK(result.effect == doctest::Approx(-0.1).epsilon(0.02));
    CHECK(result.low < -0.1);
    CHECK(result.high > -0.1);
}

namespace {

CampaignOptions campaign_on(SyntheticClock& clock, double seconds, unsigned replicates) {
    CampaignOptions options;
    options.seconds = seconds;
    options.replicates = replicates;
    options.narrow = 1e-9;
    options.now = [&clock] { return clock.now; };
    return options;
}

}  // namespace

TEST_CASE("where a family need not run everywhere, what refuses its baseline refuses all of it, at once and for good") {
    SyntheticClock clock(1);
    Family family = family_of(clock, {0.0});
    const std::size_t count = family.arms(family.workloads.front()).size();
    family.arms = [arms = family.arms](const Workload& workload) {
        std::vector<Arm> all = arms(workload);
        all.front().make = []() -> std::unique_ptr<ArmRun> { throw UnsupportedError("there is no display"); };
        return all;
    };
    CHECK_THROWS_AS(static_cast<void>(run_experiment(family, family.workloads.front(), {})), UnsupportedError);
    family.everywhere = false;
    BenchResults results;
    CHECK(run_campaign({family}, campaign_on(clock, 100.0, 8), results) == 8);
    REQUIRE(results.samples.size() == 1);
    REQUIRE(results.samples.front().arms.size() == count);
    for (const ArmSamples& arm : results.samples.front().arms) {
        CHECK(arm.identity == Identity::not_applicable);
        CHECK(arm.reason == "there is no display");
        CHECK(arm.seconds.empty());
    }
    results.device = nlohmann::json::object();
    results.families.push_back(texts_of(family));
    const std::string text = to_text(results, {});
    CHECK(text.find("not applicable: there is no display") != std::string::npos);
    CHECK(text.find("there is no display") == text.rfind("there is no display"));
    const BenchResults again = results_from_json(to_json(results, {}), "stored");
    CHECK(again.samples.front().arms.front().identity == Identity::not_applicable);
    CHECK(count_arms({family}, {}, results).missing == 0);
}

TEST_CASE("a campaign makes every arm anew in each round, with another seed") {
    SyntheticClock clock(1);
    BenchResults results;
    CHECK(run_campaign({family_of(clock, {0.0})}, campaign_on(clock, 100.0, 3), results) == 3);
    REQUIRE(results.samples.size() == 3);
    CHECK(results.samples[0].seed != results.samples[1].seed);
    CHECK(results.samples[0].arms[1].identity == Identity::identical);
    CHECK(results.samples[1].arms[1].identity == Identity::nothing_to_compare);  // the gate is passed once
}

TEST_CASE("a campaign leaves out what is known well enough, from five replicates on") {
    SyntheticClock clock(2);
    BenchResults results;
    CampaignOptions options = campaign_on(clock, 1000.0, 8);
    options.narrow = 0.9;
    CHECK(run_campaign({family_of(clock, {0.0})}, options, results) == 8);
    CHECK(results.samples.size() == fewest_resampled_processes);
}

TEST_CASE("a campaign without time makes one round") {
    SyntheticClock clock(3);
    BenchResults results;
    CHECK(run_campaign({family_of(clock, {0.0})}, campaign_on(clock, 1e-6, 8), results) == 1);
    CHECK(results.samples.size() == 1);
}

TEST_CASE("a campaign that is stopped tells which arms it has not measured, the first workloads being first") {
    SyntheticClock clock(4);
    Family family = family_of(clock, {0.0});
    family.workloads.push_back(family.workloads.front());
    family.workloads.back().name = "larger";
    Family other = family;
    other.name = "other";
    std::stop_source stop;
    CampaignOptions options = campaign_on(clock, 100.0, 3);
    options.stop = stop.get_token();
    options.keep = [&](const BenchResults&) { stop.request_stop(); };
    BenchResults results;
    CHECK(count_arms({family, other}, {}, results).missing == count_arms({family, other}, {}, results).all);
    CHECK(run_campaign({family, other}, options, results) == 0);
    CHECK(results.samples.size() == 1);
    const ArmCount count = count_arms({family, other}, {}, results);
    CHECK(count.all == 8);
    CHECK(count.missing == 6);
    options.stop = {};
    options.keep = {};
    options.replicates = 1;
    CHECK(run_campaign({family, other}, options, results) == 1);
    CHECK(count_arms({family, other}, {}, results).missing == 0);
    CHECK(results.samples[1].workload.name == results.samples[2].workload.name);
    CHECK(results.samples[1].family != results.samples[2].family);
}

TEST_CASE("processes share a campaign's time and replicates, and draw from seeds of their own") {
    CampaignOptions options;
    options.seconds = 90.0;
    options.replicates = 8;
    const std::vector<CampaignPart> parts = parts_of(options, 3);
    REQUIRE(parts.size() == 3);
    CHECK(parts[0].replicates == 3);
    CHECK(parts[1].replicates == 3);
    CHECK(parts[2].replicates == 2);
    CHECK(parts[0].seconds == doctest::Approx(30.0));
    CHECK(parts[0].seed != parts[1].seed);
    CHECK(parts_of(options, 20).size() == 8);  // none without a replicate
}

TEST_CASE("readings of another device or scene are not taken over") {
    BenchResults here, there;
    here.device = there.device = {{"name", "GPU"}, {"spirv_hash", "1"}};
    here.scene = there.scene = "a.json";
    there.samples.resize(2);
    BenchResults other_build = there, other_scene = there;
    other_build.device["spirv_hash"] = "2";
    other_scene.scene = "b.json";
    CHECK_THROWS_WITH_AS(merge(here, other_build, "f"), doctest::Contains("/device/spirv_hash"), InputError);
    CHECK_THROWS_WITH_AS(merge(here, other_scene, "f"), doctest::Contains("/scene"), InputError);
    merge(here, there, "f");
    CHECK(here.samples.size() == 2);
}
