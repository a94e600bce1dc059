#include "common/image/image_io.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "common/error.h"
#include "common/files/write_file.h"
#include "common/image/image_io_parts.h"

namespace tandem {

namespace image_files {

std::string ending(const std::filesystem::path& path) {
    std::string text = path.extension().string();
    std::ranges::transform(text, text.begin(),
        [](unsigned char c) { return c < 0x80 ? static_cast<char>(std::tolower(c)) : static_cast<char>(c); });
    return text;
}

void require_regular_file(const std::filesystem::path& path) {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found)
        throw input_error(path.string(), "", "no such file", "check the path");
    if (error)
        throw input_error(path.string(), "", "cannot be reached (" + error.message() + ")", "check its permissions");
    if (status.type() != std::filesystem::file_type::regular)
        throw input_error(path.string(), "", "is not a regular file", "name an image file");
    if (::access(path.c_str(), R_OK) != 0)
        throw input_error(path.string(), "", "cannot be opened", "check its permissions");
}

std::vector<std::uint8_t> to_srgb8(const Image& image, double exposure) {
    const std::size_t channels = image.channels.size();
    std::vector<std::uint8_t> bytes;
    bytes.reserve(std::size_t{image.width} * image.height * 3);
    for (std::size_t pixel = 0; pixel < std::size_t{image.width} * image.height; ++pixel)
        for (std::size_t c = 0; c < 3; ++c) {
            const double linear = image.pixels[pixel * channels + (channels < 3 ? 0 : c)] * exposure;
            const double clipped = linear > 0.0 ? std::min(linear, 1.0) : 0.0;
            const double encoded =
                clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1.0 / 2.4) - 0.055;
            bytes.push_back(static_cast<std::uint8_t>(std::lround(255.0 * encoded)));
        }
    return bytes;
}

}  // namespace image_files

namespace {

using namespace image_files;

void require_consistent(const Image& image) {
    const std::size_t size = std::size_t{image.width} * image.height;
    if (size == 0 || image.channels.empty() || image.pixels.size() != size * image.channels.size() ||
        image.words.size() != size * image.word_channels.size())
        throw Error("an image's pixels do not fit its size and channels");
}

}  // namespace

void check_image_ending(const std::filesystem::path& path) {
    const std::string found = ending(path);
    if (found == ".pfm") return;
    if (found != ".exr" && found != ".png")
        throw input_error(path.string(), "", "unknown kind of image \"" + found + "\"",
            has_library() ? "end the name in .exr, .png or .pfm" : "end the name in .pfm");
    if (!has_library())
        throw input_error(path.string(), "",
            "this program was built without OpenImageIO and writes no " + found + " files",
            "end the name in .pfm, or build with TANDEM_IMAGE_IO=ON");
    require_library(path);
}

namespace {

Image read_any(const image_files::LibrarySource& source, std::uint64_t limit) {
    const std::string kind = source.bytes.empty() ? ending(source.path) : "";
    if (source.bytes.empty()) require_regular_file(source.path);
    Image image = kind == ".pfm"   ? read_pfm(source.path, limit)
                  : kind == ".npy" ? read_npy(source.path, limit)
                                   : read_with_library(source, limit);
    if (image.full_width == 0 || image.full_height == 0) {
        image.full_x = image.data_x;
        image.full_y = image.data_y;
        image.full_width = image.width;
        image.full_height = image.height;
    }
    return image;
}

}  // namespace

Image read_image(const std::filesystem::path& path, std::uint64_t limit) { return read_any({path}, limit); }

Image read_texture_image(const std::filesystem::path& path, std::string_view bytes, std::uint64_t limit) {
    return read_any({path, bytes, true}, limit);
}

Image read_image_words(const std::filesystem::path& path, std::uint64_t limit) {
    require_regular_file(path);
    return read_words_with_library(path, limit);
}

void write_image(const std::filesystem::path& path, const Image& image, const FilesRead& read) {
    require_consistent(image);
    check_image_ending(path);
    if (is_png(path))
        throw input_error(
            path.string(), "", "a .png file cannot hold these floating-point channels", "end the name in .exr");
    if (ending(path) != ".exr" && !image.words.empty())
        throw input_error(path.string(), "", "only an .exr file holds sums exactly", "end the name in .exr");
    ReplacementFile(path).commit(ending(path) == ".exr" ? exr_bytes(image, path) : pfm_bytes(image), read);
}

bool is_png(const std::filesystem::path& path) { return ending(path) == ".png"; }
bool is_exr(const std::filesystem::path& path) { return ending(path) == ".exr"; }

void write_png(const std::filesystem::path& path, const Image& image, double exposure, const FilesRead& read) {
    require_consistent(image);
    check_image_ending(path);
    if (!is_png(path)) throw input_error(path.string(), "", "an 8-bit picture is a .png file", "end the name in .png");
    ReplacementFile(path).commit(srgb8_png_bytes(to_srgb8(image, exposure), image.width, image.height, path), read);
}

Image image_of(const FilmMoments& film, const std::map<std::string, std::string>& metadata, bool independent) {
    Image image;
    image.width = film.width;
    image.height = film.height;
    image.full_width = image.width;
    image.full_height = image.height;
    image.channels = {"R", "G", "B"};
    if (independent) image.channels.insert(image.channels.end(), {"variance.R", "variance.G", "variance.B", "count"});
    image.metadata = metadata;
    const std::vector<double> mean = mean_of(film), variance = variance_of(film);
    image.pixels.reserve(film.pixel_count() * image.channels.size());
    for (std::size_t first = 0; first < mean.size(); first += 3) {
        for (std::size_t c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(mean[first + c]));
        if (!independent) continue;
        for (std::size_t c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(variance[first + c]));
        image.pixels.push_back(static_cast<float>(film.counts[first / 3]));
    }
    return image;
}

}  // namespace tandem
