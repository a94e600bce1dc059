#include "common/deadline.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace tandem {

namespace {

constexpr double most_seconds = 1e9;  // decades: more would overflow the clock

std::chrono::steady_clock::time_point from_now(double seconds) {
    return std::chrono::steady_clock::now() +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(
               std::chrono::duration<double>(std::clamp(seconds, 0.0, most_seconds)));
}

void request_after(std::stop_source source, double seconds, const std::stop_token& ending) {
    const auto when = from_now(seconds);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any wake;
    wake.wait_until(lock, ending, when, [] { return false; });
    if (!ending.stop_requested()) source.request_stop();
}

}  // namespace

Deadline::Deadline(const std::stop_token& stop, std::optional<double> seconds)
    : forward_(stop, [source = source_]() mutable { source.request_stop(); }) {
    if (seconds)
        thread_ = std::jthread([source = source_, seconds = *seconds](
                                   const std::stop_token& ending) { request_after(source, seconds, ending); });
}

Unheeded::Unheeded(const std::stop_token& stop, std::function<double()> grace, std::function<void()> act)
    : grace_(std::move(grace)), act_(std::move(act)), thread_([this, stop] { watch(stop); }) {}

void Unheeded::watch(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    constexpr std::chrono::milliseconds poll{50};
    while (!done_ && !stop.stop_requested()) wake_.wait_for(lock, poll);
    if (done_) return;
    if (!wake_.wait_until(lock, from_now(grace_()), [this] { return done_; })) act_();
}

void Unheeded::done() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    wake_.notify_all();
}

}  // namespace tandem
