#include "vulkan/core/validation.h"

#include <cstdlib>
#include <string_view>
#include <utility>

#include "common/error.h"

namespace tandem {

void ValidationLog::add(std::string message) {
    const std::scoped_lock lock(mutex_);
    messages_.push_back(std::move(message));
}

std::vector<std::string> ValidationLog::take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(messages_, {});
}

void ValidationLog::raise() {
    std::string text;
    for (const std::string& message : take()) text += "\n  " + message;
    if (!text.empty()) throw Error("the Vulkan validation layer reports:" + text);
}

bool validation_wanted(bool option) {
    const char* value = std::getenv("TANDEM_VALIDATION");
    return option || (value != nullptr && std::string_view(value) == "1");
}

}  // namespace tandem
