// Statistics against figures computed independently with SciPy 1.10 or published with the method.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "common/statistics/batch_tests.h"
#include "common/statistics/distributions.h"
#include "common/statistics/mean_tests.h"
#include "common/statistics/multiple_tests.h"

using namespace tandem;
using doctest::Approx;

namespace {

const std::vector<double> sample_a{
    27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4};
const std::vector<double> sample_b{
    27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 30.5, 24.8};

Approx close(double value) { return Approx(value).epsilon(1e-9); }

}  // namespace

TEST_CASE("distribution functions give SciPy's figures far into the tails") {
    CHECK(normal_upper_tail(5.0) == close(2.866515718791933e-07));
    CHECK(normal_quantile(0.975) == close(1.959963984540054));
    CHECK(student_upper_tail(2.5, 7.3) == close(0.019825117332800207));
    CHECK(student_quantile(0.95, 10.0) == close(1.8124611228107335));
    CHECK(student_upper_tail(8.0, 250.0) == Approx(2.3264007594587724e-14).epsilon(1e-6));
}

TEST_CASE("Student's t with endless degrees of freedom is the normal distribution") {
    CHECK(student_upper_tail(4.0, std::numeric_limits<double>::infinity()) == close(normal_upper_tail(4.0)));
    CHECK(student_upper_tail(6.0, 5e10) == Approx(student_upper_tail(6.0, 3e10)).epsilon(1e-7));
}

TEST_CASE("a binomial tail is what Clopper and Pearson's interval is read off") {
    // SciPy's interval of 7 successes in 50, 2.5 % a side.
    CHECK(binomial_upper_tail(7, 50, 0.05819170033997342) == close(0.025));
    CHECK(binomial_upper_tail(8, 50, 0.26739600249700846) == close(0.975));
    CHECK(binomial_upper_tail(0, 30, 0.1) == 1.0);
    CHECK(binomial_upper_tail(31, 30, 0.1) == 0.0);
}

TEST_CASE("moments merge to those of the whole sample") {
    SampleMoments first, second;
    for (std::size_t i = 0; i < sample_a.size(); ++i) (i < 4 ? first : second).add(sample_a[i]);
    first.merge(second);
    const SampleMoments whole = moments_of(sample_a);
    CHECK(first.count == whole.count);
    CHECK(first.mean == Approx(whole.mean).epsilon(1e-14));
    CHECK(first.variance() == Approx(whole.variance()).epsilon(1e-13));
}

TEST_CASE("the variance of one value is not a number") { CHECK(std::isnan(moments_of(std::array{3.0}).variance())); }

TEST_CASE("Welch's test gives SciPy's figures") {
    const MeanDifference d = welch(MeanEstimate(moments_of(sample_a)), MeanEstimate(moments_of(sample_b)));
    CHECK(d.difference == close(2.86));
    CHECK(d.standard_error == close(0.9949108598500768));
    CHECK(d.dof == close(27.900395656187122));
    CHECK(d.statistic() == close(2.8746293918542376));
    CHECK(d.p_value() == close(0.00765611367796229));
}

TEST_CASE("a mean of independent means adds variances and takes Satterthwaite's degrees of freedom") {
    MeanOfMeans mean;
    mean.add(1.0, 0.04, 9.0);
    mean.add(3.0, 0.01, 4.0);
    CHECK(mean.result().mean == close(2.0));
    CHECK(mean.result().variance == close(0.0125));
    CHECK(mean.result().dof == close(0.05 * 0.05 / (0.04 * 0.04 / 9.0 + 0.01 * 0.01 / 4.0)));
}

TEST_CASE("a difference within the negligible one is never significant") {
    const MeanDifference d{0.5, 1e-9, 10.0};
    CHECK(d.p_value(0.6) == 1.0);
    CHECK(d.p_value(0.4) < 1e-6);
}

TEST_CASE("without variance only the values decide") {
    const MeanDifference d{0.5, 0.0, std::numeric_limits<double>::infinity()};
    CHECK(d.p_value(0.6) == 1.0);
    CHECK(d.p_value(0.4) == 0.0);
}

TEST_CASE("equivalence needs the whole interval inside the margin") {
    // t(0.95, 10) = 1.8125: the interval is 0.2 +- 0.18125.
    const Interval known = MeanDifference{0.2, 0.1, 10.0}.interval(0.05);
    CHECK(equivalent(known, 0.382));
    CHECK_FALSE(equivalent(known, 0.381));
    CHECK_FALSE(equivalent({-known.high, -known.low}, 0.381));
    CHECK_FALSE(equivalent(MeanDifference{0.0, 1.0, 10.0}.interval(0.05), 0.5));
}

TEST_CASE("an interval that touches the margin, or is none, shows no equivalence") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(equivalent(Interval{0.0, 0.1}, 0.1));
    CHECK_FALSE(equivalent(Interval{-0.1, 0.0}, 0.1));
    CHECK_FALSE(equivalent(Interval{nan, 0.0}, 0.1));
    CHECK_FALSE(equivalent(Interval{0.0, nan}, 0.1));
}

TEST_CASE("Fieller's interval solves its quadratic") {
    const MeanEstimate a{moments_of(sample_a)}, b{moments_of(sample_b)};
    const Interval fieller = fieller_relative_difference(a, b, 0.025);
    CHECK(fieller.low == close(0.037504005136402396));
    CHECK(fieller.high == close(0.24884349379032344));
}

