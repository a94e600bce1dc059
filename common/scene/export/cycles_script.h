// scripts/adapters/cycles.py, as the build found it.
#pragma once

#include <string_view>

namespace tandem::scene_export {

extern const std::string_view cycles_script;

}  // namespace tandem::scene_export
