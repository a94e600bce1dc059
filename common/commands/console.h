// Terminal manners: a progress line with an estimate of the time left, and Ctrl-C as a stop request.
#pragma once

#include <atomic>
#include <chrono>
#include <stop_token>
#include <string>
#include <thread>

namespace tandem {

// One line on stderr, redrawn at most ten times a second, only where stderr is a terminal; erased on destruction.
class ProgressLine {
public:
    ProgressLine();
    ~ProgressLine();
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    // `fraction` in [0, 1] of the work is done; `text` says what is being done.
    void update(double fraction, const std::string& text);

private:
    using Clock = std::chrono::steady_clock;
    bool terminal_;
    bool drawn_ = false;
    Clock::time_point start_ = Clock::now(), last_{};
};

// While it lives, the first SIGINT or SIGTERM requests a stop; one that comes more than a second later ends the program
// at once (timeout(1) sends two, to the process and to its group). Make it before any other thread, so that all inherit
// the blocked signals.
class InterruptWatch {
public:
    InterruptWatch();
    [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

private:
    friend class NothingToKeep;
    std::stop_source source_;
    std::atomic<int> nothing_to_keep_ = 0;
    std::jthread thread_;
};

// While it lives, the first SIGINT or SIGTERM ends the program at once: scenes are loaded, or something else is at work
// that has no results yet and heeds no wish to stop.
class NothingToKeep {
public:
    explicit NothingToKeep(InterruptWatch& watch) : watch_(&watch) { ++watch_->nothing_to_keep_; }
    ~NothingToKeep() { end(); }
    NothingToKeep(const NothingToKeep&) = delete;
    NothingToKeep& operator=(const NothingToKeep&) = delete;
    // From now on there is.
    void end() {
        if (watch_ != nullptr) --watch_->nothing_to_keep_;
        watch_ = nullptr;
    }

private:
    InterruptWatch* watch_;
};

}  // namespace tandem
