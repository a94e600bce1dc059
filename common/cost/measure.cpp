#include "common/cost/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "common/error.h"
#include "common/stopwatch.h"
#include "common/validation/verdict/error_metrics.h"

namespace tandem {

namespace {

constexpr std::size_t wanted_replicates = 12;
constexpr std::size_t most_levels = 8;
constexpr double chunk_seconds = 0.3;    // of the reference: so long at most (about) does a stop wait
constexpr double most_overdrawn = 0.05;  // of the time, that an arm may take beyond its share
constexpr double probe_seconds = 0.05;
constexpr double probing_share = 0.5;  // of the time: arms whose turn to be tried comes later are left out
constexpr std::uint64_t second_half = std::uint64_t{1} << 62;  // first sample of the reference's second half

void tell(const CostControl& control, double fraction, const std::string& text) {
    if (control.progress) control.progress(std::clamp(fraction, 0.0, 1.0), text);
}

// Renders all of the range, or throws nothing and says no.
std::optional<RenderResult> render_all(RenderJob& job, SampleRange range, const CostControl& control) {
    RenderResult result = job.render(range, {.stop = control.stop, .progress = {}});
    if (result.estimate.count() != range.count()) return std::nullopt;
    return result;
}

// Sums of one half of the reference.
struct Half {
    PixelValues sum, squares;
    std::uint64_t samples = 0, first = 0;

