// Bias in tiles: a leak of light is great in one, and nothing in the image's mean.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "common/cost/regions.h"

namespace tandem {
namespace {

constexpr std::uint32_t edge = 48;  // three tiles of 16
constexpr std::size_t values = std::size_t{edge} * edge * channel_count;

CostReference white() {
    CostReference reference;
    reference.mean.assign(values, 1.0);
    reference.half_difference.assign(values, 0.0);
    reference.half_variance.assign(values, 1e-8);
    return reference;
}

// Replicates with deviations of 0.1, alike in the channels of a pixel, about `bias(x, y)`.
template <class Bias>
ArmTrials trials_of(const Bias& bias, std::uint64_t seed) {
    constexpr std::size_t replicates = 12;
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal(0.0, 0.1);
    ArmTrials trials;
    trials.replicates.resize(replicates);
    trials.sum.assign(values, 0.0);
    trials.sum_of_squares.assign(values, 0.0);
    for (std::size_t r = 0; r < replicates; ++r)
        for (std::uint32_t pixel = 0; pixel < edge * edge; ++pixel) {
            const double value = bias(pixel % edge, pixel / edge) + normal(engine);
            for (std::size_t c = 0; c < channel_count; ++c) {
                trials.sum[pixel * channel_count + c] += value;
                trials.sum_of_squares[pixel * channel_count + c] += value * value;
            }
        }
    return trials;
}

TEST_CASE("cost tiles: a bias that others make up for is found in its tile, with its size") {
    const auto leak = [](std::uint32_t x, std::uint32_t y) { return x >= 16 && x < 32 && y >= 32 ? 0.08 : -0.01; };
    const auto found = most_biased_tile(trials_of(leak, 1), white(), edge);
    REQUIRE(found);
    CHECK(found->x == 16);
    CHECK(found->y == 32);
    CHECK(found->relative.low < 0.08);
    CHECK(found->relative.high > 0.08);
    CHECK(found->relative.low > 0.07);
    CHECK(found->p < 1e-6);
}

TEST_CASE("cost tiles: without a bias one is seen no more often than 5 % of the time") {
    unsigned seen = 0, held = 0;
    constexpr unsigned trials = 100;
    for (unsigned seed = 0; seed < trials; ++seed) {
        const auto found = most_biased_tile(trials_of([](auto, auto) { return 0.0; }, seed), white(), edge);
        REQUIRE(found);
        seen += found->p < 0.05 ? 1 : 0;
        held += found->relative.low <= 0.0 && found->relative.high >= 0.0 ? 1 : 0;
    }
    CHECK(seen <= 12);  // more by chance once in a thousand times
    CHECK(seen + held == trials);
}

TEST_CASE("cost tiles: a black tile is relative to a hundredth of the image, and one tile says nothing") {
    CostReference reference = white();
    for (std::uint32_t pixel = 0; pixel < edge * edge; ++pixel)
        if (pixel % edge < 16 && pixel / edge < 16)
            for (std::size_t c = 0; c < channel_count; ++c) reference.mean[pixel * channel_count + c] = 0.0;
    const auto leak = [](std::uint32_t x, std::uint32_t y) { return x < 16 && y < 16 ? 0.08 : 0.0; };
    const auto found = most_biased_tile(trials_of(leak, 3), reference, edge);
    REQUIRE(found);
    CHECK(found->x + found->y == 0);
    CHECK(found->relative.value == doctest::Approx(0.08 / (0.01 * 8.0 / 9.0)).epsilon(0.1));
    CHECK_FALSE(most_biased_tile(trials_of(leak, 3), reference, 0));
}

TEST_CASE("cost regions: a bias is in the error of a part of the image, and not in what its noise costs") {
    const Regions regions = regions_of(white(), edge);
    REQUIRE(regions.size() == 3);
    const auto figures_of = [&](double bias, std::uint64_t seed) {
        ArmFigures figures;
        figures.points.push_back({16, {1.0, 1.0, 1.0}, {0.1, 0.1, 0.1}, 0.0});
        figures.regions =
            region_errors(trials_of([&](std::uint32_t, std::uint32_t) { return bias; }, seed), white(), regions);
        return figures;
    };
    const ArmFigures baseline = figures_of(0.0, 4);
    ArmFigures biased = figures_of(0.3, 5);
    biased.time_ratio = {2.0, 2.0, 2.0};
    compare_regions(baseline, biased);
    for (const RegionError& region : biased.regions) {
        CHECK(region.rmse == doctest::Approx(std::hypot(0.3, 0.1)).epsilon(0.05));
        CHECK(region.cost_ratio == doctest::Approx(2.0).epsilon(0.1));
    }
}

}  // namespace
}  // namespace tandem
