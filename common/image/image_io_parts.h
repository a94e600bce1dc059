// What the sources of image_io share and nobody else needs: files that appear whole or not at all, and the formats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/image/image_io.h"

namespace tandem::image_files {

// An empty file beside `target`, which takes its place on commit() and vanishes otherwise. The name keeps the target's
// ending, by which writers choose a format. A link is followed: what it points to is replaced.
class ReplacementFile {
public:
    // Throws InputError when the folder is not there or not writable, or the target is a folder or a device.
    explicit ReplacementFile(const std::filesystem::path& target);
    ~ReplacementFile();
    ReplacementFile(const ReplacementFile&) = delete;
    ReplacementFile& operator=(const ReplacementFile&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return temporary_; }
    void commit();  // throws InputError

private:
    std::filesystem::path target_, temporary_;
};

// The file ending in lower case, ".exr".
[[nodiscard]] std::string ending(const std::filesystem::path& path);

// Throws InputError unless `path` is a regular file.
void require_regular_file(const std::filesystem::path& path);

// Portable float map: three channels, or one, as it is; no metadata, no windows, no declared colour space.
[[nodiscard]] Image read_pfm(const std::filesystem::path& path, std::uint64_t limit);
void write_pfm(const std::filesystem::path& path, const Image& image, const std::filesystem::path& shown);

// The first three channels (a single one thrice) times `exposure`, clipped to [0, 1], encoded as sRGB in 8 bits
// [IEC 61966-2-1]; what is not a number becomes 0.
[[nodiscard]] std::vector<std::uint8_t> to_srgb8(const Image& image, double exposure);

// Writers put the pixels at `path` and name `shown` in their errors.
// What the image library does; without one they throw InputError, which says so.
[[nodiscard]] Image read_with_library(const std::filesystem::path& path, std::uint64_t limit);
void write_exr(const std::filesystem::path& path, const Image& image, const std::filesystem::path& shown);
void write_srgb8_png(const std::filesystem::path& path, const std::vector<std::uint8_t>& pixels, std::uint32_t width,
    std::uint32_t height, const std::filesystem::path& shown);
[[nodiscard]] bool has_library();

}  // namespace tandem::image_files
