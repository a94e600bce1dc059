// A stop request that follows another one, or comes at a set time. Also what to do if nothing reacts to it.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "common/error.h"

namespace tandem {

// A stop came before anything was known.
class StoppedError : public Error {
public:
    using Error::Error;
};

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

// Calls `act` on a thread of its own, some seconds after a stop request, unless done() came first. It is for calls into
// drivers, which heed no request.
class Unheeded {
public:
    // `grace`: how many seconds, asked when the stop comes.
    Unheeded(const std::stop_token& stop, std::function<double()> grace, std::function<void()> act);
    ~Unheeded() { done(); }
    Unheeded(const Unheeded&) = delete;
    Unheeded& operator=(const Unheeded&) = delete;
    // Waits for `act` where that has begun.
    void done();

private:
    void watch(const std::stop_token& stop);

    std::function<double()> grace_;
    std::function<void()> act_;
    std::mutex mutex_;
    std::condition_variable_any wake_;
    bool done_ = false;
    std::jthread thread_;
};

}  // namespace tandem
