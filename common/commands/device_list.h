// Several devices as one renderer: what --device of render and verify names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/commands/command.h"

namespace tandem {

// `options.device` may be "all", or several devices between commas, the word cpu among them. Each Vulkan device first
// renders `scene` for a moment beside the CPU, in a process of its own, with the options `words`. One that disagrees,
// fails or hangs is left out, which is told on stderr. Throws DeviceError where none is left.
[[nodiscard]] std::unique_ptr<Renderer> renderer_on(const std::string& backend, const BackendOptions& options,
    const std::string& scene, const std::vector<std::string>& words, const CommandContext& context);

// Whether --device names several, or all.
[[nodiscard]] bool is_device_list(const std::string& list);
// Their names, where "all" stands for each that is suitable. Throws InputError.
[[nodiscard]] std::vector<std::string> devices_named(const std::string& list, const CommandContext& context);

}  // namespace tandem
