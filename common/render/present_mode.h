// How images are handed to a screen.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem {

// VkPresentModeKHR. fifo: at each refresh one, none left out; every device has it. fifo_relaxed: a late one at once.
// mailbox: at each refresh the newest. immediate: at once, which may tear.
enum class PresentMode : std::uint32_t { fifo = 0, fifo_relaxed = 1, mailbox = 2, immediate = 3 };
inline constexpr std::array<std::string_view, 4> present_mode_names{"fifo", "fifo-relaxed", "mailbox", "immediate"};

}  // namespace tandem
