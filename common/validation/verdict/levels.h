// The levels on which means are compared: image, tiles and pixels, each channel by itself. Each level misses some
// faults. The image's mean misses local faults, and pixels miss small faults that are everywhere.
#pragma once

#include <string>
#include <vector>

#include "common/statistics/mean_tests.h"
#include "common/validation/verdict/criteria.h"
#include "common/validation/verdict/fixed_pixels.h"
#include "common/validation/verdict/sampled_image.h"

namespace tandem {

// One region (image, tile or pixel) in one channel.
struct RegionComparison {
    Rectangle region;
    std::uint32_t channel = 0;
    double reference = 0.0, candidate = 0.0;         // means
    double relative = 0.0;                           // (candidate - reference) / scale, the scale as Margins says
    double relative_low = 0.0, relative_high = 0.0;  // alpha_each_side either way
    double relative_error = 0.0;                     // standard error
    double statistic = 0.0, dof = 1.0;
    double p = 1.0;
    // max(|low|, |high|): the difference is shown to be smaller than this.
    [[nodiscard]] double bound() const;
};

// One row of the levels table.
struct LevelResult {
    std::string name;        // "image", "tiles 16x16", ...
    std::string test;        // how p came about
    std::size_t tests = 0;   // figures looked at
    double p = 1.0;          // of the level as a whole, corrected for its own tests
    double threshold = 0.0;  // that p was held to (Holm over levels at this look's share of the false alarms)
    bool significant = false;
    double minimum_detectable_relative = 0.0;  // median over regions, at `threshold` and the declared power
    double resolution_relative = 0.0;          // the same of the worst region
    std::string place;                         // of `worst`, where it is no rectangle of the image
    RegionComparison worst;                    // the region of least p
    std::uint32_t columns = 1, rows = 1;
    std::vector<RegionComparison> regions;  // [tile * 3 + channel]; empty for pixels
};

// Every region of the level is shown to lie within `margin` (equivalent() of its interval). As all must pass, each test
// keeps its full level. [Berger 1982: intersection-union]
[[nodiscard]] bool equivalent(const LevelResult& level, double margin);

// Greatest bound() of the level, and where.
[[nodiscard]] const RegionComparison& widest(const LevelResult& level);

// What relative differences are relative to.
struct Scales {
    std::array<double, channel_count> image{};
};
[[nodiscard]] Scales scales_of(const SampledImage& reference, const SampledImage& candidate, const Margins& margins);

// Tests on every tile of edge `edge` (0: the image) and channel. The p of a region is the larger of two:
// - Welch's t of the means, dof after Satterthwaite from the pixels' variances.
// - a bound that needs no normality (symmetric_sum_tail). If both sides are distributed alike, the difference of sample
//   i of one and of the other is as likely with either sign. It costs a factor of about three in p and makes fireflies
//   harmless. Exact for equal counts a side, up to averaging over the pairing; for unequal counts the pooled variance
//   takes its place.
// And where `greatest` is given, the empirical Bernstein bound on both means.
[[nodiscard]] LevelResult compare_regions(const std::string& name, const SampledImage& reference,
    const SampledImage& candidate, std::uint32_t edge, const Scales& scales, double negligible, double tile_floor,
    double alpha_each_side, const std::optional<GreatestSamples>& greatest = {});

// The same tests on every pixel that is not fixed. The level's p is after Simes, so that it is significant just where
// Benjamini-Hochberg makes a discovery.
struct PixelLevel {
    LevelResult level;
    std::vector<double> p;          // [(y * width + x) * 3 + channel]; 1 where fixed
    std::uint64_t discoveries = 0;  // at the discovery rate
};
[[nodiscard]] PixelLevel compare_pixels(const SampledImage& reference, const SampledImage& candidate,
    const FixedPixels& fixed, const Scales& scales, const Criteria& criteria);

// Variances of one sample, candidate against reference, from batches; `worst.relative` is ratio - 1. A deviation of
// `rounding` relative to the mean is added to both, so that the rounding noise of constant regions is not compared.
[[nodiscard]] LevelResult compare_variances(const std::string& name, const SampledImage& reference,
    const SampledImage& candidate, bool whole_image, double tolerated_ratio, double rounding, double alpha_each_side);

}  // namespace tandem
