// Runs the arms of `tandem cost` in rounds. In a round every arm of a stage renders one replicate, in random order. So
// drifts of the machine's speed change the times of all arms alike.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "common/cost/denoised_film.h"
#include "common/cost/knobs.h"
#include "common/cost/samples.h"
#include "common/render/adaptive_sampling.h"

namespace tandem {

struct CostArm {
    std::string knob, setting;  // "baseline", "" for the baseline
    std::string options;        // of `tandem render`
    ArmSettings settings;
    bool keeps_estimate = true;  // knobs.h
    // Time to build its hierarchy, the median of several: for the arms of hierarchy_knob, and the baseline beside them.
    std::optional<double> hierarchy_seconds = {};
    [[nodiscard]] std::string name() const { return setting.empty() ? knob : knob + " " + setting; }
    // By design and but for rounding: nothing cuts its paths off, either.
    [[nodiscard]] bool is_unbiased() const { return keeps_estimate && settings.render.bounces >= unlimited_bounces; }
};

struct SkippedArm {
    std::string knob, setting, reason;
    bool for_time = false;  // more of it would have measured the arm
};

using MakeRenderer = std::function<std::unique_ptr<Renderer>(const BackendOptions&)>;

struct CostControl {
    std::stop_token stop;
    std::function<void(double fraction, const std::string& text)> progress;
    std::function<void(const CostSamples&)> save;  // told after every round
    std::function<double()> now;                   // seconds; empty: the steady clock
};
[[nodiscard]] double now_by(const CostControl& control);

// Replicate r of an arm renders the samples from r * 2^replicate_shift on: random numbers of its own, whatever the
// generator.
inline constexpr unsigned replicate_shift = film_numbers_shift;
inline constexpr std::size_t fewest_replicates = 4, most_replicates = 12;
// What tells enough of an arm in a short stage: so many seconds or, of slow samples, so many a replicate.
inline constexpr double most_short_seconds = 4.0, least_short_samples = 8.0;
inline constexpr double shown_mean = 0.2;  // of images as FLIP sees them, linear
// Number of a stage's first replicate, so that no two stages share random numbers.
[[nodiscard]] constexpr std::uint64_t first_replicate_of(std::uint32_t stage) { return std::uint64_t{stage} << 10; }

// What the schedule asks for (schedule.h).
struct CostStage {
    struct Arm {
        std::string name;
        std::vector<std::uint64_t> samples;  // ascending
    };
    std::uint32_t stage = 0;
    std::vector<Arm> arms;
    std::size_t replicates = fewest_replicates;
    std::string purpose;  // for people
};

// The arms made ready, each on a renderer that it shares with those of equal options.
class CostExperiment {
public:
    // `threads` that denoise; 0: as many as the machine has.
    CostExperiment(const Scene& scene, MakeRenderer make, std::uint64_t seed, unsigned threads);
    ~CostExperiment();

    // Makes arms ready, as many at once as the first arm's renderer can. Returns how many; the others are SkippedArms:
    // what the backend refuses, and what is not begun before the time `is_over`, which several threads call.
    std::size_t add(std::span<const CostArm> arms, const std::function<bool()>& is_over);
    // Fills in hierarchy_seconds, if there are such arms. Each is prepared anew, in turn, as `seconds` allow.
    void time_hierarchies(double seconds, const CostControl& control);
    [[nodiscard]] const std::vector<CostArm>& arms() const { return arms_; }
    [[nodiscard]] RendererInfo info() const;  // of the first arm's renderer
    [[nodiscard]] const std::vector<SkippedArm>& skipped() const { return skipped_; }

    // The short stage: rounds over the arms of these names (all must have been added) for about `seconds`, or as tells
    // enough of each arm (most_short_seconds, least_short_samples). There are at most most_replicates, and
    // fewest_replicates at least, if no stop comes before. Arms without samples yet get the counts that their share of
    // the time allows; those too slow for one sample a replicate are skipped. Results go to `samples`, whose reference
    // is there. False where a stop came before there were fewest_replicates.
    bool measure(
        const std::vector<std::string>& names, double seconds, CostSamples& samples, const CostControl& control);

    // A later stage: rounds until every arm has its replicates, a stop comes, or no replicate more would be done within
    // `seconds`. Whether there are more than before.
    bool extend(const CostStage& stage, double seconds, CostSamples& samples, const CostControl& control);

private:
    struct Renderers;
    struct Ready;
    [[nodiscard]] Ready make_ready(const CostArm& arm) const;
    void make_denoiser(const CostArm& arm, Ready& ready) const;
    void skip_for_time(const CostArm& arm, const std::string& reason);
    // Times a sample of each arm. Arms without samples get their counts. Returns the arms that
    // have time for a replicate, or nothing where a stop came.
    std::optional<std::vector<std::size_t>> try_speeds(
        const std::vector<std::string>& names, double seconds, CostSamples& samples, const CostControl& control);

    const Scene& scene_;
    std::unique_ptr<Renderers> renderers_;
    std::uint64_t seed_;
    unsigned threads_;
    std::vector<CostArm> arms_;
    std::vector<std::unique_ptr<RenderJob>> jobs_;
    std::vector<std::unique_ptr<FilmDenoiser>> denoisers_;  // of the same arms; none of those that do not denoise
    std::vector<SkippedArm> skipped_;
};

}  // namespace tandem
