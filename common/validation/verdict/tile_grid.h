// Divides an image into tiles with edges of about a given length. If the length does not divide the image, all tiles
// are made a little larger or smaller, so that none has only few samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tandem {

// Pixels x0 <= x < x1, y0 <= y < y1.
struct Rectangle {
    std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

class TileGrid {
public:
    // edge 0: the whole image is one tile.
    TileGrid(std::uint32_t width, std::uint32_t height, std::uint32_t edge);

    [[nodiscard]] std::uint32_t columns() const { return columns_; }
    [[nodiscard]] std::uint32_t rows() const { return rows_; }
    [[nodiscard]] std::size_t size() const { return std::size_t{columns_} * rows_; }
    [[nodiscard]] Rectangle rectangle(std::size_t tile) const;
    // Tile of each pixel, in the order of pixels.
    [[nodiscard]] const std::vector<std::uint32_t>& tile_of_pixel() const { return tile_of_pixel_; }

private:
    std::uint32_t width_, height_, columns_, rows_;
    std::vector<std::uint32_t> tile_of_pixel_;
};

}  // namespace tandem
