// The Gaussian pixel filter's inverse in double on the device (MODEL.md section 4.1, rule 4), against the library's
// erf.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "pixel_filter_probe.h"
#include "tests/vulkan/probe.h"

using namespace tandem::testing;

TEST_CASE("in double the device's Gaussian pixel filter is met to 1e-11 pixels, and falls as the share beyond rises") {
    constexpr std::uint32_t count = 20'000;
    const double tail = 0.5 * std::erfc(3.0 / std::sqrt(2.0));
    std::vector<double> shares;
    std::vector<std::uint32_t> words;
    for (std::uint32_t i = 0; i < count; ++i) {
        shares.push_back(tail + (1.0 - 2.0 * tail) * 0.5 * i / (count - 1.0));
        const auto bits = std::bit_cast<std::uint64_t>(shares.back());
        words.push_back(static_cast<std::uint32_t>(bits));
        words.push_back(static_cast<std::uint32_t>(bits >> 32));
    }
    const std::vector<std::uint32_t> output = run_probe(pixel_filter_probe_code, words, 2 * count, count);
    double worst = 0.0, last = 2.0;
    bool falls = true;
    for (std::size_t i = 0; i < count; ++i) {
        const auto t = std::bit_cast<double>(output[2 * i] | std::uint64_t{output[2 * i + 1]} << 32);
        // The share beyond t, of a standard deviation of 1/2; the slope turns its error into one of t.
        const double slope = std::sqrt(2.0 / 3.14159265358979324) * std::exp(-2.0 * t * t);
        worst = std::max(worst, std::abs(0.5 * std::erfc(std::sqrt(2.0) * t) - shares[i]) / slope);
        falls = falls && t < last;
        last = t;
    }
    CAPTURE(worst);
    CHECK(worst < 1e-11);
    CHECK(falls);
}
