#include "common/cost/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <random>
#include <utility>

#include "common/at_once.h"
#include "common/cost/schedule.h"
#include "common/error.h"
#include "common/render/concurrent_renderer.h"
#include "common/statistics/paired_effect.h"
#include "common/stopwatch.h"
#include "common/validation/judges/judges.h"
#include "common/validation/verdict/error_metrics.h"

namespace tandem {

namespace {

constexpr std::size_t most_levels = 8;
constexpr double most_overdrawn = 0.05;  // of the time, that an arm may take beyond its share
constexpr double probe_seconds = 0.05;
constexpr double probing_share = 0.5;  // of the time: arms whose turn to be tried comes later are left out

void tell(const CostControl& control, double fraction, const std::string& text) {
    if (control.progress) control.progress(std::clamp(fraction, 0.0, 1.0), text);
}

// Renders all of the range, or throws nothing and says no.
std::optional<RenderResult> render_all(RenderJob& job, SampleRange range, const CostControl& control) {
    RenderResult result = job.render(range, {.stop = control.stop, .progress = {}});
    if (result.estimate.count() != range.count()) return std::nullopt;
    return result;
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

// Seconds a sample, from the longest of growing trials, so that starting and ending a render does not count as a fast
// device's time. A sample before them warms up.
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
// Returns seconds a sample, or nothing after a stop.
std::optional<double> warm_up(RenderJob& job, double long_enough, const CostControl& control) {
    constexpr double faster = 0.9;
    constexpr int most = 8;
    std::optional<double> before = seconds_per_sample(job, long_enough, control);
    for (int i = 1; before && i < most; ++i) {
        const std::optional<double> now = seconds_per_sample(job, long_enough, control);
        if (!now || *now > faster * *before) return now;
        before = now;
    }
    return before;
}

// Counts of a short stage up to `most`, a power of two, ascending. Those below a block's are renders of their own. So
// `most` and powers of four are there; arms of any two `most` share the latter.
std::vector<std::uint64_t> levels_to(std::uint64_t most) {
    std::vector<std::uint64_t> levels;
    for (std::uint64_t n = 1; n < std::min(most, samples_per_block); n *= 4) levels.push_back(n);
    for (std::uint64_t n = std::min(most, samples_per_block); n <= most; n *= 2) levels.push_back(n);
    if (levels.size() > most_levels) levels.erase(levels.begin(), levels.end() - most_levels);
    return levels;
}

// Sample counts up to the greatest power of two that `share` seconds allow; none if they do not allow one sample.
std::vector<std::uint64_t> levels_for(double seconds_a_sample, double share) {
    const double allowed = share / std::max(seconds_a_sample, 1e-12);
    if (allowed < 1.0) return {};
    const auto rendered = [](std::uint64_t most) {  // counts of whole blocks continue each other
        double samples = static_cast<double>(most);
        for (const std::uint64_t n : levels_to(most))
            samples += n < std::min(most, samples_per_block) ? static_cast<double>(n) : 0.0;
        return samples;
    };
    std::uint64_t most = 1;
    while (rendered(2 * most) <= allowed && most < (std::uint64_t{1} << 24)) most *= 2;
    return levels_to(most);
}

// A sample a replicate says little, but more than nothing; without a baseline nothing could be said at all.
std::optional<std::vector<std::uint64_t>> levels_or_one(double seconds_a_sample, double share, bool needed) {
    std::vector<std::uint64_t> levels = levels_for(seconds_a_sample, share);
    if (levels.empty() && needed) levels = {1};
    return levels;
}

std::function<double()> clock_of(const CostControl& control) { return control.now ? control.now : steady_seconds; }

// Those of what features and filters leave of the share; else a few, where these do not overdraw. Nothing after a stop.
std::optional<std::vector<std::uint64_t>> denoised_levels(RenderJob& job, FilmDenoiser& denoiser,
    double seconds_a_sample, double share, double most, const CostControl& control) {
    const auto few = render_all(job, {0, fewest_to_denoise}, control);
    if (!few) return std::nullopt;
    const auto denoised = denoiser.denoise(film_of(few->estimate), 0, clock_of(control), control.stop);
    if (!denoised) return std::nullopt;
    const double features = denoised->feature_seconds * most_feature_samples / fewest_to_denoise;
    const double filter = denoised->seconds - denoised->feature_seconds;
    std::vector<std::uint64_t> levels = levels_for(seconds_a_sample, share - features - most_levels * filter);
    std::erase_if(levels, [](std::uint64_t count) { return count < fewest_to_denoise; });
    constexpr std::uint64_t little = most_feature_samples;
    const double of_few = features + 2.0 * filter + static_cast<double>(little) * seconds_a_sample;
    if (levels.empty() && static_cast<double>(fewest_replicates) * of_few <= most) levels = {fewest_to_denoise, little};
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

// FLIP of images as they are shown: with a mean of `shown_mean` (linear), clipped at 1. [Andersson et al. 2020]
double flip_of(const PixelValues& image, const CostReference& reference, std::pair<std::uint32_t, std::uint32_t> size) {
    const double exposure = shown_mean / reference.image_mean();
    const auto shown = [&](const PixelValues& values) {
        PixelValues result(values);
        for (double& value : result) value = std::clamp(value * exposure, 0.0, 1.0);
        return result;
    };
    return flip_error(shown(reference.mean), shown(image), size.first, size.second);
}

// An arm as it renders.
struct PreparedArm {
    RenderJob& job;
    Sampling sampling;
    FilmDenoiser* denoiser;  // none: its film is the image
};

// One replicate; nothing after a stop. Counts of whole blocks continue each other, smaller ones are renders of their
// own.
bool render_replicate(const PreparedArm& prepared, std::uint64_t round, const CostReference& reference,
    const CostControl& control, ArmTrials& arm) {
    const std::uint64_t begin = (arm.first_replicate + arm.replicates.size()) << replicate_shift;
    Replicate replicate;
    replicate.round = round;
    std::optional<GrowingFilm> film;
    double seconds = 0.0;
    std::uint64_t invalid = 0;
    PixelValues image;
    std::pair<std::uint32_t, std::uint32_t> film_size;
    for (const std::uint64_t samples : arm.samples) {
        if (!film) {
            film.emplace(prepared.job, prepared.sampling, begin);
            seconds = 0.0;
            invalid = 0;
        }
        const GrowingFilm::Growth growth = film->grow_to(samples, {.stop = control.stop, .progress = {}});
        if (!growth.complete) return false;
        seconds += growth.seconds;
        const FilmMoments now = film->film();
        arm.invalid += now.invalid - std::exchange(invalid, now.invalid);
        double filtering = 0.0;
        if (prepared.denoiser == nullptr) {
            image = mean_of(now);
        } else if (auto denoised = prepared.denoiser->denoise(now, begin, clock_of(control), control.stop)) {
            image = std::move(denoised->image);
            filtering = denoised->seconds;
        } else {
            return false;
        }
        film_size = {now.width, now.height};
        if (samples == arm.samples.back() && samples > 1) replicate.sample_variance = mean_variance(now);
        if (samples % samples_per_block != 0) film.reset();
        const Errors errors = errors_of(image, reference);
        replicate.seconds.push_back(seconds + filtering);
        replicate.squared_errors.push_back(errors.square);
        replicate.relative_squared_errors.push_back(errors.relative);
    }
    for (std::size_t i = 0; i < image.size(); ++i) {
        const double deviation = image[i] - reference.mean[i];
        arm.sum[i] += deviation;
        arm.sum_of_squares[i] += deviation * deviation;
    }
    if (arm.replicates.empty()) arm.flip = flip_of(image, reference, film_size);
    arm.replicates.push_back(std::move(replicate));
    return true;
}

std::uint64_t next_round(const CostSamples& samples) {
    std::uint64_t round = 0;
    for (const ArmTrials& arm : samples.arms)
        for (const Replicate& replicate : arm.replicates) round = std::max(round, replicate.round + 1);
    return round;
}

std::size_t samples_known(const CostSamples& samples, const std::string& name) {
    const auto found = std::ranges::find(samples.arms, name, &ArmTrials::name);
    return found == samples.arms.end() ? 0 : found->samples.size();
}

ArmTrials& samples_of(CostSamples& samples, const std::string& name, std::uint32_t stage) {
    const auto same = [&](const ArmTrials& arm) { return arm.name == name && arm.stage == stage; };
    const auto found = std::ranges::find_if(samples.arms, same);
    if (found != samples.arms.end()) return *found;
    ArmTrials arm;
    arm.name = name;
    arm.stage = stage;
    arm.first_replicate = first_replicate_of(stage);
    arm.sum.assign(samples.reference.mean.size(), 0.0);
    arm.sum_of_squares = arm.sum;
    samples.arms.push_back(std::move(arm));
    return samples.arms.back();
}

}  // namespace

double now_by(const CostControl& control) { return clock_of(control)(); }

struct CostExperiment::Renderers {
    struct One {
        BackendOptions options;
        std::unique_ptr<Renderer> renderer;
    };
    MakeRenderer make;
    std::vector<One> all;

    [[nodiscard]] std::size_t prepare_at_once() const {
        const auto* many = all.empty() ? nullptr : dynamic_cast<ConcurrentRenderer*>(all.front().renderer.get());
        return many == nullptr ? 1 : many->prepares_at_once();
    }
    Renderer& of(const BackendOptions& options) {
        for (One& one : all)
            if (one.options.precision == options.precision && one.options.kernel == options.kernel)
                return *one.renderer;
        all.push_back({options, make(options)});
        return *all.back().renderer;
    }
};

CostExperiment::CostExperiment(const Scene& scene, MakeRenderer make, std::uint64_t seed, unsigned threads)
    : scene_(scene), renderers_(std::make_unique<Renderers>()), seed_(seed), threads_(threads) {
    renderers_->make = std::move(make);
}

CostExperiment::~CostExperiment() {
    denoisers_.clear();
    jobs_.clear();
}

RendererInfo CostExperiment::info() const { return renderers_->all.front().renderer->info(); }

void CostExperiment::skip_for_time(const CostArm& arm, const std::string& reason) {
    skipped_.push_back({arm.knob, arm.setting, reason, true});
}

struct CostExperiment::Ready {
    std::unique_ptr<RenderJob> job;  // null: refused, or there was no time
    std::unique_ptr<FilmDenoiser> denoiser;
    std::string refusal;
    std::exception_ptr failure;
};

CostExperiment::Ready CostExperiment::make_ready(const CostArm& arm) const {
    Ready ready;
    try {
        RenderSettings settings = arm.settings.render;
        settings.seed = seed_;
        ready.job = renderers_->of(arm.settings.backend).prepare(scene_, settings);
    } catch (const UnsupportedError& refusal) {
        ready.refusal = refusal.what();
    } catch (...) {
        ready.failure = std::current_exception();
    }
    return ready;
}

// It traces a path, which no other thread may do meanwhile.
void CostExperiment::make_denoiser(const CostArm& arm, Ready& ready) const {
    try {
        RenderSettings settings = arm.settings.render;
        settings.seed = seed_;
        ready.denoiser =
            std::make_unique<FilmDenoiser>(renderers_->of(arm.settings.backend), scene_, settings, threads_);
    } catch (const UnsupportedError& refusal) {
        ready.job.reset();
        ready.refusal = refusal.what();
    }
}

std::size_t CostExperiment::add(std::span<const CostArm> arms, const std::function<bool()>& is_over) {
    std::vector<Ready> all(arms.size());
    for (std::size_t i = 0; i < arms.size(); ++i) {
        try {
            (void)renderers_->of(arms[i].settings.backend);  // made by one thread
        } catch (const UnsupportedError& refusal) {
            all[i].refusal = refusal.what();
        }
    }
    at_once(arms.size(), renderers_->prepare_at_once(), [&](std::size_t i) {
        if (all[i].refusal.empty() && !is_over()) all[i] = make_ready(arms[i]);
    });
    std::size_t added = 0;
    for (std::size_t i = 0; i < arms.size(); ++i) {
        Ready& ready = all[i];
        if (ready.failure) std::rethrow_exception(ready.failure);
        if (ready.job && arms[i].settings.denoise) make_denoiser(arms[i], ready);
        if (!ready.job) {
            if (ready.refusal.empty())
                skip_for_time(arms[i], "no time was left to prepare it");
            else
                skipped_.push_back({arms[i].knob, arms[i].setting, ready.refusal});
            continue;
        }
        jobs_.push_back(std::move(ready.job));
        denoisers_.push_back(std::move(ready.denoiser));
        arms_.push_back(arms[i]);
        ++added;
    }
    return added;
}

void CostExperiment::time_hierarchies(double seconds, const CostControl& control) {
    constexpr std::size_t most_times = 5;
    std::vector<std::size_t> timed;
    for (std::size_t i = 0; i < arms_.size(); ++i)
        if (arms_[i].knob == "baseline" || arms_[i].knob == hierarchy_knob) timed.push_back(i);
    if (std::ranges::none_of(timed, [&](std::size_t i) { return arms_[i].knob == hierarchy_knob; })) return;
    const double start = now_by(control);
    std::vector<std::vector<double>> times(timed.size());
    // What was built while others were made took longer.
    if (renderers_->prepare_at_once() == 1)
        for (std::size_t k = 0; k < timed.size(); ++k) times[k] = {jobs_[timed[k]]->facts().hierarchy_seconds};
    for (std::size_t round = 1; round < most_times; ++round) {
        const double spent = now_by(control) - start;
        const double next = round == 1 ? 0.0 : spent / static_cast<double>(round - 1);
        if (control.stop.stop_requested() || spent + next > seconds) break;
        for (std::size_t k = 0; k < timed.size(); ++k) {
            const ArmSettings& settings = arms_[timed[k]].settings;
            RenderSettings render = settings.render;
            render.seed = seed_;
            times[k].push_back(renderers_->of(settings.backend).prepare(scene_, render)->facts().hierarchy_seconds);
        }
    }
    for (std::size_t k = 0; k < timed.size(); ++k)
        if (!times[k].empty()) arms_[timed[k]].hierarchy_seconds = median(times[k]);
}

std::optional<std::vector<std::size_t>> CostExperiment::try_speeds(
    const std::vector<std::string>& names, double seconds, CostSamples& samples, const CostControl& control) {
    std::vector<std::size_t> taking_part;
    // Trials are quadrupled until they are long enough: all of them together take up to six times that.
    const double long_enough =
        std::min(probe_seconds, probing_share * seconds / (6.0 * static_cast<double>(names.size())));
    const double warm = now_by(control);
    for (std::size_t i = 0; i < arms_.size(); ++i) {
        if (std::ranges::find(names, arms_[i].name()) == names.end()) continue;
        if (samples_known(samples, arms_[i].name()) == 0 && arms_[i].knob != "baseline" &&
            now_by(control) - warm > probing_share * seconds) {
            skip_for_time(arms_[i], "no time was left to try how fast it is");
            continue;
        }
        const auto speed = seconds_per_sample(*jobs_[i], long_enough, control);
        if (!speed) return std::nullopt;
        ArmTrials& arm = samples_of(samples, arms_[i].name(), short_stage);
        if (arm.samples.empty()) {
            const double share = seconds / static_cast<double>(names.size() * most_replicates);
            const double most = most_overdrawn * seconds;
            const bool needed = arms_[i].knob == "baseline" || static_cast<double>(fewest_replicates) * *speed <= most;
            auto levels = denoisers_[i] ? denoised_levels(*jobs_[i], *denoisers_[i], *speed, share,
                                              std::max(most, seconds / static_cast<double>(names.size())), control)
                                        : levels_or_one(*speed, share, needed);
            if (!levels) return std::nullopt;
            arm.samples = std::move(*levels);
        }
        if (arm.samples.empty()) {
            skip_for_time(arms_[i], denoisers_[i] ? "too slow for features and a few samples in its share of the time"
                                                  : "too slow for a sample in its share of the time");
            continue;
        }
        taking_part.push_back(i);
    }
    return taking_part;
}

bool CostExperiment::measure(
    const std::vector<std::string>& names, double seconds, CostSamples& samples, const CostControl& control) {
    const double start = now_by(control);
    constexpr double warming_share = 0.03;  // of the time: many arms make trials too short to warm a device
    const std::optional<double> a_sample =
        warm_up(*jobs_.front(), std::min(probe_seconds, warming_share * seconds), control);
    if (!a_sample) return false;
    const double enough = std::max(most_short_seconds, most_replicates * least_short_samples * *a_sample);
    seconds = std::min(seconds, enough * static_cast<double>(names.size()));
    std::uint64_t round = next_round(samples);
    std::optional<std::vector<std::size_t>> tried = try_speeds(names, seconds, samples, control);
    if (!tried) return false;
    std::vector<std::size_t>& taking_part = *tried;
    std::mt19937_64 order(seed_ + round);
    std::size_t done = 0;
    for (; !control.stop.stop_requested(); ++done, ++round) {
        const double spent = now_by(control) - start;
        const double next = done == 0 ? 0.0 : spent / static_cast<double>(done);
        if (done >= fewest_replicates && spent + next > seconds) break;
        std::erase_if(taking_part, [&](std::size_t i) {
            return samples_of(samples, arms_[i].name(), short_stage).replicates.size() >= most_replicates;
        });
        if (taking_part.empty()) return true;
        std::shuffle(taking_part.begin(), taking_part.end(), order);
        for (const std::size_t i : taking_part) {
            tell(control, (now_by(control) - start) / seconds, arms_[i].name());
            if (!render_replicate({*jobs_[i], arms_[i].settings.render.sampling, denoisers_[i].get()}, round,
                    samples.reference, control, samples_of(samples, arms_[i].name(), short_stage)))
                return done >= fewest_replicates;
        }
        if (control.save) control.save(samples);
    }
    return done >= fewest_replicates;
}

bool CostExperiment::extend(const CostStage& stage, double seconds, CostSamples& samples, const CostControl& control) {
    const double start = now_by(control);
    const auto job_of = [&](const std::string& name) {
        return static_cast<std::size_t>(std::ranges::find(arms_, name, &CostArm::name) - arms_.begin());
    };
    std::vector<CostStage::Arm> arms;
    std::ranges::copy_if(stage.arms, std::back_inserter(arms),
        [&](const CostStage::Arm& arm) { return job_of(arm.name) < arms_.size(); });
    for (const CostStage::Arm& wanted : arms) {  // so that a stop leaves none out of the stage
        ArmTrials& trials = samples_of(samples, wanted.name, stage.stage);
        if (trials.samples.empty()) trials.samples = wanted.samples;
    }
    std::uint64_t round = next_round(samples);
    std::mt19937_64 order(seed_ + round);
    bool any = false;
    for (std::size_t before = 1; before > 0; ++round) {
        before = 0;
        std::shuffle(arms.begin(), arms.end(), order);
        // Where there is no time for all of them, those that have least come first.
        std::ranges::stable_sort(arms, {},
            [&](const CostStage::Arm& arm) { return samples_of(samples, arm.name, stage.stage).replicates.size(); });
        for (const CostStage::Arm& wanted : arms) {
            const ArmTrials& trials = samples_of(samples, wanted.name, stage.stage);
            const double spent = now_by(control) - start;
            if (trials.replicates.size() >= stage.replicates || spent + seconds_a_replicate(trials, samples) > seconds)
                continue;
            tell(control, spent / seconds, stage.purpose + ": " + wanted.name);
            const std::size_t arm = job_of(wanted.name);
            if (!render_replicate({*jobs_[arm], arms_[arm].settings.render.sampling, denoisers_[arm].get()}, round,
                    samples.reference, control, samples_of(samples, wanted.name, stage.stage)))
                return any;
            ++before;
            any = true;
        }
        if (before > 0 && control.save) control.save(samples);
    }
    return any;
}

}  // namespace tandem
