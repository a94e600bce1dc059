// How images are handed to a screen.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem {

// VkPresentModeKHR.
// - fifo shows one image at each refresh and leaves none out. Every device has it.
// - fifo_relaxed shows a late image at once.
// - mailbox shows the newest image at each refresh.
// - immediate shows each image at once, which may tear.
enum class PresentMode : std::uint32_t { fifo = 0, fifo_relaxed = 1, mailbox = 2, immediate = 3 };
inline constexpr std::array<std::string_view, 4> present_mode_names{"fifo", "fifo-relaxed", "mailbox", "immediate"};

}  // namespace tandem
