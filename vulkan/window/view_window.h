// The window of `tandem view`.
#pragma once

#include "common/view/window.h"

namespace tandem {

// As ShowWindow says.
[[nodiscard]] WindowReport show_in_window(
    ViewSession& session, const WindowOptions& options, const std::stop_token& stop);

}  // namespace tandem
