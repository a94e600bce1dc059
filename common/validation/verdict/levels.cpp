#include "common/validation/verdict/levels.h"

#include <algorithm>
#include <cmath>

#include "common/statistics/multiple_tests.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

// Variances of the difference of one pixel's means: what Welch's test takes, and what the distribution-free bound
// takes.
struct PixelDifference {
    double reference_variance = 0.0, candidate_variance = 0.0;
    double null_variance = 0.0;
};

// With d_i = b_i - a_i over any pairing, (sum d)^2 / sum d^2 is what symmetric_sum_tail speaks of. Averaged over
// pairings, sum d^2 = SS_a + SS_b + n (mean difference)^2. For unequal counts the same with the harmonic mean of the
// counts, and the pooled variance of one sample.
PixelDifference pixel_difference(const PixelStatistics& a, const PixelStatistics& b) {
    PixelDifference result;
    result.reference_variance = a.variance / a.count;
    result.candidate_variance = b.variance / b.count;
    const double squares = (a.count - 1.0) * a.variance + (b.count - 1.0) * b.variance;
    const double harmonic = 2.0 * a.count * b.count / (a.count + b.count);
    const double difference = b.mean - a.mean;
    result.null_variance = (squares + harmonic * difference * difference) / (a.count * b.count);
    return result;
}

SampleMoments samples_of(const PixelStatistics& pixel) {
    return {pixel.count, pixel.mean, pixel.variance * (pixel.count - 1.0)};
}

struct RegionSums {
    MeanOfMeans reference, candidate;
    SampleMoments reference_samples, candidate_samples;
    double null_variance = 0.0;
    double pixels = 0.0;

    void add(const PixelStatistics& a, const PixelStatistics& b, double reference_factor, double candidate_factor) {
        const PixelDifference d = pixel_difference(a, b);
        reference.add(a.mean, d.reference_variance * reference_factor, a.count - 1.0);
        candidate.add(b.mean, d.candidate_variance * candidate_factor, b.count - 1.0);
        reference_samples.merge(samples_of(a));
        candidate_samples.merge(samples_of(b));
        null_variance += d.null_variance * std::max(reference_factor, candidate_factor);
        pixels += 1.0;
    }
};

struct TestedDifference {
    double statistic, p;
};

TestedDifference test(const MeanDifference& difference, double null_variance, double negligible) {
    const MeanDifference symmetric{difference.difference, std::sqrt(null_variance), difference.dof};
    return {difference.statistic(negligible),
        std::max(difference.p_value(negligible), symmetric_sum_tail(symmetric.statistic(negligible)))};
}

// 1 where nothing bounds the samples.
double bernstein_p_value(const SampleMoments& reference, const SampleMoments& candidate, std::size_t channel,
    double negligible, const GreatestSamples& greatest) {
    return empirical_bernstein_p_value(std::abs(candidate.mean - reference.mean) - negligible,
        {reference.variance(), reference.count, greatest.reference[channel]},
        {candidate.variance(), candidate.count, greatest.candidate[channel]});
}

RegionComparison compare_region(const RegionSums& sums, std::uint32_t channel, double floor, double negligible,
    double alpha_each_side, const std::optional<GreatestSamples>& greatest) {
    const MeanEstimate reference = sums.reference.result(), candidate = sums.candidate.result();
    const MeanDifference difference = welch(reference, candidate);
    RegionComparison result;
    result.channel = channel;
    result.reference = reference.mean;
    result.candidate = candidate.mean;
    result.dof = difference.dof;
    const double scale = std::max(reference.mean, floor);
    if (scale <= 0.0) return result;  // black on both sides
    const TestedDifference tested =
        test(difference, sums.null_variance / (sums.pixels * sums.pixels), negligible * scale);
    result.statistic = tested.statistic;
    result.p = tested.p;
    if (greatest)
        result.p = std::max(result.p,
            bernstein_p_value(sums.reference_samples, sums.candidate_samples, channel, negligible * scale, *greatest));
    result.relative = difference.difference / scale;
    result.relative_error = difference.standard_error / scale;
    Interval interval = difference.interval(alpha_each_side);
    interval = {interval.low / scale, interval.high / scale};
    if (reference.mean >= floor) interval = fieller_relative_difference(reference, candidate, alpha_each_side);
    result.relative_low = interval.low;
    result.relative_high = interval.high;
    return result;
}

void set_worst(LevelResult& level) {
    if (level.regions.empty()) return;
    level.worst = *std::ranges::min_element(level.regions, [](const RegionComparison& a, const RegionComparison& b) {
        return a.p != b.p ? a.p < b.p : std::abs(a.relative) > std::abs(b.relative);
    });
}

}  // namespace

double RegionComparison::bound() const { return std::max(std::abs(relative_low), std::abs(relative_high)); }

bool equivalent(const LevelResult& level, double margin) {
    return std::ranges::all_of(level.regions, [&](const RegionComparison& region) {
        return equivalent(Interval{region.relative_low, region.relative_high}, margin);
    });
}

const RegionComparison& widest(const LevelResult& level) {
    return *std::ranges::max_element(level.regions, {}, [](const RegionComparison& region) { return region.bound(); });
}

