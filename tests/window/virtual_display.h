// A virtual display (Xvfb) for the time of its life: DISPLAY names it.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace tandem::testing {

class VirtualDisplay {
public:
    VirtualDisplay();
    ~VirtualDisplay();
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

    [[nodiscard]] bool there() const { return there_; }  // false: Xvfb is not installed

private:
    pid_t process_ = -1;
    bool there_ = false;
    std::optional<std::string> before_;
};

}  // namespace tandem::testing
