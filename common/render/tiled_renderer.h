// What a Renderer also is if it cuts images into tiles of pixels when they do not fit its device at once.
#pragma once

#include <cstdint>
#include <memory>

#include "common/render/renderer.h"

namespace tandem {

class TiledRenderer {
public:
    virtual ~TiledRenderer() = default;
    // As Renderer::prepare, with at most `tile_pixels` >= 1 pixels in flight at a time. The estimates are the same.
    [[nodiscard]] virtual std::unique_ptr<RenderJob> prepare_tiled(
        const Scene& scene, const RenderSettings& settings, std::uint32_t tile_pixels) = 0;
};

}  // namespace tandem
