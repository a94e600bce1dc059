#include "common/stability/stability.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/error.h"
#include "common/stability/image_judge.h"
#include "common/stability/metamorphic.h"
#include "common/stability/ray_judge.h"
#include "common/stopwatch.h"

namespace tandem::stability {

namespace {

// The other arms shoot one ray for so many of the defaults.
constexpr std::uint64_t default_share = 16;
// The part of the time left that each of the CPU's defaults may take: they shoot their rays in full, in seconds.
constexpr double share_in_full = 0.1;

struct Arm {
    const Bench* bench;
    IntersectionSettings intersection;
    std::string kernel;
    bool is_default;
};

template <class Enumeration, std::size_t count>
void add_arms(std::vector<Arm>& arms, const Bench& bench, Enumeration IntersectionSettings::*choice,
    const std::array<std::string_view, count>& names) {
    for (std::size_t i = 0; i < count; ++i) {
        Arm arm{&bench, {}, std::string(names[i]), i == 0};
        arm.intersection.*choice = static_cast<Enumeration>(i);
        arms.push_back(arm);
    }
}

std::vector<Arm> arms_of(Subject subject, const std::vector<Bench>& benches, const std::string& kernel) {
    std::vector<Arm> arms;
    for (const Bench& bench : benches) {
        if (subject == Subject::triangles)
            add_arms(arms, bench, &IntersectionSettings::triangles, triangle_kernel_names);
        if (subject == Subject::convex) add_arms(arms, bench, &IntersectionSettings::convex, convex_kernel_names);
        if (subject == Subject::guards) add_arms(arms, bench, &IntersectionSettings::guard, guard_names);
        if (subject == Subject::images || subject == Subject::changes) arms.push_back({&bench, {}, "default", true});
    }
    if (!kernel.empty()) std::erase_if(arms, [&](const Arm& arm) { return arm.kernel != kernel; });
    return arms;
}

bool matches(const ArmPattern& pattern, const CaseResult& result) {
    const auto fits = [](const std::string& wanted, const std::string& is) { return wanted.empty() || wanted == is; };
    return fits(pattern.backend, result.backend) && fits(pattern.precision, result.precision) &&
           fits(pattern.kernel, result.kernel);
}

void decide(const HardCase& hard_case, CaseResult& result) {
    if (result.rays == 0) {  // proves nothing, whatever was expected
        result.outcome = Outcome::fail;
        result.remark = "nothing was measured";
        return;
    }
    const bool failed =
        result.misses > 0 || result.false_hits > 0 || result.self_hits > 0 || !(result.worst_ulp <= result.bound);
    const auto pattern = std::ranges::find_if(
        hard_case.expected_failures, [&](const ArmPattern& candidate) { return matches(candidate, result); });
    const bool expected = pattern != hard_case.expected_failures.end();
    // Fewer rays than planned may all pass where one in many fails.
    const bool surprise = failed ? !expected : expected && !pattern->seldom && !result.cut;
    result.outcome = surprise ? Outcome::fail : failed ? Outcome::expected_failure : Outcome::pass;
    if (surprise && !failed)
        result.remark = "was expected to fail and did not: look why, and mend the catalogue";
    else if (failed && !expected)
        result.remark = !(result.worst_ulp <= result.bound) ? "beyond its bound" : "against what the case promises";
}

class Runner {
public:
    Runner(const std::vector<HardCase>& cases, const std::vector<Bench>& benches, const StabilityOptions& options)
        : cases_(cases), benches_(benches), options_(options) {}

    StabilityReport run() {
        for (const HardCase& hard_case : cases_) pairs_ += arms_of(hard_case.subject, benches_, options_.kernel).size();
        report_.not_run = pairs_;
        for (const bool defaults : {true, false})
            for (std::size_t i = 0; i < cases_.size(); ++i) run_case(i, defaults);
        return std::move(report_);
    }

private:
    [[nodiscard]] double time_left() const { return std::max(0.0, options_.seconds - watch_.seconds()); }
    // An equal share of it.
    [[nodiscard]] double share_of_time() const { return time_left() / static_cast<double>(pairs_ - done_); }

