// Paired seeds: both sides drew the same random numbers, so paths coincide until rounding parts them and the difference
// is known far better than either mean. Two renderers that round differently are never exactly alike, so only a
// difference larger than a declared negligible one counts. It cannot see what is wrong on both sides.
#pragma once

#include "common/validation/levels.h"

namespace tandem {

struct PairedResult {
    bool done = false;
    std::uint64_t samples = 0;        // a pixel and side
    std::uint64_t blocks = 0;         // they were compared in
    LevelResult image, tiles;         // differences and intervals relative as in Margins
    double identical_fraction = 0.0;  // of pixel blocks whose sums are the same bits
    double diverged_fraction = 0.0;   // of pixel blocks that differ by more than rounding: some path parted
};

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

    std::uint32_t width_, height_;
    double rounding_tolerance_;
    std::uint64_t blocks_ = 0, samples_ = 0, identical_ = 0, diverged_ = 0;
    std::vector<Difference> differences_;
    std::vector<double> reference_;  // sum over blocks of block means
};

}  // namespace tandem
