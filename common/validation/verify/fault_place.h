// Looks for the place of a fault, with the same random numbers on both sides. It finds the pixel and sample to trace,
// and whether paths part there. If none does, it tells which stage outside shading has the fault, and which pixels it
// changes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/validation/verdict/verdict.h"
#include "common/validation/verify/worst_pixel.h"

namespace tandem {

// The part of the image where the most significant level of parts of it differs, a paired one before any other. Nothing
// where the image as a whole, or a closed form, is all that differs.
[[nodiscard]] std::optional<Rectangle> fired_region(const Judgement& judgement);

// In which faults are looked for.
inline constexpr SampleRange first_block{0, samples_per_block};

// Whether sums of such a block differ by more than rounding.
[[nodiscard]] bool sums_differ(const glm::dvec3& a, const glm::dvec3& b);

struct FaultQuestion {
    const Scene& scene;
    RenderSettings settings;  // the seed is that of both sides
    Renderer& reference;
    Renderer& candidate;
    std::string reference_name, candidate_name;
    std::optional<Rectangle> region;  // where to look for the pixel
    bool differ = true;               // from each other, not from a closed form alone
    // The candidate with other kernels, by name: does each have the fault? Empty: there are none.
    std::vector<std::string> kernels;
    std::function<std::unique_ptr<Renderer>(const std::string& kernel)> with_kernel;
    std::stop_token stop;
};

// What was found, beside the pixel's reason in words.
struct FaultPlace {
    bool outside_paths = false;  // no traced path parts, and the films differ in the traced pixels nevertheless
    bool reference_adds = true, candidate_adds = true;  // each film is the sum of its side's traced paths
    // Where one is not: it is the sum of its paths, each cut at this radiance, in all pixels that were traced.
    std::optional<double> clamped_at;
    bool moved = false;   // where one is not: the films have the same sum, so that light lies in other pixels
    bool scaled = false;  // where one is not: one factor makes the films the same in all regions
    std::vector<std::string> kernels_with, kernels_without;
    std::string pattern;  // of the pixels that differ (pixel_pattern.h); empty: none
};

// Renders the first block of samples on both sides. `pixel` becomes the one in the region where they differ most, its
// sample that whose traced radiances differ most, and its reason what was found. All stays as it is where a side cannot
// trace paths, or where a stop was requested before the block was done.
FaultPlace find_fault(WorstPixel& pixel, const FaultQuestion& question);

// "the film has 1.00794 in red at (0, 0), and its traced paths have the mean 1". Two blocks are merged and divided as a
// verdict's are. The first, a middle and the last pixel are looked at. Empty where they have the same means, where
// paths cannot be traced, or after a stop.
[[nodiscard]] std::string film_against_paths(
    Renderer& renderer, const Scene& scene, const RenderSettings& settings, std::stop_token stop = {});

}  // namespace tandem
