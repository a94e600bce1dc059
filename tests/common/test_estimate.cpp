// Estimates merge to the same bits in any order, and say what they hold.
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "common/error.h"
#include "common/render/estimate.h"

using namespace tandem;

namespace {

// Moments that rounding would tell apart: magnitudes over many binades.
Estimate::Plane block_moments(std::uint64_t block, std::size_t size) {
    std::mt19937_64 engine(block + 17);
    std::uniform_real_distribution<double> exponent(-30.0, 30.0);
    Estimate::Plane plane(size);
    for (Moments& moments : plane) moments = {std::exp2(exponent(engine)), std::exp2(exponent(engine))};
    return plane;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane left = a.totals(), right = b.totals();
    return std::ranges::equal(left, right,
        [](const Moments& x, const Moments& y) { return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares; });
}

Estimate one_block(std::uint64_t block) {
    Estimate estimate(3, 2);
    estimate.add_block({block * samples_per_block, (block + 1) * samples_per_block}, block_moments(block, 18));
    return estimate;
}

}  // namespace

TEST_CASE("blocks merge to the same bits in any order and grouping") {
    constexpr std::uint64_t blocks = 37;
    Estimate in_order(3, 2);
    for (std::uint64_t b = 0; b < blocks; ++b) in_order.merge(one_block(b));
    CHECK(in_order.count() == blocks * samples_per_block);
    CHECK(in_order.ranges() == std::vector{SampleRange{0, blocks * samples_per_block}});

    std::mt19937 engine(5);
    std::vector<std::uint64_t> order(blocks);
    std::iota(order.begin(), order.end(), 0);
    for (int trial = 0; trial < 50; ++trial) {
        std::ranges::shuffle(order, engine);
        std::vector<Estimate> parts(1 + static_cast<std::size_t>(trial) % 5, Estimate(3, 2));
        for (std::size_t i = 0; i < order.size(); ++i) parts[i % parts.size()].merge(one_block(order[i]));
        Estimate merged(3, 2);
        for (Estimate& part : parts) merged.merge(std::move(part));
        CHECK(same_bits(in_order, merged));
    }
}

TEST_CASE("a ragged last block merges, counts, and keeps its range") {
    Estimate head = one_block(0), tail(3, 2);
    tail.add_block({64, 70}, block_moments(1, 18));
    Estimate other_way = tail;
    other_way.merge(one_block(0));
    head.merge(tail);
    CHECK(same_bits(head, other_way));
    CHECK(head.count() == 70);
    CHECK(head.ranges() == std::vector{SampleRange{0, 70}});
}

TEST_CASE("an estimate made again of its pieces, in any order, goes on to the same bits") {
    Estimate whole(3, 2), begun(3, 2);
    for (const std::uint64_t block : {0u, 1u, 2u, 5u, 8u, 9u, 10u, 11u}) begun.merge(one_block(block));
    begun.add_block({12 * 64, 12 * 64 + 7}, block_moments(12, 18));
    std::vector<Estimate::Piece> pieces = begun.pieces();
    std::vector<SampleRange> ranges;
    for (const Estimate::Piece& piece : pieces) ranges.push_back(piece.range);
    CHECK(ranges == std::vector<SampleRange>{{0, 128}, {128, 192}, {320, 384}, {512, 768}, {768, 775}});
    std::mt19937 engine(5);
    for (int trial = 0; trial < 20; ++trial) {
        std::ranges::shuffle(pieces, engine);
        Estimate again(3, 2);
        for (const Estimate::Piece& piece : pieces) again.add_block(piece.range, *piece.moments);
        Estimate also = begun;
        for (const std::uint64_t block : {3u, 4u, 6u, 7u}) {
            again.merge(one_block(block));
            also.merge(one_block(block));
        }
        CHECK(same_bits(again, also));
        CHECK(again.pieces().front().range == SampleRange{0, 512});
    }
}

TEST_CASE("overlaps, other sizes and ranges that are no block are refused") {
    Estimate estimate = one_block(2);
    CHECK_THROWS_AS(estimate.merge(one_block(2)), Error);
    CHECK_THROWS_AS(estimate.merge(Estimate(2, 3)), Error);
    CHECK_THROWS_AS(estimate.add_block({1, 64}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({0, 65}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({64, 192}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({256, 128}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({128, 256}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({0, 0}, block_moments(0, 18)), Error);
    CHECK_THROWS_AS(estimate.add_block({0, 64}, block_moments(0, 17)), Error);
    CHECK_THROWS_AS(estimate.add_block({128, 130}, block_moments(0, 18)), Error);
}

TEST_CASE("mean and unbiased variance follow from the sums") {
    // Samples 1, 2, 3, 4: mean 2.5, variance 5/3.
    CHECK(mean_from({10.0, 30.0}, 4) == 2.5);
    CHECK(variance_from({10.0, 30.0}, 4) == doctest::Approx(5.0 / 3.0).epsilon(1e-15));
    CHECK(std::isnan(variance_from({1.0, 1.0}, 1)));
    CHECK(variance_from({0.3, 0.09 / 3.0}, 3) >= 0.0);
}
