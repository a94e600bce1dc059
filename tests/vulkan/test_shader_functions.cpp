// Single shader functions on the device against the host.
#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/render/random.h"
#include "moments_probe.h"
#include "random_probe.h"
#include "tests/vulkan/probe.h"
#include "turn_probe.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

std::vector<std::uint32_t> philox_on_device(const std::vector<std::uint32_t>& addresses) {
    const std::size_t count = addresses.size() / 8;
    return run_probe(random_probe_code, addresses, 4 * count, static_cast<std::uint32_t>(count));
}

// Words of any bits, by the host's generator.
std::uint32_t word(std::uint32_t i, std::uint32_t k) { return random_block(99, i, k, 7)[0]; }

}  // namespace

TEST_CASE("the device's Philox4x32-10 gives the published known answers") {
    const std::uint32_t ones = 0xffffffff;
    const std::vector<std::uint32_t> addresses{0, 0, 0, 0, 0, 0, 0, 0, ones, ones, ones, ones, ones, ones, 0, 0,
        0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0, 0, 0};
    const std::vector<std::uint32_t> answers{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8, 0x408f276d, 0x41c83b0e,
        0xa20bc7c6, 0x6d5451fd, 0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1};
    CHECK(philox_on_device(addresses) == answers);
}

TEST_CASE("the device's Philox4x32-10 equals the host's for 100 000 counters and keys") {
    std::vector<std::uint32_t> addresses, answers;
    for (std::uint32_t i = 0; i < 100'000; ++i) {
        const std::array<std::uint32_t, 6> a{word(i, 0), word(i, 1), word(i, 2), word(i, 3), word(i, 4), word(i, 5)};
        addresses.insert(addresses.end(), a.begin(), a.end());
        addresses.insert(addresses.end(), {0, 0});
        const RandomBlock block = philox4x32_10({a[0], a[1], a[2], a[3]}, {a[4], a[5]});
        answers.insert(answers.end(), block.begin(), block.end());
    }
    CHECK(philox_on_device(addresses) == answers);
}

TEST_CASE("cosine and sine on the device are within 2 ulp of 1") {
    // Every 97th number that the generator can give, and the ends of the octants with their neighbours.
    std::vector<std::uint32_t> turns;
    const auto add = [&](std::uint32_t k) {
        turns.push_back(std::bit_cast<std::uint32_t>(static_cast<float>(k) * 0x1p-24f));
    };
    for (std::uint32_t k = 0; k < 1u << 24; k += 97) add(k);
    for (std::uint32_t octant = 0; octant < 8; ++octant)
        for (const std::uint32_t k : {octant << 21, (octant << 21) + 1, ((octant + 1) << 21) - 1}) add(k);
    const std::vector<std::uint32_t> results =
        run_probe(turn_probe_code, turns, 2 * turns.size(), static_cast<std::uint32_t>(turns.size()));
    double worst = 0.0;
    for (std::size_t i = 0; i < turns.size(); ++i) {
        const double angle = 2.0 * std::numbers::pi * std::bit_cast<float>(turns[i]);
        worst = std::max(worst, std::abs(std::bit_cast<float>(results[2 * i]) - std::cos(angle)));
        worst = std::max(worst, std::abs(std::bit_cast<float>(results[2 * i + 1]) - std::sin(angle)));
    }
    MESSAGE("greatest error: ", worst / 0x1p-23, " ulp of 1");
    CHECK(worst <= 2.0 * 0x1p-23);
}

TEST_CASE("sums of 64 samples and of their squares are as good as double's") {
    std::vector<std::uint32_t> samples;
    for (std::uint32_t i = 0; i < 1000 * 64; ++i) {
        // Magnitudes from 2^-12 to 2^11, as radiances with fireflies are.
        const float x = std::ldexp(to_unit<float>(word(i, 0)), static_cast<int>(word(i, 1) % 24) - 12);
        samples.push_back(std::bit_cast<std::uint32_t>(x));
    }
    const std::vector<std::uint32_t> results = run_probe(moments_probe_code, samples, 4 * 1000, 1000);
    double worst = 0.0;
    for (std::size_t i = 0; i < 1000; ++i) {
        long double sum = 0.0L, squares = 0.0L;
        for (std::size_t k = 0; k < 64; ++k) {
            const long double x = std::bit_cast<float>(samples[64 * i + k]);
            sum += x;
            squares += x * x;
        }
        std::array<float, 4> pair{};
        std::memcpy(pair.data(), &results[4 * i], sizeof pair);
        const long double device_sum = static_cast<long double>(pair[0]) + pair[1];
        const long double device_squares = static_cast<long double>(pair[2]) + pair[3];
        worst = std::max(worst, static_cast<double>(std::abs(device_sum / sum - 1.0L)));
        worst = std::max(worst, static_cast<double>(std::abs(device_squares / squares - 1.0L)));
    }
    MESSAGE("greatest relative error: ", worst);
    // Each of 64 additions of positive terms rounds a pair by at most 2 * 2^-48 of the running sum [Dekker 1971].
    CHECK(worst <= 64 * 2.0 * 0x1p-48);
}
