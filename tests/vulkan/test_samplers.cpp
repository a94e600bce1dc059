// The samplers of microfacets, phase functions and backgrounds on the device. Chi-square tests hold what they draw to
// the densities of MODEL.md, integrated here in double precision.
#include <doctest/doctest.h>

#include <bit>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "common/render/random.h"
#include "sampling_probe.h"
#include "tests/vulkan/probe.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

using Density = std::function<double(const glm::dvec3&)>;
constexpr double pi = std::numbers::pi;
constexpr std::size_t parameter_words = 64, samples = 100'000;
constexpr int rings = 24, sectors = 24;

struct Draw {
    glm::dvec3 direction;
    double density, weight;
};

// Word 0 says which sampler; `parameters` follow it and may go on after the pairs of random numbers, from which
// `tables_at` tells.
std::vector<Draw> draw(float which, const std::vector<float>& parameters, const std::vector<float>& tables = {}) {
    std::vector<float> input(parameter_words);
    input[0] = which;
    std::ranges::copy(parameters, input.begin() + 1);
    for (std::uint32_t i = 0; i < samples; ++i) {
        const RandomBlock block = random_block(41, i, 0, 4);
        input.insert(input.end(), {to_unit<float>(block[0]), to_unit<float>(block[1])});
    }
    input[parameter_words - 1] = static_cast<float>(input.size());
    input.insert(input.end(), tables.begin(), tables.end());
    std::vector<std::uint32_t> words;
    for (const float number : input) words.push_back(std::bit_cast<std::uint32_t>(number));
    const std::vector<std::uint32_t> output = run_probe(sampling_probe_code, words, 8 * samples, samples);
    const auto number = [&](std::size_t at) { return double{std::bit_cast<float>(output[at])}; };
    std::vector<Draw> draws;
    for (std::size_t i = 0; i < samples; ++i)
        draws.push_back({{number(8 * i), number(8 * i + 1), number(8 * i + 2)}, number(8 * i + 3), number(8 * i + 4)});
    return draws;
}

constexpr std::size_t tables_at = parameter_words + 2 * samples;

// Cells of equal solid angle about `axis`, whose polar coordinate is z' = axis component.
std::size_t cell_of(const glm::dvec3& d) {
    const double turn = std::atan2(d.y, d.x) / (2.0 * pi);
    const int ring = std::clamp(static_cast<int>(rings * 0.5 * (d.z + 1.0)), 0, rings - 1);
    const int sector = std::clamp(static_cast<int>(sectors * (turn - std::floor(turn))), 0, sectors - 1);
    return static_cast<std::size_t>(ring * sectors + sector);
}

// Midpoint rule on a fine grid in z and azimuth.
std::vector<double> expected_counts(const Density& density) {
    constexpr int fine = 40;
    std::vector<double> expected(rings * sectors);
    const double angle = 4.0 * pi / (double{rings} * fine * sectors * fine);
    for (int i = 0; i < rings * fine; ++i)
        for (int j = 0; j < sectors * fine; ++j) {
            const double z = 2.0 * (i + 0.5) / (rings * fine) - 1.0, turn = (j + 0.5) / (sectors * fine);
            const double sine = std::sqrt(1.0 - z * z);
            const glm::dvec3 d(sine * std::cos(2.0 * pi * turn), sine * std::sin(2.0 * pi * turn), z);
            expected[static_cast<std::size_t>(i / fine * sectors + j / fine)] += samples * angle * density(d);
        }
    return expected;
}

