// What the sources of image_io share and nobody else needs: files that appear whole or not at all, and the formats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/image/image_io.h"

namespace tandem::image_files {

// An open file, closed at the end of its life; -1: none.
class Descriptor {
public:
    explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(descriptor_, other.descriptor_);
        return *this;
    }
    ~Descriptor() { (void)close(); }

    [[nodiscard]] int get() const { return descriptor_; }
    // As ::close tells it: false, and errno, where what was written did not reach the file.
    [[nodiscard]] bool close();

private:
    int descriptor_;
};

// An empty file beside `target`, which takes its place on commit() and vanishes otherwise. A link is followed: what it
// points to is replaced.
class ReplacementFile {
public:
    // Throws InputError when the folder is not there or not writable, or the target is a folder or a device.
    explicit ReplacementFile(const std::filesystem::path& target);
    ~ReplacementFile();
    ReplacementFile(const ReplacementFile&) = delete;
    ReplacementFile& operator=(const ReplacementFile&) = delete;

    // Writes `bytes` to the disk and gives them the target's name. Throws InputError, and then the target is as it was.
    void commit(std::string_view bytes);

private:
    std::filesystem::path target_, temporary_;
    Descriptor file_;
};

// The file ending in lower case, ".exr".
[[nodiscard]] std::string ending(const std::filesystem::path& path);

// Throws InputError unless `path` is a regular file.
void require_regular_file(const std::filesystem::path& path);

// Portable float map: three channels, or one, as it is; no metadata, no windows, no declared colour space.
[[nodiscard]] Image read_pfm(const std::filesystem::path& path, std::uint64_t limit);
[[nodiscard]] std::string pfm_bytes(const Image& image);

// The first three channels (a single one thrice) times `exposure`, clipped to [0, 1], encoded as sRGB in 8 bits
// [IEC 61966-2-1]; what is not a number becomes 0.
[[nodiscard]] std::vector<std::uint8_t> to_srgb8(const Image& image, double exposure);

// By the image library: without one they throw InputError, which says so. Whole files are made in memory, since the
// library does not tell of a disk that fills up as it closes a file; `shown` is the name for errors.
// Read: `bytes`, if any, in place of the file's; `straight_alpha`: colours are not multiplied by it.
struct LibrarySource {
    std::filesystem::path path;
    std::string_view bytes = {};
    bool straight_alpha = false;
};
[[nodiscard]] Image read_with_library(const LibrarySource& source, std::uint64_t limit);
[[nodiscard]] std::string exr_bytes(const Image& image, const std::filesystem::path& shown);
[[nodiscard]] std::string srgb8_png_bytes(const std::vector<std::uint8_t>& pixels, std::uint32_t width,
    std::uint32_t height, const std::filesystem::path& shown);
[[nodiscard]] bool has_library();

}  // namespace tandem::image_files
