#include "common/validation/verdict/tile_grid.h"

#include <algorithm>

namespace tandem {

namespace {

std::uint32_t tiles_along(std::uint32_t length, std::uint32_t edge) {
    return edge == 0 ? 1 : std::max(1u, (length + edge / 2) / edge);
}

std::uint32_t boundary(std::uint32_t index, std::uint32_t length, std::uint32_t count) {
    return static_cast<std::uint32_t>(std::uint64_t{index} * length / count);
}

}  // namespace

TileGrid::TileGrid(std::uint32_t width, std::uint32_t height, std::uint32_t edge)
    : width_(width), height_(height), columns_(tiles_along(width, edge)), rows_(tiles_along(height, edge)) {
    tile_of_pixel_.resize(std::size_t{width} * height);
    for (std::uint32_t tile = 0; tile < size(); ++tile) {
        const Rectangle r = rectangle(tile);
        for (std::uint32_t y = r.y0; y < r.y1; ++y)
            std::fill_n(tile_of_pixel_.begin() + std::ptrdiff_t{y} * width + r.x0, r.x1 - r.x0, tile);
    }
}

Rectangle TileGrid::rectangle(std::size_t tile) const {
    const auto column = static_cast<std::uint32_t>(tile % columns_), row = static_cast<std::uint32_t>(tile / columns_);
    return {boundary(column, width_, columns_), boundary(row, height_, rows_), boundary(column + 1, width_, columns_),
        boundary(row + 1, height_, rows_)};
}

}  // namespace tandem
