// What a renderer returns (MODEL.md section 11): per pixel and channel the sum and the sum of squares of its samples.
// They are kept as a forest of dyadic runs of sample blocks. So disjoint ranges, cut at multiples of the block, merge
// to the same bits in any order. Progress, resuming, several devices and several machines all build on this.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/large_pages.h"

namespace tandem {

struct FilmSize {
    std::uint32_t width = 0, height = 0;  // pixels
    bool operator==(const FilmSize&) const = default;
    [[nodiscard]] std::uint64_t pixel_count() const { return std::uint64_t{width} * height; }
};

// Samples [begin, end) of every pixel.
struct SampleRange {
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
    [[nodiscard]] std::uint64_t count() const { return end - begin; }
    bool operator==(const SampleRange&) const = default;
};

// Samples a block: ranges are cut at its multiples. A power of two, so that runs of blocks stay dyadic.
inline constexpr std::uint64_t samples_per_block = 64;

inline constexpr std::uint32_t channel_count = 3;

// Moments of one channel of one pixel.
struct Moments {
    double sum = 0.0;
    double sum_of_squares = 0.0;
};

class Estimate {
public:
    // Key of a run: blocks [index * 2^level, (index + 1) * 2^level).
    struct Run {
        std::uint64_t first_block = 0;
        std::uint32_t level = 0;
        auto operator<=>(const Run&) const = default;
    };
    using Plane = std::vector<Moments, LargePages<Moments>>;  // [(y * width + x) * 3 + channel]

    Estimate() = default;
    Estimate(std::uint32_t width, std::uint32_t height);

    [[nodiscard]] std::uint32_t width() const { return width_; }
    [[nodiscard]] std::uint32_t height() const { return height_; }
    [[nodiscard]] std::uint64_t pixel_count() const { return std::uint64_t{width_} * height_; }

    // Adds the moments of samples `range` of every pixel. `range` is a run of blocks, or lies in one block and begins
    // where the block begins. It may end early (a ragged block), which then can never be completed by merging. Throws
    // Error on any other range, on an overlap, and on a plane of the wrong size.
    void add_block(SampleRange range, Plane moments);

    // Adds samples that were not finite or were negative: they count as zero in the sums, and are reported here
    // (MODEL.md section 12).
    void add_invalid(std::uint64_t samples) { invalid_ += samples; }
    [[nodiscard]] std::uint64_t invalid() const { return invalid_; }

    // Takes in a disjoint estimate of the same size; any order of merges gives the same bits. Throws Error on overlap.
    void merge(Estimate other);

    // Takes its ragged blocks out, so that they can be rendered whole. Samples added as invalid stay.
    [[nodiscard]] Estimate take_ragged();

    // Samples of the ragged block that begins there, or 0.
    [[nodiscard]] std::uint64_t ragged_count(std::uint64_t begin) const;
    // Takes the moments of that one block out. There must be one.
    [[nodiscard]] Plane take_ragged_moments(std::uint64_t begin);
    [[nodiscard]] const Plane& ragged_moments(std::uint64_t begin) const { return ragged_.at(begin).second; }

    // Samples a pixel, the same for every pixel.
    [[nodiscard]] std::uint64_t count() const;
    [[nodiscard]] std::vector<SampleRange> ranges() const;  // ascending, adjacent ranges joined

    // What it holds, ascending: runs of blocks and ragged blocks. add_block() of each, in any order, makes this
    // estimate again, to the bit. The planes live as long as it is not changed.
    struct Piece {
        SampleRange range;
        const Plane* moments;
    };
    [[nodiscard]] std::vector<Piece> pieces() const;

    // Canonical totals: the pieces added in ascending order.
    [[nodiscard]] Plane totals() const;
    void add_to(Plane& sums) const;  // likewise

private:
    void insert(Run run, Plane plane);
    void check_free(SampleRange range) const;

    std::uint32_t width_ = 0, height_ = 0;
    std::uint64_t invalid_ = 0;
    std::map<Run, Plane> runs_;                                        // complete dyadic runs, siblings joined
    std::map<std::uint64_t, std::pair<std::uint64_t, Plane>> ragged_;  // begin -> (end, moments)
};

// The sums of an image whose pixels need not have the same number of samples (MODEL.md section 11.3).
struct FilmMoments {
    std::uint32_t width = 0, height = 0;
    Estimate::Plane moments;
    std::vector<std::uint64_t> counts;  // samples, [y * width + x]
    std::uint64_t invalid = 0;          // of all pixels

    [[nodiscard]] std::uint64_t pixel_count() const { return counts.size(); }
    [[nodiscard]] std::uint64_t paths() const;  // samples of all pixels
    [[nodiscard]] double count() const;         // samples a pixel, the mean over pixels
};
[[nodiscard]] FilmMoments film_of(const Estimate& estimate);

// Per pixel and channel, [(y * width + x) * 3 + channel]: the mean, and the unbiased variance *of one sample*
// (NaN below two samples). The variance of the mean is variance / count.
[[nodiscard]] std::vector<double> mean_of(const Estimate& estimate);
[[nodiscard]] std::vector<double> variance_of(const Estimate& estimate);
[[nodiscard]] std::vector<double> mean_of(const FilmMoments& film);
[[nodiscard]] std::vector<double> variance_of(const FilmMoments& film);
[[nodiscard]] double mean_from(const Moments& moments, std::uint64_t count);
[[nodiscard]] double variance_from(const Moments& moments, std::uint64_t count);

}  // namespace tandem
