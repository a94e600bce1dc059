// What the sources of image_io share and, beside them, exports alone need: the formats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/image_io.h"
#include "common/image/tiled_image.h"

namespace tandem::image_files {

// The file ending in lower case, ".exr".
[[nodiscard]] std::string ending(const std::filesystem::path& path);

// Throws InputError unless `path` is a regular file.
void require_regular_file(const std::filesystem::path& path);

// Portable float map: three channels, or one, as it is; no metadata, no windows, no declared colour space.
[[nodiscard]] Image read_pfm(const std::filesystem::path& path, std::uint64_t limit);
[[nodiscard]] std::string pfm_bytes(const Image& image);

// What numpy.save wrote.
[[nodiscard]] Image read_npy(const std::filesystem::path& path, std::uint64_t limit);

// The first three channels (a single one thrice) times `exposure`, clipped to [0, 1], encoded as sRGB in 8 bits [IEC
// 61966-2-1]. What is not a number becomes 0.
[[nodiscard]] std::vector<std::uint8_t> to_srgb8(const Image& image, double exposure);

// By the image library: without one they throw InputError, which says so. Whole files are made in memory, since the
// library does not tell of a disk that fills up as it closes a file. `shown` is the name for errors.
// Read: `bytes`, if any, in place of the file's; `straight_alpha`: colours are not multiplied by it.
struct LibrarySource {
    std::filesystem::path path;
    std::string_view bytes = {};
    bool straight_alpha = false;
};
[[nodiscard]] Image read_with_library(const LibrarySource& source, std::uint64_t limit);
[[nodiscard]] Image read_words_with_library(const std::filesystem::path& path, std::uint64_t limit);
[[nodiscard]] std::string exr_bytes(const Image& image, const std::filesystem::path& shown);
[[nodiscard]] std::string srgb8_png_bytes(const std::vector<std::uint8_t>& pixels, std::uint32_t width,
    std::uint32_t height, const std::filesystem::path& shown);
// The first three channels, from 0 to 1, encoded as sRGB in 16 bits.
[[nodiscard]] std::string srgb16_png_bytes(const Image& image, const std::filesystem::path& shown);
// An .exr file of tiles, written to an open file; `header` has no pixels.
[[nodiscard]] std::unique_ptr<ImageTiles> exr_tiles(
    int descriptor, const Image& header, const std::filesystem::path& shown);
// A file that is read in bands of rows.
[[nodiscard]] std::unique_ptr<ImageBands> bands_with_library(const std::filesystem::path& path);
[[nodiscard]] bool has_library();
void require_library(const std::filesystem::path& path);  // loads it now

// The same as a table of functions, in a module of its own (oiio/module.cpp) which image_io_library.cpp loads.
struct ImageLibrary {
    Image (*read)(const LibrarySource& source, std::uint64_t limit);
    Image (*read_words)(const std::filesystem::path& path, std::uint64_t limit);
    std::string (*exr_bytes)(const Image& image, const std::filesystem::path& shown);
    std::string (*srgb8_png_bytes)(const std::vector<std::uint8_t>& pixels, std::uint32_t width, std::uint32_t height,
        const std::filesystem::path& shown);
    std::string (*srgb16_png_bytes)(const Image& image, const std::filesystem::path& shown);
    std::unique_ptr<ImageTiles> (*exr_tiles)(int descriptor, const Image& header, const std::filesystem::path& shown);
    std::unique_ptr<ImageBands> (*bands)(const std::filesystem::path& path);
};

inline constexpr const char* image_module_file = "libtandem_images.so";
inline constexpr const char* image_module_name = "tandem_image_module";  // const ImageLibrary*(*)()

}  // namespace tandem::image_files
