// The raw measurements of `tandem cost`: the long reference and, for each arm, the errors and times of independent
// replicates. They are plain data, and saved whole, so that a measurement can be continued.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/render/estimate.h"

namespace tandem {

using PixelValues = std::vector<double>;  // [(y * width + x) * 3 + channel]

// Two independent halves: (x - half 1)(x - half 2) has the mean (x - truth)^2, free of the reference's own noise.
struct CostReference {
    std::string key;              // hash of all that it depends on
    std::string options;          // how it was rendered, for people
    std::uint64_t samples = 0;    // both halves together
    double seconds = 0.0;         // spent on it, ever
    PixelValues mean;             // of both halves
    PixelValues half_difference;  // (half 1 - half 2) / 2, whose mean square is the variance of `mean`
    // Variance of the mean of one half, as its samples show it: an upper bound where they are not independent (Sobol
    // points).
    PixelValues half_variance;
    std::string image{};    // hash of the scene's files and the size: what it is an image of, on whatever device
    std::string made_by{};  // backend, device and driver
    std::string program{};  // version

    [[nodiscard]] double image_mean() const;
    [[nodiscard]] double relative_uncertainty() const;  // root mean square standard error of `mean`, over image_mean()
};

// One rendering of an arm at all sample counts of a stage, from random numbers of its own.
struct Replicate {
    std::uint64_t round = 0;                      // arms of one round ran side by side
    std::vector<double> seconds;                  // wall clock, by sample count
    std::vector<double> squared_errors;           // mean over pixels and channels, by sample count
    std::vector<double> relative_squared_errors;  // each over reference^2 + ErrorMetrics::epsilon
    // Variance of one sample, mean over pixels and channels, as the samples of a pixel show it. With adaptive sampling:
    // the variance of the mean times the samples a pixel.
    double sample_variance = 0.0;
};

struct ArmTrials {
    std::string name;                    // "integrator next-event": unique within a stage
    std::uint32_t stage = 0;             // of the schedule (schedule.h)
    std::vector<std::uint64_t> samples;  // ascending; of the first stage powers of two
    std::uint64_t first_replicate = 0;   // the number of replicates[0]: what its random numbers are
    std::vector<Replicate> replicates;
    // Sums over replicates of the images at the greatest sample count, less the reference's mean.
    PixelValues sum, sum_of_squares;
    std::uint64_t invalid = 0;
    double flip = 0.0;  // of the first replicate at the greatest sample count
};

struct CostSamples {
    std::string key;  // of what was asked: a continued measurement must match
    CostReference reference;
    std::vector<ArmTrials> arms;
    double seconds = 0.0;     // of measuring, the reference's included
    std::uint32_t width = 0;  // of the images; not kept in files
};

// A line with a checksum, then CBOR [RFC 8949], images as binary strings of doubles in this machine's order.
// `from_bytes` throws InputError, `whose` naming the file.
[[nodiscard]] std::string to_bytes(const CostReference& reference);
[[nodiscard]] std::string to_bytes(const CostSamples& samples);
[[nodiscard]] CostReference reference_from_bytes(const std::string& bytes, const std::string& whose);
[[nodiscard]] CostSamples samples_from_bytes(const std::string& bytes, const std::string& whose);

}  // namespace tandem
