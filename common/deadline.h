// A stop request that comes with another one, or by itself at some time.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <thread>

namespace tandem {

// How far a command may run over the time that it was given: for what ends in no time, and for writing results.
[[nodiscard]] constexpr double with_overrun(double seconds) { return 1.05 * seconds + 0.5; }

class Deadline {
public:
    // Requests a stop when `stop` does, or after so many seconds; no number: only then.
    Deadline(const std::stop_token& stop, std::optional<double> seconds);
    Deadline(const Deadline&) = delete;
    Deadline& operator=(const Deadline&) = delete;

    [[nodiscard]] std::stop_token token() const { return source_.get_token(); }
    [[nodiscard]] bool passed() const { return source_.stop_requested(); }

private:
    std::stop_source source_;
    std::stop_callback<std::function<void()>> forward_;
    std::jthread thread_;
};

}  // namespace tandem