TEST_CASE("a reference that cannot be told from zero leaves the ratio unbounded") {
    const Interval interval = fieller_relative_difference({0.1, 1.0, 50.0}, {0.1, 1.0, 50.0}, 0.025);
    CHECK(interval.low == -std::numeric_limits<double>::infinity());
    CHECK(interval.high == std::numeric_limits<double>::infinity());
}

TEST_CASE("the minimum detectable difference is (z_alpha/2 + z_power) standard errors") {
    CHECK(minimum_detectable_difference(0.1, 0.05, 0.9) == Approx(0.3241515).epsilon(1e-6));
}

TEST_CASE("the bound for symmetric sums holds for coins, the hardest case") {
    // 25 heads of 25: the sum over the root of the sum of squares is 5, of probability 2^-25 a side.
    CHECK(symmetric_sum_tail(5.0) >= 2.0 * std::pow(0.5, 25));
    // Bentkus and Dzindzalieta's constant: equality at two coins, s = sqrt 2, P = 1/4 a side.
    CHECK(symmetric_sum_tail(std::sqrt(2.0)) == close(0.5));
    CHECK(symmetric_sum_tail(5.0) == Approx(3.1787 * 2.0 * 2.866515718791933e-07).epsilon(1e-3));
}

TEST_CASE("Holm's adjusted p-values") {
    const std::vector<double> adjusted = holm_adjusted(std::array{0.01, 0.04, 0.03, 0.005});
    const std::array expected{0.03, 0.06, 0.06, 0.02};
    for (std::size_t i = 0; i < expected.size(); ++i) CHECK(adjusted[i] == close(expected[i]));
    const std::vector<double> thresholds = holm_thresholds(std::array{0.01, 0.04, 0.03, 0.005}, 0.12);
    CHECK(thresholds[3] == close(0.03));
    CHECK(thresholds[1] == close(0.12));
}

TEST_CASE("Benjamini and Hochberg's adjusted p-values, on 25 dietary p-values (Garcia-Arenzana 2014)") {
    const std::vector<double> p{0.001, 0.008, 0.039, 0.041, 0.042, 0.060, 0.074, 0.205, 0.212, 0.216, 0.222, 0.251,
        0.269, 0.275, 0.34, 0.341, 0.384, 0.569, 0.594, 0.696, 0.762, 0.94, 0.942, 0.975, 0.986};
    const std::vector<double> adjusted = benjamini_hochberg_adjusted(p);
    const std::array expected{0.025, 0.1, 0.21, 0.21, 0.21, 0.25};
    for (std::size_t i = 0; i < expected.size(); ++i) CHECK(adjusted[i] == close(expected[i]));
    CHECK(simes(p) == close(0.025));
    CHECK(bonferroni(p) == close(0.025));
}

TEST_CASE("Simes finds many moderate p-values that Bonferroni cannot") {
    const std::vector<double> p(20, 0.03);
    CHECK(simes(p) == close(0.03));
    CHECK(bonferroni(p) == close(0.6));
}

TEST_CASE("alpha spent over the looks adds up to alpha") {
    double total = 0.0;
    for (const double share : alpha_spending(0.05, 6)) total += share;
    CHECK(total == close(0.05));
    CHECK(alpha_spending(0.06, 3)[0] == close(0.02));
}

TEST_CASE("the permutation test approaches the exact p of all rearrangements") {
    // 2 of the 70 rearrangements of these eight figures have |t| as large: p = 0.02857.
    const std::vector<std::vector<double>> a{{1.0}, {2.0}, {4.0}, {3.0}}, b{{5.0}, {6.0}, {4.5}, {9.0}};
    const double p = permutation_p_value(a, b, {.permutations = 20000, .enough = 20000, .seed = 3});
    // Five standard errors of 20000 draws.
    CHECK(p == Approx(2.0 / 70.0).epsilon(5.0 * std::sqrt(70.0 / 2.0 / 20000.0)));
}

TEST_CASE("the variance ratio test gives Welch's figures of the logarithms") {
    const std::array a{1.0, 1.2, 0.9, 1.1}, b{3.0, 2.8, 3.3, 3.1};
    const VarianceRatio ratio = variance_ratio_test(a, b);
    CHECK(ratio.ratio == close(2.9163162633904065));
    CHECK(ratio.statistic == close(15.130012937810442));
    CHECK(ratio.p == Approx(3.766931986983352e-05).epsilon(1e-8));
    CHECK(variance_ratio_test(a, b, 4.0).p == 1.0);
}

TEST_CASE("a variance of zero cannot be tested by its logarithm") {
    const std::array a{1.0, 0.0}, b{3.0, 2.8};
    CHECK(variance_ratio_test(a, b).p == 1.0);
}

TEST_CASE("Welch's p is uniform under the null") {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    constexpr int runs = 4000;
    std::array<int, 10> histogram{};
    for (int run = 0; run < runs; ++run) {
        SampleMoments a, b;
        for (int i = 0; i < 12; ++i) a.add(normal(random));
        for (int i = 0; i < 20; ++i) b.add(3.0 * normal(random));
        const double p = welch(MeanEstimate(a), MeanEstimate(b)).p_value();
        ++histogram[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * p))];
    }
    double chi_square = 0.0;
    for (const int count : histogram) chi_square += std::pow(count - runs / 10.0, 2) / (runs / 10.0);
    CHECK(chi_square < 27.877);  // the 99.9 % quantile at 9 degrees of freedom
}
