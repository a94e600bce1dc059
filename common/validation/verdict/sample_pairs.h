// Comparison of single samples, pixel by pixel. Both sides draw the same random numbers. So a sample is the same up to
// rounding, or its path has parted. Means may agree where samples do not: if numbers are reused, pixels are not
// rendered, or arithmetic is coarse.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/validation/verdict/levels.h"

namespace tandem {

enum class SampleState : std::uint8_t { dark, same, parted };  // dark: no light on either side, so nothing is seen

// A sample has gone elsewhere beyond this relative difference: no arithmetic of 11 bits or more takes it so far.
inline constexpr double gone_elsewhere = 0x1p-4;
// Where paths are as short as short_path_bounces, rounding parts a few in ten thousand. compare_paths says why a share
// of a quarter is no accident.
inline constexpr double tolerated_parted_share = 0.25;

// Each pixel of two planes of equal size: whether a channel differs by more than `tolerance` times the larger value.
[[nodiscard]] std::vector<SampleState> compare_samples(
    const Estimate::Plane& reference, const Estimate::Plane& candidate, double tolerance);

struct SampleCount {
    std::uint64_t lit = 0, parted = 0;
    void add(SampleState state) {
        lit += state == SampleState::dark ? 0 : 1;
        parted += state == SampleState::parted ? 1 : 0;
    }
    [[nodiscard]] double share() const { return lit > 0 ? static_cast<double>(parted) / static_cast<double>(lit) : 0; }
};
[[nodiscard]] SampleCount count(const std::vector<SampleState>& states);

// How much coarser than single precision an operation of the candidate may be. So what single precision parts by itself
// says what the candidate may. Single precision errs by half an ulp. Vulkan allows 2.5 ulp to a division and 4.5 to a
// root (2.5 of the division by 2 of an inverse root). It allows 3 + 2 |x| to exp(x), and 2^-21 to log, which is 8 ulp
// of a number below 1. So errors grow 16 times at most, and the difference of both sides 17 times. It also allows 2^-11
// to sine and cosine, which no device known needs (an H100 errs by 2^-21). One that does is meant to be called coarse.
inline constexpr double coarsest_operation = 17.0;
// What 12 bounces in single precision differ by at most (float_transport_tolerance). Most samples of longer paths do,
// too: errors seldom add up.
inline constexpr std::uint32_t counted_bounces = 12;

// An upper limit of the share that parts, which is wrong once in ten thousand; 1 where nothing was seen.
[[nodiscard]] double share_limit(const SampleCount& count);

// Samples that are looked at together: a counter, a bounce, a row.
struct SampleRegion {
    std::string place;  // "sample 65536", "row 82 of 127x83 pixels"
    SampleCount count;
    double tolerated = tolerated_parted_share;
};

// p: a binomial tail, of at most the tolerated share having parted by chance; Bonferroni over regions.
// `worst.relative` is the share of parted samples among lit ones.
[[nodiscard]] LevelResult sample_level(const std::string& name, const std::vector<SampleRegion>& regions);

inline constexpr const char* sample_level_prefix = "paired samples";
inline constexpr const char* counter_level = "paired samples, counters";
inline constexpr const char* bounce_level = "paired samples, bounce by bounce";
inline constexpr const char* size_level = "paired samples, other sizes";
inline constexpr const char* arithmetic_level = "paired samples, arithmetic";

}  // namespace tandem