// The probability of so great a deviation by chance; cells of fewer than ten expected are pooled.
double chi_square_probability(const std::vector<Draw>& draws, const Density& density) {
    const std::vector<double> expected = expected_counts(density);
    std::vector<double> observed(expected.size());
    for (const Draw& one : draws) ++observed[cell_of(one.direction)];
    double statistic = 0.0, pooled_expected = 0.0, pooled_observed = 0.0;
    int freedom = -1;
    const auto add = [&](double expectation, double observation) {
        statistic += (observation - expectation) * (observation - expectation) / expectation;
        ++freedom;
    };
    for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] >= 10.0) {
            add(expected[i], observed[i]);
        } else {
            pooled_expected += expected[i];
            pooled_observed += observed[i];
        }
    }
    if (pooled_expected >= 1.0) add(pooled_expected, pooled_observed);
    REQUIRE(freedom > 0);
    return boost::math::cdf(boost::math::complement(boost::math::chi_squared(freedom), statistic));
}

void check_sampler(const std::vector<Draw>& draws, const Density& density, double relative) {
    CHECK(chi_square_probability(draws, density) > 1e-6);
    double worst = 0.0;
    for (const Draw& one : draws) {
        REQUIRE(std::abs(glm::length(one.direction) - 1.0) < 1e-5);
        const double answer = density(one.direction);
        if (answer > 1e-6) worst = std::max(worst, std::abs(one.density / answer - 1.0));
    }
    CAPTURE(worst);
    CHECK(worst < relative);
}

// MODEL.md section 7.6 in double precision.
double lambda(const glm::dvec3& w, double alpha) {
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1.0);
}
double distribution(const glm::dvec3& h, double alpha) {
    const double x = 1.0 + h.z * h.z * (alpha * alpha - 1.0);
    return alpha * alpha / (pi * x * x);
}
double microfacet_density(const glm::dvec3& i, const glm::dvec3& o, double alpha) {
    const glm::dvec3 h = glm::normalize(i + o);
    return h.z <= 0.0 ? 0.0 : distribution(h, alpha) / (1.0 + lambda(i, alpha)) / (4.0 * i.z);
}
double microfacet_value(const glm::dvec3& i, const glm::dvec3& o, double alpha) {
    if (o.z <= 0.0) return 0.0;
    const glm::dvec3 h = glm::normalize(i + o);
    return distribution(h, alpha) / (1.0 + lambda(i, alpha) + lambda(o, alpha)) / (4.0 * i.z);
}

double integral(const Density& density) {
    double sum = 0.0;
    for (const double count : expected_counts(density)) sum += count / samples;
    return sum;
}

double phase(double g, double mu) { return (1.0 - g * g) / (4.0 * pi * std::pow(1.0 + g * g - 2.0 * g * mu, 1.5)); }

}  // namespace

TEST_CASE("GGX's visible normals are drawn with the density of the model, below the surface too") {
    for (const double roughness : {0.3, 0.6, 1.0})
        for (const double polar : {0.1, 0.8, 1.4}) {
            const double alpha = roughness * roughness;
            const glm::dvec3 i(std::sin(polar) * 0.6, std::sin(polar) * 0.8, std::cos(polar));
            const auto draws = draw(0,
                {static_cast<float>(alpha), static_cast<float>(i.x), static_cast<float>(i.y), static_cast<float>(i.z)});
            CAPTURE(roughness);
            CAPTURE(polar);
            check_sampler(
                draws, [&](const glm::dvec3& o) { return microfacet_density(i, o, alpha); }, 2e-3);
        }
}

TEST_CASE("a rough conductor that reflects all loses what the quadrature of its microfacets loses") {
    // The white furnace: an estimate of the mean weight, of at most 1, by 10^5 samples has a standard error below
    // 0.0016.
    for (const double roughness : {0.4, 0.7, 1.0})
        for (const double polar : {0.0, 0.7, 1.3}) {
            const double alpha = roughness * roughness;
            const glm::dvec3 i(std::sin(polar), 0.0, std::cos(polar));
            double sum = 0.0;
            for (const Draw& one :
                draw(0, {static_cast<float>(alpha), static_cast<float>(i.x), 0.0f, static_cast<float>(i.z)})) {
                sum += one.weight;
                REQUIRE(one.weight <= 1.0 + 1e-6);
            }
            const double answer = integral([&](const glm::dvec3& o) { return microfacet_value(i, o, alpha); });
            CAPTURE(roughness);
            CAPTURE(polar);
            CHECK(std::abs(sum / samples - answer) < 6.0 * 0.0016);
            CHECK(answer <= 1.0);
        }
}

