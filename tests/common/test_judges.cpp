#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"
#include "common/validation/judges/judges.h"

namespace tandem::test {
namespace {

constexpr std::uint32_t side = 24;

std::vector<double> plain(double r, double g, double b) {
    std::vector<double> rgb;
    for (std::uint32_t i = 0; i < side * side; ++i) rgb.insert(rgb.end(), {r, g, b});
    return rgb;
}

JudgedPair pair_of(std::vector<double> a, std::vector<double> b, double variance) {
    const std::vector<double> variances(a.size(), variance);
    return {side, side, std::move(a), std::move(b), variances, variances, 64.0};
}

JudgeFinding finding_of(const JudgedPair& pair, std::string_view judge) {
    const std::vector<JudgeFinding> findings = ask_judges(pair);
    const auto found = std::ranges::find(findings, judge, &JudgeFinding::name);
    REQUIRE(found != findings.end());
    return *found;
}

}  // namespace

// Two images of steps in every direction; the second is brighter, or wraps to dark, in its right half.
// The expected values are those of other programs: scikit-image 0.19.3 (Gaussian weights, population covariance) and
// the FLIP.h 1.6 of FLIP's authors, in single precision.
TEST_CASE("SSIM and FLIP have the values that other programs give") {
    constexpr int width = 48, height = 36;
    std::vector<double> grey_a, grey_b, a, b;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) {
                const int steps = 3 * x + 5 * y + 29 * c + x * y / 8, brighter = x > width / 2 ? 9 : 0;
                a.push_back(steps % 64 / 63.0);
                b.push_back((steps + brighter) % 64 / 63.0);
                if (c > 0) continue;
                grey_a.push_back(a.back());
                grey_b.push_back(b.back());
            }
    CHECK(structural_similarity(grey_a, grey_b, width, height) == doctest::Approx(0.6555419568417236).epsilon(1e-10));
    CHECK(flip_error(a, b, width, height) == doctest::Approx(0.21377844).epsilon(1e-4));
}

// Without structure SSIM is its luminance term [Wang et al. 2004, equation 6].
TEST_CASE("SSIM of even images is the ratio of their means") {
    const double a = 0.5, b = 0.25, c1 = 1e-4;
    const std::vector<double> first(side * side, a), second(side * side, b);
    CHECK(structural_similarity(first, second, side, side) ==
          doctest::Approx((2 * a * b + c1) / (a * a + b * b + c1)).epsilon(1e-9));
    CHECK(structural_similarity(first, first, side, side) == doctest::Approx(1.0));
}

// Even images have no features, and filters leave them alone. Lab of sRGB's green is (87.735, -86.183, 83.180), of its
// blue (32.297, 79.188, -107.860), of white (100, 0, 0). With Hunt's factor L/100 green and blue are 203.3 apart, of
// which the power 0.7 is greatest; black and white are 100 apart.
TEST_CASE("FLIP of even images is the compressed distance of their colours") {
    const auto hunt = [](double l, double a, double b) { return std::array{l, 0.01 * l * a, 0.01 * l * b}; };
    const auto green = hunt(87.735, -86.183, 83.180), blue = hunt(32.297, 79.188, -107.860);
    const double apart = std::abs(green[0] - blue[0]) + std::hypot(green[1] - blue[1], green[2] - blue[2]);
    const double greatest = std::pow(apart, 0.7), knee = 0.4 * greatest, bright = std::pow(100.0, 0.7);
    const double expected = 0.95 + 0.05 * (bright - knee) / (greatest - knee);
    CHECK(flip_error(plain(0, 0, 0), plain(1, 1, 1), side, side) == doctest::Approx(expected).epsilon(1e-4));
    CHECK(flip_error(plain(0, 1, 0), plain(0, 0, 1), side, side) == doctest::Approx(1.0).epsilon(1e-4));
    CHECK(flip_error(plain(0.2, 0.4, 0.1), plain(0.2, 0.4, 0.1), side, side) == 0.0);
}

TEST_CASE("FLIP sees an edge that is elsewhere more than the same change without an edge") {
    std::vector<double> even = plain(0.5, 0.5, 0.5), edge = even, other = even;
    for (std::uint32_t i = 0; i < side * side; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            edge[3 * i + c] += i % side < side / 2 ? 0.1 : -0.1;
            other[3 * i + c] += i % side < side / 2 ? -0.1 : 0.1;
        }
    const double swapped = flip_error(edge, other, side, side);
    CHECK(swapped > flip_error(even, plain(0.7, 0.7, 0.7), side, side));
    CHECK(swapped == doctest::Approx(flip_error(other, edge, side, side)).epsilon(1e-9));
}

TEST_CASE("each rule notices what its project says, and no less") {
    const std::vector<double> grey = plain(0.5, 0.5, 0.5);
    std::vector<double> one = grey;
    one[30] += 0.02;
    CHECK(finding_of(pair_of(grey, one, 1e-6), "idiff, OSL, hard").notices());
    CHECK(finding_of(pair_of(grey, one, 1e-6), "idiff, OSL").notices());
    CHECK_FALSE(finding_of(pair_of(grey, one, 1e-6), "idiff, Cycles").notices());  // 1 of 576 pixels is below 1 %
    CHECK_FALSE(finding_of(pair_of(grey, plain(0.504, 0.5, 0.5), 1e-6), "idiff, OSL, hard").notices());
    CHECK(finding_of(pair_of(grey, plain(0.54, 0.5, 0.5), 1e-6), "idiff, Cycles").notices());
    // As shown, 0.5 is 188 of 255, 0.55 is 196 and 0.61 is 205: off by 0.031 and 0.067. One pixel is 0.17 %.
    const auto one_is = [&](double value) {
        std::vector<double> other = grey;
        other[30] = value;
        return finding_of(pair_of(grey, other, 1e-6), "idiff, OpenUSD").notices();
    };
    CHECK_FALSE(one_is(0.55));
    CHECK(one_is(0.61));
    // A z of 4.1 has p = 4e-5, which is not below 1 %/1728; that of 10 is.
    const auto offset_by = [&](double z) {
        std::vector<double> moved = grey;
        moved[100] += z * std::sqrt(2e-4);
        return finding_of(pair_of(grey, moved, 1e-4), "t-test a pixel, Bonferroni").notices();
    };
    CHECK_FALSE(offset_by(4.1));
    CHECK(offset_by(10.0));
    CHECK(finding_of(pair_of(grey, plain(0.52, 0.52, 0.52), 1e-4), "floor ratio, Chrono").score ==
          doctest::Approx(0.02 / std::sqrt(2e-4)));
}

TEST_CASE("judges without variances are the others, and images of two sizes are refused") {
    JudgedPair pair = pair_of(plain(0.1, 0.1, 0.1), plain(0.1, 0.1, 0.1), 0.0);
    CHECK(ask_judges(pair).size() == 10);
    pair.reference_variance.clear();
    CHECK(ask_judges(pair).size() == 7);
    Image small, large;
    small.width = small.height = 1;
    large.width = large.height = 2;
    CHECK_THROWS_AS((void)judged_pair(small, large), InputError);
    CHECK_THROWS_AS((void)judged_pair(small, small), InputError);  // without channels
}

}  // namespace tandem::test
