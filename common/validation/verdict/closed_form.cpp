#include "common/validation/verdict/closed_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/statistics/multiple_tests.h"
#include "common/statistics/sample_moments.h"
#include "common/validation/verdict/greatest_sample.h"

namespace tandem {

namespace {

std::string why_not(const Scene& scene, const RenderSettings& settings) {
    const SceneDefaults& file = scene.defaults;
    if (settings.bounces != file.bounces)
        return fmt::format("it holds at {} bounces, not at {}", file.bounces, settings.bounces);
    if (settings.fresnel || settings.clamp < std::numeric_limits<double>::infinity())
        return "it holds without --fresnel and --clamp";
    if (settings.filter != PixelFilter::box) return "it holds for --filter box, as another filter shows another image";
    if (settings.accumulation == Accumulation::plain) return "it holds without --accumulation plain, which drifts";
    if (settings.integrator == Integrator::whitted && file.integrator != Integrator::whitted)
        return "it holds with indirect light, which whitted leaves out";
    if (settings.ray_min != file.ray_min || settings.ray_max != file.ray_max)
        return "it holds for the file's own interval of ray lengths";
    if (std::uint64_t{settings.width} * scene.film.height != std::uint64_t{settings.height} * scene.film.width)
        return fmt::format("it holds for a film of the shape {}x{}, not for {}x{}", scene.film.width, scene.film.height,
            settings.width, settings.height);
    return {};
}

// All pixels of a channel together: the mean, with its variance from the pixels' own, and every sample's variance.
struct ChannelMean {
    MeanEstimate mean;
    SampleMoments samples;
    bool still = true;  // no pixel varies by more than rounding
};

ChannelMean channel_mean(const SampledImage& side, std::size_t channel, double tolerance) {
    MeanOfMeans pixels;
    ChannelMean result;
    for (std::size_t i = channel; i < side.pixels.size(); i += channel_count) {
        const PixelStatistics& pixel = side.pixels[i];
        pixels.add(pixel.mean, pixel.variance / pixel.count * side.correlation, pixel.count - 1.0);
        SampleMoments samples;
        samples.count = pixel.count;
        samples.mean = pixel.mean;
        samples.squared_deviations = pixel.variance * (pixel.count - 1.0);
        result.samples.merge(samples);
        result.still = result.still && std::sqrt(pixel.variance) <= tolerance * std::abs(pixel.mean);
    }
    result.mean = pixels.result();
    return result;
}

}  // namespace

ClosedFormUse closed_form_of(const Scene& scene, const RenderSettings& settings) {
    if (!scene.expect) return {};
    if (std::string reason = why_not(scene, settings); !reason.empty()) return {std::nullopt, std::move(reason)};
    ClosedForm form;
    for (std::size_t c = 0; c < channel_count; ++c) form.radiance[c] = scene.expect->radiance[static_cast<int>(c)];
    form.formula = scene.expect->formula;
    form.greatest = greatest_sample(scene, settings);
    if (std::ranges::any_of(form.greatest, [](double value) { return std::isinf(value); }))
        return {std::nullopt, "nothing bounds what a single sample can bring, so its mean is known to nobody"};
    form.rounding = 0.5 * float_transport_tolerance(settings.bounces);
    return {std::move(form), {}};
}

LevelResult compare_closed_form(const std::string& name, const ClosedForm& form, const SampledImage& side,
    const Criteria& criteria, double alpha_each_side) {
    LevelResult level;
    level.name = name;
    level.test = "Student and empirical Bernstein bound against the closed form, Bonferroni";
    level.tests = channel_count;
    const double grey = (form.radiance[0] + form.radiance[1] + form.radiance[2]) / 3.0;
    std::vector<double> p_values;
    for (std::size_t c = 0; c < channel_count; ++c) {
        const ChannelMean measured = channel_mean(side, c, 2.0 * form.rounding);
        const MeanDifference difference{
            measured.mean.mean - form.radiance[c], std::sqrt(measured.mean.variance), measured.mean.dof};
        double scale = std::max(form.radiance[c], criteria.margins.channel_floor * grey);
        if (scale <= 0.0) scale = measured.mean.mean;  // a black scene: any light is a difference of 100 %
        RegionComparison region;
        region.region = {0, 0, side.width, side.height};
        region.channel = static_cast<std::uint32_t>(c);
        region.reference = form.radiance[c];
        region.candidate = measured.mean.mean;
        if (scale > 0.0) {
            const bool exact_sums = measured.still && !side.foreign;
            const double allowance = form.rounding * scale + (exact_sums ? 0.0 : criteria.negligible.image * scale);
            const Interval interval = difference.interval(alpha_each_side);
            region.dof = difference.dof;
            region.relative = difference.difference / scale;
            region.relative_low = interval.low / scale;
            region.relative_high = interval.high / scale;
            region.relative_error = difference.standard_error / scale;
            region.statistic = difference.statistic(allowance);
            const double excess = std::abs(difference.difference) - allowance;
            region.p = std::max(difference.p_value(allowance),
                measured.still
                    ? 0.0
                    : empirical_bernstein_p_value(excess,
                          {measured.samples.variance(), measured.samples.count / side.correlation, form.greatest[c]}));
        }
        p_values.push_back(region.p);
        level.regions.push_back(region);
    }
    level.p = bonferroni(p_values);
    level.worst = *std::ranges::min_element(level.regions, [](const RegionComparison& a, const RegionComparison& b) {
        return a.p != b.p ? a.p < b.p : std::abs(a.relative) > std::abs(b.relative);
    });
    return level;
}

}  // namespace tandem
