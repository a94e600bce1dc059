// A spatial filter for noisy images (MODEL.md section 11.6): joint non-local means, driven by the measured variances
// and by feature images. It trades variance for a bias, which falls with more samples but is not known. No renderer
// calls it.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/render/feature_images.h"

namespace tandem {

// All of one size, width and height at least 1.
struct NoisyImage {
    std::uint32_t width = 0, height = 0;
    std::vector<double> mean;                // [(y * width + x) * 3 + channel], finite
    std::vector<double> variance;            // of the mean, likewise, at least 0; infinite: not known
    std::vector<glm::dvec3> albedo, normal;  // [y * width + x]
    std::vector<double> depth;               // [y * width + x], scene units; infinite: nothing was hit
};

// What a denoised image's metadata say; its key, and how the filter is named.
inline constexpr const char* denoised_key = "tandem:denoised";
inline constexpr const char* denoised_text = "biased: joint non-local means (MODEL.md section 11.6)";
[[nodiscard]] bool is_denoised(const Image& image);

// From a film and the features of the same pixels. Every pixel has two samples at least.
[[nodiscard]] NoisyImage noisy_image_of(const FilmMoments& film, const std::vector<PixelFeatures>& features);

// From a file's image: R, G, B, variance.R/G/B of one sample, count, and the layers albedo, normal and depth. Throws
// InputError for what is missing or no number, and for what is denoised already; `name` is the file's.
[[nodiscard]] NoisyImage noisy_image_of(const Image& image, const std::string& name);

struct DenoiseControl {
    unsigned threads = 0;  // 0: as many as the machine has
    std::stop_token stop{};
    std::function<void(double fraction)> progress{};  // called from one thread at a time
};

// [(y * width + x) * 3 + channel]: the same bits for any number of threads; nothing after a stop. Where an image has no
// differences, and where its variance is 0 and nothing near is alike, it stays as it is.
[[nodiscard]] std::optional<std::vector<double>> denoise(const NoisyImage& image, const DenoiseControl& control = {});

// R, G, B, with the metadata of what it was made of but for its error, and that it is denoised.
[[nodiscard]] Image denoised_image(const Image& of, const std::vector<double>& values);

}  // namespace tandem
