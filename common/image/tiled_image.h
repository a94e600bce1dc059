// Images larger than memory: an .exr file written tile by tile, and files read in bands of rows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/files/growing_file.h"
#include "common/image/image_io.h"

namespace tandem {

// Edge of the tiles in the file, pixels.
inline constexpr std::uint32_t image_tile_edge = 128;

struct PixelRectangle {
    std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // x0 <= x < x1
    [[nodiscard]] std::uint64_t pixel_count() const { return std::uint64_t{x1 - x0} * (y1 - y0); }
};

namespace image_files {

// What the image library does of it.
class ImageTiles {
public:
    virtual ~ImageTiles() = default;
    virtual void write(const PixelRectangle& place, std::span<const float> pixels) = 0;
    virtual void close() = 0;
};

class ImageBands {
public:
    virtual ~ImageBands() = default;
    [[nodiscard]] virtual const Image& header() const = 0;
    [[nodiscard]] virtual std::uint32_t height() const = 0;
    [[nodiscard]] virtual std::vector<float> read(std::uint32_t begin, std::uint32_t end) = 0;
};

}  // namespace image_files

// An .exr file of tiles that appears whole or not at all. It grows beside its place.
class TiledImageWriter {
public:
    // `header`: size, channels and metadata of an image of floats, without pixels. Throws InputError.
    TiledImageWriter(const std::filesystem::path& path, const Image& header);

    // Pixels of whole tiles, each channel of each, row by row. Tiles come row by row, from left to right. Throws
    // InputError where the disk is full.
    void write(const PixelRectangle& place, std::span<const float> pixels) { tiles_->write(place, pixels); }
    // After all tiles. Throws InputError.
    void commit(const FilesRead& read = {});

private:
    GrowingFile file_;
    std::unique_ptr<image_files::ImageTiles> tiles_;
};

// A file that is read in bands.
class BandedImage {
public:
    // Throws InputError.
    explicit BandedImage(const std::filesystem::path& path);

    // Size, channels and metadata, without pixels.
    [[nodiscard]] const Image& header() const { return bands_->header(); }
    // Rows of a band: what the file compresses together.
    [[nodiscard]] std::uint32_t band_height() const { return bands_->height(); }
    // Rows [begin, end) of all channels; `begin` is a multiple of band_height(), `end` one or the height. Throws
    // InputError, also for a file of several parts.
    [[nodiscard]] std::vector<float> read(std::uint32_t begin, std::uint32_t end) { return bands_->read(begin, end); }

private:
    std::unique_ptr<image_files::ImageBands> bands_;
};

}  // namespace tandem
