// What `tandem render` prints and writes about a finished render.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "common/commands/render_arguments.h"

namespace tandem {

// What the image file says of itself, and most of what --json says.
[[nodiscard]] nlohmann::json describe(const RenderArguments& arguments, const RenderSettings& settings,
    const RendererInfo& info, const Scene& scene, const StoppedRender& result);

// The same as the file has it: "tandem:seed", "7".
[[nodiscard]] std::map<std::string, std::string> metadata_of(const nlohmann::json& report);

// The scatter of a pixel's Sobol samples says nothing of the error of their mean (MODEL.md section 3.2).
[[nodiscard]] inline bool independent(const RenderSettings& settings) { return settings.generator != Generator::sobol; }

// ", error 5 % of the mean"; empty where there is none.
[[nodiscard]] std::string error_text(const StoppedRender& result);

}  // namespace tandem
