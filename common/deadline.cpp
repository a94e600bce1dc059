#include "common/deadline.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace tandem {

namespace {

constexpr double most_seconds = 1e9;  // decades: more would overflow the clock

void request_after(std::stop_source source, double seconds, const std::stop_token& ending) {
    const auto when =
        std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                               std::chrono::duration<double>(std::clamp(seconds, 0.0, most_seconds)));
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

}  // namespace tandem
