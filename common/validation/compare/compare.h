// The verdict on images of any two renderers. A side is one image with variance channels and a count, or two or more
// images of independent seeds.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/validation/verify/verify.h"

namespace tandem {

// What a variance channel holds: the variance of one sample (Tandem's own files) or of the pixel's mean.
enum class VarianceOf { sample, mean };

struct CompareOptions {
    Criteria criteria = comparison_criteria();
    VarianceOf variance_of_reference = VarianceOf::sample, variance_of_candidate = VarianceOf::sample;
    std::string reference_name = "A", candidate_name = "B";
    std::string reference_layer, candidate_layer;  // of the files' channels; empty: as README.md says
    std::uint32_t bin = 1;  // edge of the squares of pixels whose means are compared (binned_image.h)
    std::uint64_t memory = std::numeric_limits<std::uint64_t>::max();  // that compare_files may take, bytes

    // Two renderers that share no text. Images of half precision are rounded by 2^-11 a side: equal pixels are equal to
    // 2^-10. The image's mean may differ by as much (`negligible`; options say otherwise where files hold floats).
    // Other estimators may have other variances. Places where two programs put a film sample, or the facets of a curved
    // surface, may differ by up to 0.05 pixel. Registration calls that a shift. An edge with a step C of the scale
    // moves 0.05 C/8 of the smallest tile, so 1 % is C = 1.6. A pixel of an edge may differ by 5 % C. A difference of 2
    // % is no fault where a step is as large as 0.4 of the pixel.
    [[nodiscard]] static Criteria comparison_criteria();
};

// One image as read, with the name that errors call it by.
struct NamedImage {
    std::string name;
    Image image;
    bool may_be_negative = false;  // noise of spectra leaves the gamut; else no radiance is negative
};

// README.md says which channels, metadata and colour spaces are read. A side of k >= 2 images takes its variance from
// their scatter. From it also comes how far neighbouring pixels go together (pixel filters, samplers). For a side of
// one image that comes from the difference of both sides (pixel_correlation.h), for images of 32x32 pixels and more.
// Encoded images (sRGB) are compared as linear light; their integers' steps count as noise, a twelfth of the step's
// square.
//
// Throws InputError, naming what differs or is missing: sizes, windows, channels, colour spaces, a single image without
// variance. It also refuses images that are the same bits, on one side or on both (no variance, and no evidence). So it
// does the same seed on both sides in the metadata of Tandem's own files.
[[nodiscard]] SceneVerdict compare_images(const std::vector<NamedImage>& reference,
    const std::vector<NamedImage>& candidate, const CompareOptions& options = {});

// Number of samples taken for granted where only the variance of the mean is known; it bounds how sure one pixel can
// be.
inline constexpr double assumed_count = 64.0;

// The image with the channels of that layer alone: "albedo.R" as "R", "albedo.variance.R" as "variance.R"; and "count".
// Throws InputError where it has no such channels.
[[nodiscard]] Image only_layer(const NamedImage& named, const std::string& layer);

// Reads the files and compares them. Throws InputError, before it reads a pixel, where that takes more memory than it
// may.
[[nodiscard]] SceneVerdict compare_files(const std::vector<std::filesystem::path>& reference,
    const std::vector<std::filesystem::path>& candidate, const CompareOptions& options = {});

// One side as the statistics see it; what was done to its files is added to `notes`. Throws InputError.
[[nodiscard]] SampledImage sampled_image_of(
    const std::vector<NamedImage>& side, VarianceOf variance_of, std::vector<std::string>* notes = nullptr);

}  // namespace tandem
