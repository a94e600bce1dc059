// A window in which benchmarks present.
#pragma once

#include "vulkan/make_show_place.h"

namespace tandem {

// As MakeShowPlace says.
[[nodiscard]] std::shared_ptr<ShowPlace> make_window_place(std::uint32_t width, std::uint32_t height);

}  // namespace tandem
