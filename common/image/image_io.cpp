#include "common/image/image_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <random>
#include <system_error>
#include <utility>

#include "common/error.h"
#include "common/image/image_io_parts.h"

namespace tandem {

namespace image_files {

namespace {

// Where a link leads, so that the link itself survives the replacement.
std::filesystem::path resolved(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path real = std::filesystem::canonical(path, error);
    return error ? path : real;
}

// From errno.
InputError not_written(const std::filesystem::path& path) {
    return input_error(path.string(), "", fmt::format("cannot be written to its end ({})", std::strerror(errno)),
        "make room on its disk, or choose another folder");
}

void write_all(int descriptor, std::string_view bytes, const std::filesystem::path& shown) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) throw not_written(shown);
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

}  // namespace

bool Descriptor::close() { return descriptor_ < 0 || ::close(std::exchange(descriptor_, -1)) == 0; }

ReplacementFile::ReplacementFile(const std::filesystem::path& target) : target_(resolved(target)) {
    std::error_code error;
    const auto status = std::filesystem::status(target_, error);
    if (status.type() == std::filesystem::file_type::directory)
        throw input_error(target.string(), "", "is a folder", "name a file");
    if (std::filesystem::exists(status) && status.type() != std::filesystem::file_type::regular)
        throw input_error(target.string(), "", "is not a regular file", "name a regular file");
    std::random_device random;
    for (int attempt = 0;; ++attempt) {
        const std::string name =
            fmt::format(".{}.{:08x}{}", target_.stem().string(), random(), target_.extension().string());
        temporary_ = target_.parent_path() / name;
        file_ = Descriptor(::open(temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
        if (file_.get() >= 0) return;
        constexpr int attempts = 100;  // names already taken, by chance or by files left behind
        if (errno == EEXIST && attempt < attempts) continue;
        throw input_error(target.string(), "", std::string("cannot be written (") + std::strerror(errno) + ")",
            errno == ENOENT ? "create the folder first" : "choose a folder that can be written");
    }
}

ReplacementFile::~ReplacementFile() {
    std::error_code ignored;  // after commit() there is nothing to remove
    std::filesystem::remove(temporary_, ignored);
}

void ReplacementFile::commit(std::string_view bytes) {
    write_all(file_.get(), bytes, target_);
    // Space may run out, and a disk fail, as late as here: only then is the old content given up. Some file systems
    // have nothing to synchronise and say so.
    if (::fsync(file_.get()) != 0 && errno != EINVAL && errno != ENOTSUP && errno != EROFS) throw not_written(target_);
    if (!file_.close()) throw not_written(target_);
    std::error_code error;
    std::filesystem::rename(temporary_, target_, error);
    if (error)
        throw input_error(target_.string(), "", "cannot be replaced (" + error.message() + ")",
            "choose a folder that can be written");
}

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
    if (image.width == 0 || image.height == 0 || image.channels.empty() ||
        image.pixels.size() != std::size_t{image.width} * image.height * image.channels.size())
        throw Error("an image's pixels do not fit its size and channels");
}

void write_stream(const std::filesystem::path& path, std::string_view bytes) {
    Descriptor stream(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (stream.get() < 0) throw not_written(path);
    write_all(stream.get(), bytes, path);
    if (!stream.close()) throw not_written(path);
}

// Pipes and devices (/dev/stdout) have no old content to keep, and cannot be replaced.
bool is_stream(const std::filesystem::path& path) {
    std::error_code error;
    const auto type = std::filesystem::status(path, error).type();
    return type == std::filesystem::file_type::fifo || type == std::filesystem::file_type::character;
}

void require_known_ending(const std::filesystem::path& path) {
    const std::string found = ending(path);
    if (found == ".pfm") return;
    if (found != ".exr" && found != ".png")
        throw input_error(path.string(), "", "unknown kind of image \"" + found + "\"",
            has_library() ? "end the name in .exr, .png or .pfm" : "end the name in .pfm");
    if (!has_library())
        throw input_error(path.string(), "",
            "this program was built without OpenImageIO and writes no " + found + " files",
            "end the name in .pfm, or build with TANDEM_IMAGE_IO=ON");
}

}  // namespace

namespace {

Image read_any(const image_files::LibrarySource& source, std::uint64_t limit) {
    const bool plain = source.bytes.empty() && ending(source.path) == ".pfm";
    if (source.bytes.empty()) require_regular_file(source.path);
    Image image = plain ? read_pfm(source.path, limit) : read_with_library(source, limit);
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

void write_image(const std::filesystem::path& path, const Image& image) {
    require_consistent(image);
    require_known_ending(path);
    if (is_png(path))
        throw input_error(
            path.string(), "", "a .png file cannot hold these floating-point channels", "end the name in .exr");
    ReplacementFile(path).commit(ending(path) == ".exr" ? exr_bytes(image, path) : pfm_bytes(image));
}

bool is_png(const std::filesystem::path& path) { return ending(path) == ".png"; }

void write_png(const std::filesystem::path& path, const Image& image, double exposure) {
    require_consistent(image);
    require_known_ending(path);
    if (!is_png(path)) throw input_error(path.string(), "", "an 8-bit picture is a .png file", "end the name in .png");
    ReplacementFile(path).commit(srgb8_png_bytes(to_srgb8(image, exposure), image.width, image.height, path));
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

void check_writable_image(const std::filesystem::path& path) {
    require_known_ending(path);
    const ReplacementFile probe(path);  // made and removed
}

void check_writable_text(const std::filesystem::path& path) {
    if (!is_stream(path)) const ReplacementFile probe(path);
}

void check_writable_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw input_error(folder.string(), "", "cannot be made: " + error.message(), "choose another folder");
    const ReplacementFile probe(folder / "probe");
}

void write_text_file(const std::filesystem::path& path, const std::string& text) {
    if (is_stream(path))
        write_stream(path, text);
    else
        ReplacementFile(path).commit(text);
}

}  // namespace tandem
