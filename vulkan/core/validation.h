// The Khronos validation layer with core, synchronisation and queue-submit checks. Its messages are collected, then
// thrown.
#pragma once

#include <mutex>
#include <string>
#include <vector>

namespace tandem {

// Messages of the layer, warnings and errors. The layer may call from any thread.
class ValidationLog {
public:
    void add(std::string message);
    [[nodiscard]] std::vector<std::string> take();
    // Throws Error with all messages since the last call, if there are any.
    void raise();

private:
    std::mutex mutex_;
    std::vector<std::string> messages_;
};

// Whether the options or the environment (TANDEM_VALIDATION=1) ask for validation.
[[nodiscard]] bool validation_wanted(bool option);

}  // namespace tandem