    void add(const Estimate& estimate) {
        const Estimate::Plane totals = estimate.totals();
        sum.resize(totals.size(), 0.0);
        squares.resize(totals.size(), 0.0);
        for (std::size_t i = 0; i < totals.size(); ++i) {
            sum[i] += totals[i].sum;
            squares[i] += totals[i].sum_of_squares;
        }
        samples += estimate.count();
    }
};

void restore(const CostReference& earlier, std::array<Half, 2>& halves) {
    for (std::size_t h = 0; h < 2; ++h) {
        Half& half = halves[h];
        half.samples = earlier.samples / 2;
        const auto n = static_cast<double>(half.samples);
        half.sum.resize(earlier.mean.size());
        half.squares.resize(earlier.mean.size());
        for (std::size_t i = 0; i < half.sum.size(); ++i) {
            const double mean = earlier.mean[i] + (h == 0 ? 1.0 : -1.0) * earlier.half_difference[i];
            half.sum[i] = n * mean;
            half.squares[i] = earlier.half_variance[i] * n * (n - 1.0) + n * mean * mean;
        }
    }
}

void conclude(const std::array<Half, 2>& halves, CostReference& reference) {
    const auto n = static_cast<double>(halves[0].samples);
    const std::size_t size = halves[0].sum.size();
    reference.samples = 2 * halves[0].samples;
    reference.mean.resize(size);
    reference.half_difference.resize(size);
    reference.half_variance.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
        const double first = halves[0].sum[i] / n, second = halves[1].sum[i] / n;
        reference.mean[i] = 0.5 * (first + second);
        reference.half_difference[i] = 0.5 * (first - second);
        const double deviations = halves[0].squares[i] + halves[1].squares[i] - n * (first * first + second * second);
        reference.half_variance[i] = std::max(0.0, deviations / (2.0 * (n - 1.0)) / n);
    }
}

// What the figures of a replicate are made of.
struct Errors {
    double square = 0.0, relative = 0.0;
};
Errors errors_of(const PixelValues& image, const CostReference& reference) {
    Errors errors;
    for (std::size_t i = 0; i < image.size(); ++i) {
        const double deviation = image[i] - reference.mean[i], half = reference.half_difference[i];
        const double product = deviation * deviation - half * half;  // (x - half 1)(x - half 2)
        errors.square += product;
        errors.relative += product / (reference.mean[i] * reference.mean[i] + ErrorMetrics::epsilon);
    }
    const auto count = static_cast<double>(image.size());
    return {errors.square / count, errors.relative / count};
}

// Seconds a sample, of the longest of growing trials, so that a fast device's time is not that of starting and ending a
// render; a sample before them warms up.
std::optional<double> seconds_per_sample(RenderJob& job, double long_enough, const CostControl& control) {
    double seconds = 0.0;
    if (!render_all(job, {0, 1}, control)) return std::nullopt;
    constexpr std::uint64_t most = std::uint64_t{1} << 20;
    for (std::uint64_t samples = 1; samples <= most; samples *= 4) {
        const auto result = render_all(job, {0, samples}, control);
        if (!result) return std::nullopt;
        seconds = result->seconds / static_cast<double>(samples);
        if (result->seconds > long_enough) break;
    }
    return seconds;
}

// Devices raise their clocks under load (an H200 was four times as fast after 0.1 s): until trials get no faster.
void warm_up(RenderJob& job, double long_enough, const CostControl& control) {
    constexpr double faster = 0.9;
    constexpr int most = 8;
    std::optional<double> before = seconds_per_sample(job, long_enough, control);
    for (int i = 1; before && i < most; ++i) {
        const std::optional<double> now = seconds_per_sample(job, long_enough, control);
        if (!now || *now > faster * *before) return;
        before = now;
    }
}

// Sample counts up to the greatest power of two that `share` seconds allow; none if they do not allow one sample.
std::vector<std::uint64_t> levels_for(double seconds_a_sample, double share) {
    const double allowed = share / std::max(seconds_a_sample, 1e-12);
    if (allowed < 1.0) return {};
    // Counts below a block's are rendered anew, in all as many samples again but one, or a block's.
    const auto cost = [](std::uint64_t most) {
        return static_cast<double>(most + std::min(most, samples_per_block) - 1);
    };
    std::uint64_t most = 1;
    while (cost(2 * most) <= allowed && most < (std::uint64_t{1} << 24)) most *= 2;
    std::vector<std::uint64_t> levels;
    for (std::uint64_t n = most; n >= 1 && levels.size() < most_levels; n /= 2) levels.push_back(n);
    std::ranges::reverse(levels);
    return levels;
}

double mean_variance(const FilmMoments& film) {
    const PixelValues variances = variance_of(film);
    const double count = film.count();  // goes over all pixels
    double sum = 0.0;
    for (std::size_t i = 0; i < variances.size(); ++i)
        sum += variances[i] * count / static_cast<double>(film.counts[i / channel_count]);
    return sum / static_cast<double>(variances.size());
}

// One replicate; nothing after a stop. Counts of whole blocks continue each other, smaller ones are renders of their
// own.
bool render_replicate(RenderJob& job, Sampling sampling, std::uint64_t round, const CostReference& reference,
    const CostControl& control, ArmTrials& arm) {
    const std::uint64_t begin = (arm.first_replicate + arm.replicates.size()) << replicate_shift;
    Replicate replicate;
    replicate.round = round;
    std::optional<GrowingFilm> film;
    double seconds = 0.0;
    std::uint64_t invalid = 0;
    PixelValues image;
    for (const std::uint64_t samples : arm.samples) {
        if (!film) {
            film.emplace(job, sampling, begin);
            seconds = 0.0;
            invalid = 0;
        }
        const GrowingFilm::Growth growth = film->grow_to(samples, {.stop = control.stop, .progress = {}});
        if (!growth.complete) return false;
        seconds += growth.seconds;
        const FilmMoments now = film->film();
        arm.invalid += now.invalid - std::exchange(invalid, now.invalid);
        image = mean_of(now);
        if (samples == arm.samples.back() && samples > 1) replicate.sample_variance = mean_variance(now);
        if (samples % samples_per_block != 0) film.reset();
        const Errors errors = errors_of(image, reference);
        replicate.seconds.push_back(seconds);
        replicate.squared_errors.push_back(errors.square);
        replicate.relative_squared_errors.push_back(errors.relative);
    }
    for (std::size_t i = 0; i < image.size(); ++i) {
        const double deviation = image[i] - reference.mean[i];
        arm.sum[i] += deviation;
        arm.sum_of_squares[i] += deviation * deviation;
    }
    arm.replicates.push_back(std::move(replicate));
    return true;
}

// Whether adaptive sampling, which the arm or the baseline has, would do just what the other does.
bool does_not_adapt(const CostArm& arm, const CostArm& baseline, const ArmTrials& trials) {
    return arm.settings.render.sampling != baseline.settings.render.sampling && trials.samples.back() <= least_alike;
}

std::size_t samples_known(const CostSamples& samples, const std::string& name) {
    const auto found = std::ranges::find(samples.arms, name, &ArmTrials::name);
    return found == samples.arms.end() ? 0 : found->samples.size();
}

ArmTrials& samples_named(CostSamples& samples, const std::string& name) {
    const auto found = std::ranges::find(samples.arms, name, &ArmTrials::name);
    if (found != samples.arms.end()) return *found;
    ArmTrials arm;
    arm.name = name;
    arm.sum.assign(samples.reference.mean.size(), 0.0);
    arm.sum_of_squares = arm.sum;
    samples.arms.push_back(std::move(arm));
    return samples.arms.back();
}

}  // namespace

double now_by(const CostControl& control) { return control.now ? control.now() : steady_seconds(); }

CostReference render_reference(
    RenderJob& job, std::optional<CostReference> earlier, double seconds, const CostControl& control) {
    CostReference reference;
    std::array<Half, 2> halves{};
    halves[1].first = second_half;
    if (earlier) {
        reference = std::move(*earlier);
        restore(reference, halves);
    }
    const double start = now_by(control), before = reference.seconds;
    std::uint64_t chunk = samples_per_block;
    for (double spent = 0.0; (before + spent < seconds || reference.samples == 0) && !control.stop.stop_requested();) {
        for (Half& half : halves) {
            const std::uint64_t from = half.first + half.samples;
            const auto part = render_all(job, {from, from + chunk}, control);
            if (!part) return reference;
            if (part->estimate.invalid() > 0)
                throw Error("the long reference has samples that are not finite or negative (MODEL.md section 12)");
            half.add(part->estimate);
            if (part->seconds < 0.5 * chunk_seconds && chunk < (std::uint64_t{1} << 20) && &half == &halves[1])
                chunk *= 2;
        }
        conclude(halves, reference);
        spent = now_by(control) - start;
        reference.seconds = before + spent;
        tell(control, reference.seconds / seconds, "the long reference");
    }
    return reference;
}

