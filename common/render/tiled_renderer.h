// Interface of a Renderer that cuts images into tiles when they do not fit on its device.
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
