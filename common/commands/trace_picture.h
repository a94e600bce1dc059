// Traced paths as a drawing, for tandem trace --svg.
#pragma once

#include <string>
#include <vector>

#include "common/render/path_trace.h"
#include "common/render/renderer.h"

namespace tandem {

struct DrawnPath {
    std::string name;  // of the backend
    const PathTrace* path = nullptr;
};

// An SVG document of two panels. One shows the scene from above (x to the right, z down). The other shows it as the
// camera sees it through its lens's middle (MODEL.md section 4). Bodies are outlines, as they stand at the shutter's
// opening.
[[nodiscard]] std::string trace_picture(const Scene& scene, const RenderSettings& settings, const std::string& title,
    const std::vector<std::uint32_t>& pixel, const std::vector<DrawnPath>& paths);

}  // namespace tandem
