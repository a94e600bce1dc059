// Who opens a window to present in, for those who need not know what windows are made of.
#pragma once

#include <functional>
#include <memory>

namespace tandem {

class ShowPlace;  // vulkan/resources/show_place.h

// Throws DeviceError, with the reason, where there is no display.
using MakeShowPlace = std::function<std::shared_ptr<ShowPlace>()>;

}  // namespace tandem
