// Wall clock time, by a clock that never goes back.
#pragma once

#include <chrono>

namespace tandem {

// Seconds since a moment that stays the same while the program runs.
[[nodiscard]] inline double steady_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Runs from the moment that it is made.
class Stopwatch {
public:
    [[nodiscard]] double seconds() const { return steady_seconds() - start_; }

private:
    double start_ = steady_seconds();
};

}  // namespace tandem
