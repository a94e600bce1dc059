// Devices with the least limits that Vulkan guarantees, played by the machine's own (limits_layer/).
#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tandem::testing {

struct LeastLimits {
    std::uint32_t storage_buffers = 4;       // that a stage may see
    std::uint32_t storage_bytes = 1u << 27;  // that it may see of one
    std::uint32_t bound_sets = 4;
};

// Variables of the environment that return to what they were.
class ScopedVariables {
public:
    ScopedVariables() = default;
    ~ScopedVariables() {
        for (const auto& [name, value] : before_)
            if (value)
                ::setenv(name.c_str(), value->c_str(), 1);
            else
                ::unsetenv(name.c_str());
    }
    ScopedVariables(const ScopedVariables&) = delete;
    ScopedVariables& operator=(const ScopedVariables&) = delete;

    void set(const std::string& name, const std::string& value) {
        const char* old = std::getenv(name.c_str());
        before_.emplace_back(name, old == nullptr ? std::nullopt : std::optional<std::string>(old));
        ::setenv(name.c_str(), value.c_str(), 1);
    }

private:
    std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

// While it lives, instances that are made see devices with these limits. The validation layer, where it is wanted, is
// above: it holds the program to them.
class FewBuffers {
public:
    explicit FewBuffers(const LeastLimits& limits, bool validation = false) {
        // The loader puts layers that it finds later below.
        variables_.set("VK_LAYER_PATH", "/usr/share/vulkan/explicit_layer.d:" TANDEM_BINARY_DIR "/layers");
        variables_.set("VK_INSTANCE_LAYERS",
            std::string(validation ? "VK_LAYER_KHRONOS_validation:" : "") + "VK_LAYER_TANDEM_limits");
        variables_.set("TANDEM_STORAGE_BUFFERS", std::to_string(limits.storage_buffers));
        variables_.set("TANDEM_STORAGE_BYTES", std::to_string(limits.storage_bytes));
        variables_.set("TANDEM_BOUND_SETS", std::to_string(limits.bound_sets));
    }

private:
    ScopedVariables variables_;
};

}  // namespace tandem::testing
