// Images in and out. With TANDEM_IMAGE_IO through OpenImageIO (EXR, PNG, and whatever else it reads); without it, raw
// float PFM (three channels) only. Files appear whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/files/write_file.h"
#include "common/render/estimate.h"

namespace tandem {

struct Image {
    std::uint32_t width = 0, height = 0;     // the data window, pixels
    std::vector<std::string> channels;       // "R", "variance.R", "count", …
    std::vector<float> pixels;               // [(y * width + x) * channels.size() + channel], y down
    std::vector<std::string> word_channels;  // of whole numbers, which floats would round; .exr alone holds them
    std::vector<std::uint32_t> words;        // [(y * width + x) * word_channels.size() + channel]
    std::map<std::string, std::string> metadata;
    std::int32_t data_x = 0, data_y = 0;            // upper left corner of the data window
    std::int32_t full_x = 0, full_y = 0;            // display window
    std::uint32_t full_width = 0, full_height = 0;  // 0: the data window's
    std::string colour_space;                       // as the file declares it; empty: it does not
    std::uint32_t greatest_integer = 0;             // that the file's values can be: 255, 65535; 0: they are floats
};

// Floats of the largest image read: 4 GiB, 8192² pixels of 16 channels. A header may promise anything.
inline constexpr std::uint64_t greatest_float_count = std::uint64_t{1} << 30;

// Throws InputError (file, reason, mend), also for an image of more floats than `limit`.
[[nodiscard]] Image read_image(const std::filesystem::path& path, std::uint64_t limit = greatest_float_count);

// The same of a texture: its colours are not multiplied by its alpha. `bytes`, where there are any, are the file's,
// which stand within another one; `path` is then its name for errors, with an ending.
[[nodiscard]] Image read_texture_image(const std::filesystem::path& path, std::string_view bytes, std::uint64_t limit);

// The channels of whole numbers of an EXR file's first part, as `words`, and its metadata; `limit` is of words. Throws
// InputError.
[[nodiscard]] Image read_image_words(const std::filesystem::path& path, std::uint64_t limit = greatest_float_count);

// Float32 EXR (or PFM: first three channels) with every channel and all metadata. Throws InputError when it cannot be
// written; an existing file is replaced only by a complete one, and one of `read` by none.
void write_image(const std::filesystem::path& path, const Image& image, const FilesRead& read = {});

// R, G, B (mean), variance.R/G/B (of one sample, MODEL.md section 11) and count, with `metadata` beside. Without
// variance and count where samples are not `independent`: they would not say how well the mean is known.
[[nodiscard]] Image image_of(
    const FilmMoments& film, const std::map<std::string, std::string>& metadata, bool independent = true);
[[nodiscard]] inline Image image_of(const Estimate& estimate, const std::map<std::string, std::string>& metadata) {
    return image_of(film_of(estimate), metadata);
}

// Whether a name ends in .png or .exr, in capitals or not.
[[nodiscard]] bool is_png(const std::filesystem::path& path);
[[nodiscard]] bool is_exr(const std::filesystem::path& path);

// 8-bit sRGB PNG of the first three channels of linear `image`, multiplied by `exposure`, clipped to [0, 1].
// The transfer function is that of IEC 61966-2-1.
void write_png(
    const std::filesystem::path& path, const Image& image, double exposure = 1.0, const FilesRead& read = {});

// Throws InputError unless the name ends as write_image or write_png want it.
void check_image_ending(const std::filesystem::path& path);

}  // namespace tandem
