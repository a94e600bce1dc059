// Stops that come in time, and what is done where nothing heeds them.
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>

#include "common/deadline.h"
#include "common/stopwatch.h"

namespace tandem {
namespace {

void wait(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

TEST_CASE("a stop that is not heeded is acted on after its grace, and not before") {
    std::stop_source stop;
    const Stopwatch watch;
    std::atomic<double> acted = 0.0;
    Unheeded unheeded(
        stop.get_token(), [] { return 0.2; }, [&] { acted = watch.seconds(); });
    wait(0.1);
    CHECK(acted == 0.0);
    const double asked = watch.seconds();
    stop.request_stop();
    while (acted == 0.0 && watch.seconds() < 20.0) wait(0.01);
    CHECK(acted >= asked + 0.2);
    CHECK(acted < 20.0);
}

TEST_CASE("what is done in time is not acted on, with a stop or without") {
    for (const bool stopped : {false, true}) {
        std::stop_source stop;
        std::atomic<bool> acted = false;
        {
            Unheeded unheeded(
                stop.get_token(), [] { return 3600.0; }, [&] { acted = true; });
            if (stopped) stop.request_stop();
            wait(0.1);
            unheeded.done();
        }
        CHECK_FALSE(acted);
    }
}

}  // namespace
}  // namespace tandem