TEST_CASE("Henyey and Greenstein's phase function is drawn with its density") {
    const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, -0.5, 0.4));
    for (const double g : {0.0, 0.3, -0.7, 0.85}) {
        const auto draws =
            draw(1, {static_cast<float>(g), static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)});
        CAPTURE(g);
        check_sampler(
            draws, [&](const glm::dvec3& w) { return phase(g, glm::dot(d, w)); }, 1e-4);
    }
}

TEST_CASE("a sky linear in height is drawn in proportion to its radiance") {
    for (const auto& [down, up] : {std::pair{1.0, 3.0}, {2.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}}) {
        const auto draws = draw(2, {static_cast<float>(down), static_cast<float>(up)});
        const auto density = [down = down, up = up](const glm::dvec3& d) {
            return (down + (up - down) * 0.5 * (d.y + 1.0)) / (2.0 * pi * (down + up));
        };
        CAPTURE(down);
        check_sampler(draws, density, 1e-4);
    }
}

TEST_CASE("an image of the sky is drawn by its cells") {
    // 3 rows of 4 columns, of one number a cell: the density of the test is constant in each.
    constexpr int width = 4, height = 3;
    const std::vector<double> brightness{1, 0, 3, 2, 0.5, 4, 1, 1, 2, 0, 0, 5};
    std::vector<double> rows(height);
    std::vector<float> columns;
    double total = 0.0;
    for (int row = 0; row < height; ++row) {
        const double angle = 2.0 * pi / width * (std::cos(pi * row / height) - std::cos(pi * (row + 1) / height));
        double sum = 0.0, before = 0.0;
        for (int column = 0; column < width; ++column)
            sum += brightness[static_cast<std::size_t>(row * width + column)];
        for (int column = 0; column < width; ++column) {
            before += brightness[static_cast<std::size_t>(row * width + column)];
            columns.push_back(static_cast<float>(before / sum));
        }
        rows[static_cast<std::size_t>(row)] = angle * sum;
        total += angle * sum;
    }
    std::vector<float> tables(3 * brightness.size(), 1.0f);  // texels, all white
    for (const double cell : brightness) tables.push_back(static_cast<float>(cell / total));
    double before = 0.0;
    for (const double row : rows) tables.push_back(static_cast<float>((before += row) / total));
    tables.insert(tables.end(), columns.begin(), columns.end());
    const double turn = 0.7;
    const auto at = static_cast<float>(tables_at);
    const auto draws = draw(3,
        {width, height, at, at + 36, at + 48, at + 51, static_cast<float>(std::cos(turn)),
            static_cast<float>(std::sin(turn))},
        tables);
    const auto density = [&](const glm::dvec3& d) {
        // MODEL.md section 8.1: turned by -rotation about +y.
        const glm::dvec3 e(
            std::cos(turn) * d.x - std::sin(turn) * d.z, d.y, std::sin(turn) * d.x + std::cos(turn) * d.z);
        const double u = 0.5 + std::atan2(-e.z, e.x) / (2.0 * pi), v = std::acos(-e.y) / pi;
        const int column = std::min(width - 1, static_cast<int>(u * width));
        const int row = std::min(height - 1, static_cast<int>((1.0 - v) * height));
        return brightness[static_cast<std::size_t>(row * width + column)] / total;
    };
    CHECK(chi_square_probability(draws, density) > 1e-6);
    std::size_t other_cells = 0;
    for (const Draw& one : draws) {
        CHECK(std::abs(one.weight - 1.0) < 1e-6);
        if (std::abs(one.density / density(one.direction) - 1.0) > 1e-5) ++other_cells;
    }
    CHECK(other_cells < samples / 10'000);  // a rounding beside a rim
}
