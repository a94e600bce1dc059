#include "common/commands/console.h"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <ctime>

namespace tandem {

ProgressLine::ProgressLine() : terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
    if (drawn_) fmt::print(stderr, "\r\033[K");
}

void ProgressLine::update(double fraction, const std::string& text) {
    const Clock::time_point now = Clock::now();
    if (!terminal_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double done = std::clamp(fraction, 0.0, 1.0);
    std::string left = "estimating";
    if (done > 0.0 && elapsed > 0.5) {
        const long seconds = static_cast<long>(elapsed * (1.0 - done) / done + 0.5);
        left = fmt::format("{}:{:02} left", seconds / 60, seconds % 60);
    }
    fmt::print(stderr, "\r\033[K{:3.0f} %  {}  {}", 100.0 * done, left, text);
    std::fflush(stderr);
}

InterruptWatch::InterruptWatch() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    thread_ = std::jthread([this, signals, source = source_](std::stop_token ending) mutable {
        constexpr timespec poll{0, 100'000'000};  // how late the watch may notice that it is to end
        constexpr std::chrono::seconds same_wish{1};
        std::chrono::steady_clock::time_point first;
        while (!ending.stop_requested()) {
            const int caught = sigtimedwait(&signals, nullptr, &poll);
            if (caught < 0) continue;
            const auto now = std::chrono::steady_clock::now();
            if (source.stop_requested() || nothing_to_keep_ > 0) {
                if (source.stop_requested() && now - first < same_wish) continue;
                std::signal(caught, SIG_DFL);
                pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
                std::raise(caught);
            }
            first = now;
            source.request_stop();
        }
    });
}

}  // namespace tandem
