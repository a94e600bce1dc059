// Paired seeds: both sides drew the same random numbers. So paths coincide until rounding parts them, and the
// difference is known far better than either mean. Renderers that round differently never agree exactly. So only a
// difference above a declared negligible one counts. A fault that both sides share is not seen.
#pragma once

#include <optional>
#include <vector>

#include "common/validation/verdict/levels.h"
#include "common/validation/verdict/sample_pairs.h"

namespace tandem {

// How coarsely the candidate computes, where it is known what single precision does by itself (coarsest_operation).
struct Arithmetic {
    LevelResult level;     // worst.relative: the candidate's share of samples that differ beyond the limit
    SampleCount rounded;   // by single precision, beyond the limit over coarsest_operation
    SampleCount expected;  // by single precision, beyond the limit
    double allowed = 1.0;
    [[nodiscard]] std::string text() const;  // "86 % of the samples differ ..., single precision explains 1.6 %, ..."
};

struct PairedResult {
    bool done = false;
    std::uint64_t samples = 0;         // a pixel and side
    std::uint64_t blocks = 0;          // they were compared in
    LevelResult image, tiles;          // differences and intervals relative as in Margins
    LevelResult pixels;                // within tiles: differences that cancel in the tile's mean
    std::optional<LevelResult> paths;  // of short paths, where both sides follow the numbers
    std::vector<LevelResult> alone;    // of single samples, likewise (sample_pairs.h)
    std::optional<Arithmetic> arithmetic;
    double identical_fraction = 0.0;  // of pixel blocks whose sums are the same bits
    double diverged_fraction = 0.0;   // of pixel blocks that differ by more than rounding: some path parted
};

// Whether the samples themselves are the same, not only their mean. Two sides that follow MODEL.md section 3 agree
// about short paths, but for a few in ten thousand that rounding parts. Other numbers, or the same ones for another
// purpose, leave every mean right and part all of them. A pixel whose noise is above rounding has parted if its means
// over `samples` differ by more than a quarter of independent sides' deviation. 80 % of independent pixels do. p: a
// binomial tail, of at most a quarter of a tile's pixels having parted by chance, Bonferroni over tiles.
// `worst.relative` is the share of parted pixels.
[[nodiscard]] LevelResult compare_paths(
    const Estimate& reference, const Estimate& candidate, double rounding_tolerance);
inline constexpr const char* paired_paths_level = "paired short paths, tiles 16x16";
inline constexpr const char* paired_pixels_level = "paired pixels in tiles 16x16";
inline constexpr std::uint32_t short_path_bounces = 2;  // longer ones part sooner

// Gathers differences block by block (a block: the same samples of every pixel on both sides).
class PairedDifferences {
public:
    PairedDifferences(std::uint32_t width, std::uint32_t height, double rounding_tolerance);

    void add(const Estimate& reference, const Estimate& candidate);

    // One-sample t over blocks, summed over pixels; p also bounded by symmetric_sum_tail, as in compare_regions.
    [[nodiscard]] PairedResult result(const Criteria& criteria, double alpha_each_side) const;

private:
    struct Difference {
        double sum = 0.0, sum_of_squares = 0.0;  // over blocks, of block means
    };
    [[nodiscard]] LevelResult level(const std::string& name, std::uint32_t edge, const Scales& scales,
        double negligible, double tile_floor, double alpha_each_side) const;

    // A pixel's differences over two disjoint halves of the blocks have a product of mean 0, with either sign as
    // likely. If the pixel differs, its mean is the square of that. So the sum of the products over a tile sees
    // differences that cancel in its mean, as of shifted shadows or another filter. The bound on p is that of
    // symmetric_sum_tail. A root mean square up to `negligible` counts as no difference. `relative` is that root.
    [[nodiscard]] LevelResult pixel_level(const Scales& scales, double negligible, double tile_floor) const;

    std::uint32_t width_, height_;
    double rounding_tolerance_;
    std::uint64_t blocks_ = 0, samples_ = 0, identical_ = 0, diverged_ = 0;
    std::vector<Difference> differences_;
    std::vector<double> alternating_;  // sum over blocks of block means, every other one negative
    std::vector<double> reference_;    // sum over blocks of block means
};

}  // namespace tandem
