#include "vulkan/renderer/kernels/kernel_shape.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "common/error.h"

namespace tandem {

namespace {

constexpr std::array<std::string_view, 9> names{"stages", "megakernel", "image-stages", "fragment", "ray-tracing",
    "thesis", "ray-tracing-triangles", "ray-query", "ray-query-triangles"};

}  // namespace

std::optional<KernelShape> kernel_shape(const std::string& name) {
    if (name.empty()) return std::nullopt;
    const auto found = std::ranges::find(names, name);
    if (found != names.end()) return static_cast<KernelShape>(found - names.begin());
    std::string known;
    for (const std::string_view one : names) known += (known.empty() ? "" : ", ") + std::string(one);
    throw InputError("--kernel: no kernel shape '" + name + "'; choose one of " + known);
}

// A CPU has no registers to spare, and its caches serve the queues of the stages.
KernelShape fastest_shape(DeviceType device) {
    return device == DeviceType::cpu ? KernelShape::stages : KernelShape::megakernel;
}

}  // namespace tandem
