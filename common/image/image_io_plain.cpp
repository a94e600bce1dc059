// In place of image_io_library.cpp where TANDEM_IMAGE_IO is off: only PFM is left, and everything else says why.
#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem::image_files {

namespace {

InputError no_library(const std::filesystem::path& path) {
    return input_error(path.string(), "", "this program was built without OpenImageIO and knows .pfm images only",
        "build with TANDEM_IMAGE_IO=ON");
}

}  // namespace

bool has_library() { return false; }

void require_library(const std::filesystem::path& path) { throw no_library(path); }

Image read_with_library(const LibrarySource& source, std::uint64_t) { throw no_library(source.path); }

Image read_words_with_library(const std::filesystem::path& path, std::uint64_t) { throw no_library(path); }

std::string exr_bytes(const Image&, const std::filesystem::path& shown) { throw no_library(shown); }

std::string srgb8_png_bytes(
    const std::vector<std::uint8_t>&, std::uint32_t, std::uint32_t, const std::filesystem::path& shown) {
    throw no_library(shown);
}

std::string srgb16_png_bytes(const Image&, const std::filesystem::path& shown) { throw no_library(shown); }

std::unique_ptr<ImageTiles> exr_tiles(int, const Image&, const std::filesystem::path& shown) {
    throw no_library(shown);
}

std::unique_ptr<ImageBands> bands_with_library(const std::filesystem::path& path) { throw no_library(path); }

}  // namespace tandem::image_files
