#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

#include "common/at_once.h"

namespace tandem {
namespace {

TEST_CASE("at once: every piece is done once, by however many threads") {
    for (const std::size_t threads : {0, 1, 3, 64}) {
        CAPTURE(threads);
        std::vector<std::atomic<int>> done(17);
        at_once(done.size(), threads, [&](std::size_t i) { ++done[i]; });
        for (const std::atomic<int>& times : done) CHECK(times == 1);
    }
    at_once(0, 4, [](std::size_t) { FAIL("there is no piece"); });
}

TEST_CASE("at once: an exception ends it, and is thrown where all began") {
    for (const std::size_t threads : {1, 4}) {
        CAPTURE(threads);
        std::atomic<int> begun = 0;
        const auto work = [&](std::size_t i) {
            ++begun;
            if (i == 3) throw std::runtime_error("the fourth");
        };
        CHECK_THROWS_WITH_AS(at_once(100, threads, work), "the fourth", std::runtime_error);
        if (threads == 1) CHECK(begun == 4);  // others may begin some before the exception is seen
    }
}

}  // namespace
}  // namespace tandem