struct CostExperiment::Renderers {
    struct One {
        BackendOptions options;
        std::unique_ptr<Renderer> renderer;
    };
    MakeRenderer make;
    std::vector<One> all;

    Renderer& of(const BackendOptions& options) {
        for (One& one : all)
            if (one.options.precision == options.precision && one.options.kernel == options.kernel)
                return *one.renderer;
        all.push_back({options, make(options)});
        return *all.back().renderer;
    }
};

CostExperiment::CostExperiment(const Scene& scene, MakeRenderer make, std::uint64_t seed)
    : scene_(scene), renderers_(std::make_unique<Renderers>()), seed_(seed) {
    renderers_->make = std::move(make);
}

CostExperiment::~CostExperiment() { jobs_.clear(); }

RendererInfo CostExperiment::info() const { return renderers_->all.front().renderer->info(); }

void CostExperiment::skip_for_time(const CostArm& arm, const std::string& reason) {
    skipped_.push_back({arm.knob, arm.setting, reason, true});
}

bool CostExperiment::add(const CostArm& arm) {
    try {
        RenderSettings settings = arm.settings.render;
        settings.seed = seed_;
        jobs_.push_back(renderers_->of(arm.settings.backend).prepare(scene_, settings));
        arms_.push_back(arm);
        return true;
    } catch (const UnsupportedError& refusal) {
        skipped_.push_back({arm.knob, arm.setting, refusal.what()});
        return false;
    }
}

bool CostExperiment::measure(
    const std::vector<std::string>& names, double seconds, CostSamples& samples, const CostControl& control) {
    const double start = now_by(control);
    std::vector<std::size_t> taking_part;
    std::uint64_t round = 0;
    for (const ArmTrials& arm : samples.arms)
        for (const Replicate& replicate : arm.replicates) round = std::max(round, replicate.round + 1);
    // Trials are quadrupled until they are long enough: all of them together take up to six times that.
    const double long_enough =
        std::min(probe_seconds, probing_share * seconds / (6.0 * static_cast<double>(names.size())));
    warm_up(*jobs_.front(), long_enough, control);
    const double warm = now_by(control);
    for (std::size_t i = 0; i < arms_.size(); ++i) {
        if (std::ranges::find(names, arms_[i].name()) == names.end()) continue;
        if (samples_known(samples, arms_[i].name()) == 0 && arms_[i].knob != "baseline" &&
            now_by(control) - warm > probing_share * seconds) {
            skip_for_time(arms_[i], "no time was left to try how fast it is");
            continue;
        }
        const auto speed = seconds_per_sample(*jobs_[i], long_enough, control);
        if (!speed) return false;
        ArmTrials& arm = samples_named(samples, arms_[i].name());
        if (arm.samples.empty())
            arm.samples = levels_for(*speed, seconds / static_cast<double>(names.size() * wanted_replicates));
        // A sample a replicate says little, but more than nothing; without a baseline nothing could be said at all.
        const double least = static_cast<double>(fewest_replicates) * *speed;
        if (arm.samples.empty() && (arms_[i].knob == "baseline" || least <= most_overdrawn * seconds))
            arm.samples = {1};
        if (arm.samples.empty()) {
            skip_for_time(arms_[i], "too slow for a sample in its share of the time");
            continue;
        }
        if (does_not_adapt(arms_[i], arms_.front(), arm)) {
            skipped_.push_back({arms_[i].knob, arms_[i].setting,
                fmt::format(
                    "no more than {} samples a pixel in its share of the time, and up to {} adaptive sampling is "
                    "uniform",
                    arm.samples.back(), least_alike)});
            continue;
        }
        taking_part.push_back(i);
    }
    std::mt19937_64 order(seed_ + round);
    std::size_t done = 0;
    for (; !control.stop.stop_requested(); ++done, ++round) {
        const double spent = now_by(control) - start;
        const double next = done == 0 ? 0.0 : spent / static_cast<double>(done);
        if (done >= fewest_replicates && spent + next > seconds) break;
        std::shuffle(taking_part.begin(), taking_part.end(), order);
        for (const std::size_t i : taking_part) {
            tell(control, (now_by(control) - start) / seconds, arms_[i].name());
            if (!render_replicate(*jobs_[i], arms_[i].settings.render.sampling, round, samples.reference, control,
                    samples_named(samples, arms_[i].name())))
                return done >= fewest_replicates;
        }
        if (control.save) control.save(samples);
    }
    return done >= fewest_replicates;
}

}  // namespace tandem