    void run_case(std::size_t index, bool defaults) {
        const HardCase& hard_case = cases_[index];
        std::vector<Arm> arms = arms_of(hard_case.subject, benches_, options_.kernel);
        std::erase_if(arms, [&](const Arm& arm) { return arm.is_default != defaults; });
        if (arms.empty() || options_.stop.stop_requested()) return;
        std::vector<RayWork> work;
        if (hard_case.subject != Subject::images && hard_case.subject != Subject::changes)
            work = make_ray_work(hard_case);
        for (const Arm& arm : arms) {
            if (options_.stop.stop_requested()) return;
            if (auto result = run_arm(hard_case, work, arm)) add(index, std::move(*result));
            ++done_;
            if (options_.keep) options_.keep(report_);
        }
    }

    // Behind what there is of its case.
    void add(std::size_t index, CaseResult result) {
        const auto place = std::ranges::upper_bound(case_of_, index);
        report_.results.insert(report_.results.begin() + (place - case_of_.begin()), std::move(result));
        case_of_.insert(place, index);
    }

    // Nothing where the arm is not to be had, or a stop cut it short.

    std::optional<CaseResult> run_arm(const HardCase& hard_case, const std::vector<RayWork>& work, const Arm& arm) {
        CaseResult result;
        result.id = hard_case.id;
        result.name = hard_case.name;
        result.backend = arm.bench->backend;
        result.precision = name_of(arm.bench->precision, precision_names);
        result.kernel = arm.kernel;
        result.bound_text = hard_case.bound_text;
        result.bound = arm.bench->precision == Precision::double_precision ? hard_case.bound_double
                       : arm.bench->backend == "vulkan"                    ? hard_case.bound_vulkan
                                                                           : hard_case.bound;
        result.aimed = hard_case.counts_as_aimed;
        if (options_.progress)
            options_.progress(static_cast<double>(done_) / static_cast<double>(pairs_),
                hard_case.id + " on " + result.backend + " " + result.precision + " " + result.kernel);
        try {
            if (hard_case.subject == Subject::images) {
                judge_image(
                    hard_case, *arm.bench->renderer, arm.bench->precision, share_of_time(), options_.stop, result);
            } else if (hard_case.subject == Subject::changes) {
                judge_change(
                    hard_case, *arm.bench->renderer, arm.bench->precision, share_of_time(), options_.stop, result);
            } else {
                const bool in_full = arm.is_default && arm.bench->backend == "cpu" &&
                                     arm.bench->precision == Precision::single_precision;
                const std::uint64_t rays =
                    in_full ? hard_case.rays : std::max<std::uint64_t>(1, hard_case.rays / default_share);
                RenderSettings settings;
                settings.intersection = arm.intersection;
                const RayTally tally = shoot(work, *arm.bench->renderer, settings, arm.bench->precision, hard_case.seed,
                    rays, in_full ? std::max(share_in_full * time_left(), share_of_time()) : share_of_time(),
                    options_.stop);
                result.cut = tally.cut;
                result.rays = tally.rays;
                result.misses = tally.misses;
                result.false_hits = tally.false_hits;
                result.self_hits = tally.self_hits;
                result.worst_ulp = tally.worst_ulp;
                result.nanoseconds_per_ray =
                    tally.rays > 0 ? 1e9 * tally.seconds / static_cast<double>(tally.rays) : 0.0;
            }
        } catch (const UnsupportedError& error) {
            const auto same = [&](const Skipped& skipped) {
                return skipped.backend == result.backend && skipped.precision == result.precision &&
                       skipped.kernel == result.kernel;
            };
            if (std::ranges::none_of(report_.skipped, same))
                report_.skipped.push_back({result.backend, result.precision, result.kernel, error.what()});
            --report_.not_run;
            return std::nullopt;
        }
        if (options_.stop.stop_requested()) return std::nullopt;
        --report_.not_run;
        decide(hard_case, result);
        return result;
    }

    const std::vector<HardCase>& cases_;
    const std::vector<Bench>& benches_;
    const StabilityOptions& options_;
    const Stopwatch watch_;
    std::size_t pairs_ = 0, done_ = 0;
    StabilityReport report_;
    std::vector<std::size_t> case_of_;  // of each result
};

}  // namespace

bool StabilityReport::failed() const {
    return std::ranges::any_of(results, [](const CaseResult& r) { return r.outcome == Outcome::fail; });
}

StabilityReport run_cases(
    const std::vector<HardCase>& cases, const std::vector<Bench>& benches, const StabilityOptions& options) {
    return Runner(cases, benches, options).run();
}

}  // namespace tandem::stability
