#include "common/stability/image_judge.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/render/stopping.h"
#include "common/scene/loader/scene_loader.h"

namespace tandem::stability {

namespace {

// Six standard errors: 2e-9 false alarms a channel where the mean is near normal.
constexpr double sigmas = 6.0;

struct Deviation {
    double relative = 0.0, allowed = 0.0;  // of the closed form; the worst of channels (and pixels) by their quotient
    void take(double error, double allowance) {
        if (error * allowed >= relative * allowance || (allowed == 0.0 && relative == 0.0)) {
            relative = error;
            allowed = allowance;
        }
    }
};

}  // namespace

void judge_image(const HardCase& hard_case, Renderer& renderer, Precision precision, double seconds,
    const std::stop_token& stop, CaseResult& result) {
    const Scene scene = load_scene(hard_case.scene_file);
    if (!scene.expect)
        throw input_error(
            hard_case.scene_file, "/expect", "is missing", "give the scene of a hard case its closed form");
    RenderSettings settings = default_settings(scene);
    settings.bounces = hard_case.bounces.value_or(settings.bounces);
    const std::unique_ptr<RenderJob> job = renderer.prepare(scene, settings);
    StoppingRule rule;
    rule.samples = hard_case.samples;
    rule.seconds = std::max(seconds, 0.1);
    const StoppedRender render = render_until(*job, rule, stop, {});
    const auto pixels = static_cast<double>(render.film.pixel_count()), samples = render.film.count();
    if (!(samples >= 1.0)) return;  // a stop
    result.cut = samples < static_cast<double>(hard_case.samples);
    const std::vector<double> mean = mean_of(render.film);
    const double ulp = precision == Precision::double_precision ? 0x1p-52 : 0x1p-23;
    const double rounding = result.bound * ulp;  // the arm's
    Deviation deviation;
    for (std::size_t channel = 0; channel < channel_count; ++channel) {
        const double expected = scene.expect->radiance[static_cast<int>(channel)];
        const double unit = expected > 0.0 ? expected : 1.0;
        // Deviations, not values: of thousands of nearly equal values the sum itself would round by hundreds of ulp.
        double sum = 0.0, squares = 0.0;
        for (std::size_t i = channel; i < mean.size(); i += channel_count) {
            const double off = (mean[i] - expected) / unit;
            sum += off;
            squares += off * off;
            if (hard_case.every_pixel) deviation.take(std::abs(off), rounding);
        }
        if (hard_case.every_pixel) continue;
        // All pixels have the same mean, so their scatter tells the error, however few samples there were.
        const double variance = std::max(0.0, squares - sum * sum / pixels) / std::max(1.0, pixels - 1.0);
        deviation.take(std::abs(sum / pixels), rounding + sigmas * std::sqrt(variance / pixels));
    }
    result.rays = static_cast<std::uint64_t>(pixels * samples);
    result.false_hits = render.film.invalid;
    result.worst_ulp = deviation.relative / ulp;
    result.bound = deviation.allowed / ulp;
    result.nanoseconds_per_ray = 1e9 * render.seconds / (pixels * samples);
}

}  // namespace tandem::stability