Scales scales_of(const SampledImage& reference, const SampledImage& candidate, const Margins& margins) {
    const auto a = channel_means(reference), b = channel_means(candidate);
    const auto average = [](const auto& means) { return (means[0] + means[1] + means[2]) / 3.0; };
    const double grey = average(a) > 0.0 ? average(a) : average(b);
    Scales scales;
    for (std::size_t c = 0; c < channel_count; ++c) scales.image[c] = std::max(a[c], margins.channel_floor * grey);
    return scales;
}

LevelResult compare_regions(const std::string& name, const SampledImage& reference, const SampledImage& candidate,
    std::uint32_t edge, const Scales& scales, double negligible, double tile_floor, double alpha_each_side,
    const std::optional<GreatestSamples>& greatest) {
    const TileGrid grid(reference.width, reference.height, edge);
    std::vector<RegionSums> sums(grid.size() * channel_count);
    for (std::size_t pixel = 0; pixel < grid.tile_of_pixel().size(); ++pixel)
        for (std::size_t c = 0; c < channel_count; ++c) {
            const std::size_t i = pixel * channel_count + c;
            sums[grid.tile_of_pixel()[pixel] * channel_count + c].add(
                reference.pixels[i], candidate.pixels[i], reference.correlation, candidate.correlation);
        }

    LevelResult level;
    level.name = name;
    level.test =
        greatest ? "Welch and empirical Bernstein bound, Bonferroni" : "Welch and distribution-free bound, Bonferroni";
    level.tests = sums.size();
    level.columns = grid.columns();
    level.rows = grid.rows();
    std::vector<double> p_values;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const std::size_t channel = i % channel_count;
        const double floor = scales.image[channel] * (edge == 0 ? 1.0 : tile_floor);
        level.regions.push_back(
            compare_region(sums[i], static_cast<std::uint32_t>(channel), floor, negligible, alpha_each_side, greatest));
        level.regions.back().region = grid.rectangle(i / channel_count);
        p_values.push_back(level.regions.back().p);
    }
    level.p = bonferroni(p_values);
    set_worst(level);
    return level;
}

namespace {

// The pixels with no variance below the mean of the 5x5 around them. A pixel whose rare bright samples have not been
// drawn yet shows too small a variance, or none. Some of 25 like it will have drawn theirs.
std::vector<PixelStatistics> with_neighbours_variance(const SampledImage& image) {
    constexpr std::int64_t reach = 2;
    const std::int64_t width = image.width, height = image.height;
    std::vector<PixelStatistics> result = image.pixels;
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < channel_count; ++c) {
                double sum = 0.0, count = 0.0;
                for (std::int64_t v = std::max<std::int64_t>(0, y - reach); v <= std::min(height - 1, y + reach); ++v)
                    for (std::int64_t u = std::max<std::int64_t>(0, x - reach); u <= std::min(width - 1, x + reach);
                         ++u, count += 1.0)
                        sum += image.pixels[static_cast<std::size_t>(v * width + u) * channel_count + c].variance;
                double& variance = result[static_cast<std::size_t>(y * width + x) * channel_count + c].variance;
                variance = std::max(variance, sum / count);
            }
    return result;
}

}  // namespace

PixelLevel compare_pixels(const SampledImage& reference, const SampledImage& candidate, const FixedPixels& fixed,
    const Scales& scales, const Criteria& criteria) {
    PixelLevel result;
    result.p.assign(reference.pixels.size(), 1.0);
    const auto prepared = [&](const SampledImage& image) {
        return criteria.same_estimator ? image.pixels : with_neighbours_variance(image);
    };
    const std::vector<PixelStatistics> of_reference = prepared(reference), of_candidate = prepared(candidate);
    std::vector<double> tested;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const PixelStatistics &a = of_reference[i], &b = of_candidate[i];
        if (fixed.fixed[i] || a.count < 2.0 || b.count < 2.0) continue;
        const PixelDifference d = pixel_difference(a, b);
        const MeanDifference difference =
            welch({a.mean, d.reference_variance, a.count - 1.0}, {b.mean, d.candidate_variance, b.count - 1.0});
        const double scale = std::max(a.mean, criteria.margins.tile_floor * scales.image[i % channel_count]);
        const double negligible = criteria.negligible.pixel * scale;
        result.p[i] = test(difference, d.null_variance, negligible).p;
        if (criteria.greatest)
            result.p[i] = std::max(result.p[i],
                bernstein_p_value(samples_of(a), samples_of(b), i % channel_count, negligible, *criteria.greatest));
        tested.push_back(result.p[i]);
        if (result.p[i] < result.p[worst]) worst = i;
    }
    LevelResult& level = result.level;
    level.name = "pixels";
    level.test = "Welch and distribution-free bound, Simes";
    level.tests = tested.size();
    level.p = simes(tested);
    for (const double adjusted : benjamini_hochberg_adjusted(tested))
        if (adjusted <= criteria.discovery_rate) ++result.discoveries;
    if (tested.empty()) return result;
    RegionSums sums;
    sums.add(of_reference[worst], of_candidate[worst], 1.0, 1.0);
    level.worst = compare_region(sums, static_cast<std::uint32_t>(worst % channel_count),
        criteria.margins.tile_floor * scales.image[worst % channel_count], criteria.negligible.pixel, 0.025,
        criteria.greatest);
    const auto pixel = static_cast<std::uint32_t>(worst / channel_count);
    const std::uint32_t x = pixel % reference.width, y = pixel / reference.width;
    level.worst.region = {x, y, x + 1, y + 1};
    return result;
}

}  // namespace tandem
