// Adaptive sampling (MODEL.md section 11.3). Every pixel gets its share of uniform samples, and noisier pixels get
// more. So the mean squared error of the image falls fastest. It has no bias: the neighbours' noise decides how many
// samples a pixel gets, never its own samples.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/render/growing_estimate.h"

namespace tandem {

// The part of all samples that every pixel has alike: no pixel's count falls below this part of the mean.
inline constexpr double uniform_share = 0.25;

// Up to this many samples a pixel, every pixel has the same number. The difference between two blocks tells how well a
// pixel's variance is known.
inline constexpr std::uint64_t least_alike = 2 * samples_per_block;

// The root of the weighted mean of the variances of nearby pixels, [y * width + x]. These are pixels of the other
// colour of a chequerboard. 0 where there are none.
[[nodiscard]] std::vector<double> neighbour_deviations(
    std::uint32_t width, std::uint32_t height, std::span<const double> variances);

// Numbers of samples that a film may use from its first one on. The first 2^40, as many as `render --samples` takes,
// are those of samples that all pixels have alike. The rest is adaptive sampling's, whose noisiest pixel may have a
// great multiple of the mean.
inline constexpr unsigned film_numbers_shift = 44;
inline constexpr std::uint64_t film_numbers = std::uint64_t{1} << film_numbers_shift;
inline constexpr std::uint64_t numbers_alike = std::uint64_t{1} << 40;

// Counts n_i >= least_i with the sum `total` that minimise the sum of deviation_i^2 / n_i. `total` is at least the sum
// of `least`. If all deviations are 0, the rest is shared out evenly.
[[nodiscard]] std::vector<double> allocate(
    std::span<const double> deviations, std::span<const double> least, double total);

// What adaptive sampling makes of as many uniform samples.
struct Foretold {
    double squared_error = 1.0;           // of the image, a factor
    std::vector<std::uint32_t> favoured;  // pixels that get more than the mean, ascending
    double most = 1.0;                    // that one of them gets, in means
};
// As a pilot of at least 2 samples a pixel foretells it. Nothing for a pilot without noise.
[[nodiscard]] std::optional<Foretold> foretell(const Estimate& pilot);

// How far the variances of a film's pixels may be misjudged, by how they differ between parts of its samples.
class VarianceScatter {
public:
    // Samples of some pixels (all: an empty list) by themselves; fewer than 2 a pixel say nothing.
    void add(const Estimate& part, std::span<const std::uint32_t> pixels);
    // Standard error of the mean of variance / count over pixels, relative to it, with its degrees of freedom [Welch
    // 1947; Satterthwaite 1946]. Nothing where a pixel has fewer than two parts.
    struct Misjudged {
        double relative = 0.0, degrees = 0.0;
    };
    [[nodiscard]] std::optional<Misjudged> misjudged(std::span<const std::uint64_t> counts) const;

private:
    // Sums over a pixel's parts of m, m v and m v^2: m samples of variance v each, channels added up.
    struct Sums {
        double samples = 0.0, variance = 0.0, squares = 0.0;
        std::uint32_t parts = 0;
    };
    std::vector<Sums> pixels_;
};

// An image that grows sample by sample, uniformly or adaptively.
class GrowingFilm {
public:
    // `job` must outlive it. Samples have numbers of the film_numbers from `first_sample` on, a multiple of
    // samples_per_block.
    GrowingFilm(RenderJob& job, Sampling sampling, std::uint64_t first_sample = 0)
        : job_(job), sampling_(sampling), first_sample_(first_sample), uniform_(first_sample) {}

    using Growth = GrowingEstimate::Growth;
    // Goes on until there are `samples` a pixel, in the mean, or until a stop. `progress` tells samples that are added.
    Growth grow_to(std::uint64_t samples, const RenderControl& control);

    [[nodiscard]] double samples() const { return samples_; }  // a pixel, in the mean
    [[nodiscard]] FilmMoments film() const;
    [[nodiscard]] VarianceScatter scatter() const;

private:
    // False if it was stopped before its end.
    bool grow_alike(std::uint64_t samples, const RenderControl& control, Growth& growth);
    bool render_pass(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control, Growth& growth);
    [[nodiscard]] std::vector<std::uint64_t> units_to_add(std::uint64_t samples, std::uint64_t unit) const;
    bool add_passes(std::uint64_t samples, const RenderControl& control, Growth& growth);

    RenderJob& job_;
    Sampling sampling_;
    std::uint64_t first_sample_;
    GrowingEstimate uniform_;  // of every pixel alike
    Estimate::Plane more_;     // of adaptive sampling's passes
    std::vector<std::uint64_t> more_counts_;
    std::uint64_t more_invalid_ = 0, next_more_ = 0;
    double samples_ = 0.0;
    VarianceScatter scatter_;  // of whole blocks and of passes
};

}  // namespace tandem
