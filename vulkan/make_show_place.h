// The function that opens a window to present in, for code that does not know the window library.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace tandem {

class ShowPlace;  // vulkan/resources/show_place.h

// Opens a window of so many pixels. Throws DeviceError, with the reason, where there is no display.
using MakeShowPlace = std::function<std::shared_ptr<ShowPlace>(std::uint32_t width, std::uint32_t height)>;

}  // namespace tandem
