// Walks through grids of densities, elementary functions and the integer hash on the device, against the host.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "common/render/random.h"
#include "double_function_probe.h"
#include "function_probe.h"
#include "grid_probe.h"
#include "tests/vulkan/probe.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

double number(std::uint32_t i, std::uint32_t k) { return to_unit<double>(random_block(7, i, k / 4, 3)[k % 4]); }
glm::dvec3 point(std::uint32_t i, std::uint32_t k) { return {number(i, k), number(i, k + 1), number(i, k + 2)}; }
float rounded(double x) { return static_cast<float>(x); }

constexpr int cells_x = 4, cells_y = 3, cells_z = 2;
const glm::dvec3 low(-1.0, -0.5, 2.0), high(1.0, 1.0, 3.0);

double density_of(int x, int y, int z) {
    return (x + y + z) % 3 == 0 ? 0.0 : number(static_cast<std::uint32_t>((z * cells_y + y) * cells_x + x), 9);
}

// The part of [0, end] that the ray spends in the box, by its slabs.
double length_in(
    const glm::dvec3& o, const glm::dvec3& d, const glm::dvec3& box_low, const glm::dvec3& box_high, double end) {
    double from = 0.0, to = end;
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] == 0.0) {
            if (o[axis] < box_low[axis] || o[axis] > box_high[axis]) return 0.0;
            continue;
        }
        const double a = (box_low[axis] - o[axis]) / d[axis], b = (box_high[axis] - o[axis]) / d[axis];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return std::max(0.0, to - from);
}

// N of MODEL.md section 10: over all cells, each by itself.
double depth_of(const glm::dvec3& o, const glm::dvec3& d, double end) {
    const glm::dvec3 size = (high - low) / glm::dvec3(cells_x, cells_y, cells_z);
    double depth = 0.0;
    for (int z = 0; z < cells_z; ++z)
        for (int y = 0; y < cells_y; ++y)
            for (int x = 0; x < cells_x; ++x) {
                const glm::dvec3 corner = low + glm::dvec3(x, y, z) * size;
                depth += density_of(x, y, z) * length_in(o, d, corner, corner + size, end);
            }
    return depth;
}

struct GridRay {
    glm::dvec3 origin, direction;
    double end, wanted;
};

// Rays from anywhere to anywhere near the box, some along an axis, some with an end or a depth to find.
GridRay grid_ray(std::uint32_t i) {
    const glm::dvec3 middle = 0.5 * (low + high);
    GridRay ray{middle + 4.0 * (point(i, 0) - 0.5), {}, i % 3 == 0 ? 1e30 : 4.0 * number(i, 6), 3e38};
    const glm::dvec3 target = low + point(i, 3) * (high - low);
    ray.direction = glm::normalize(target - ray.origin);
    if (i % 7 == 0) {
        ray.direction = {0.0, 0.0, i % 2 == 0 ? 1.0 : -1.0};
        ray.origin = {target.x, target.y, i % 2 == 0 ? 0.0 : 5.0};
    }
    if (i % 2 == 0) ray.wanted = number(i, 7);
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin[axis] = rounded(ray.origin[axis]);
        ray.direction[axis] = rounded(ray.direction[axis]);
    }
    return ray;
}

}  // namespace

TEST_CASE("a walk through a grid finds the optical depth, and where a given depth is reached") {
    constexpr std::uint32_t count = 20'000;
    std::vector<float> input{rounded(low.x), rounded(low.y), rounded(low.z), rounded(high.x), rounded(high.y),
        rounded(high.z), cells_x, cells_y, cells_z};
    input.resize(16);
    for (int z = 0; z < cells_z; ++z)
        for (int y = 0; y < cells_y; ++y)
            for (int x = 0; x < cells_x; ++x) input.push_back(rounded(density_of(x, y, z)));
    input.resize(80);
    for (std::uint32_t i = 0; i < count; ++i) {
        const GridRay ray = grid_ray(i);
        for (const glm::dvec3& v : {ray.origin, ray.direction})
            input.insert(input.end(), {rounded(v.x), rounded(v.y), rounded(v.z)});
        input.insert(input.end(), {rounded(ray.end), rounded(ray.wanted)});
    }
    std::vector<std::uint32_t> words;
    for (const float x : input) words.push_back(std::bit_cast<std::uint32_t>(x));
    const std::vector<std::uint32_t> output = run_probe(grid_probe_code, words, 4 * count, count);
    std::uint32_t reached = 0, passed = 0;
    // Cells 0.5 wide are walked along ways of up to 5: a few tens of roundings of 6e-8 of that. Rounding also moves the
    // rims of slivers of cells, densities being at most 1.
    constexpr double bound = 1e-5;
    for (std::uint32_t i = 0; i < count; ++i) {
        const GridRay ray = grid_ray(i);
        const auto result = [&](std::size_t k) { return double{std::bit_cast<float>(output[4 * i + k])}; };
        const double whole = depth_of(ray.origin, ray.direction, ray.end);
        CAPTURE(i);
        if (result(2) == 1.0) {
            ++reached;
            REQUIRE(whole >= ray.wanted - bound);
            REQUIRE(result(0) <= ray.end);
            REQUIRE(std::abs(depth_of(ray.origin, ray.direction, result(0)) - ray.wanted) < bound);
        } else {
            ++passed;
            REQUIRE(std::abs(result(1) - whole) < bound);
            REQUIRE(whole < ray.wanted + bound);
        }
    }
    CHECK(reached > count / 10);
    CHECK(passed > count / 10);
}

TEST_CASE("exponential, logarithm and arc tangent on the device are within a few ulp") {
    constexpr std::uint32_t count = 50'000;
    std::vector<std::uint32_t> words;
    std::vector<std::array<double, 4>> arguments;
    for (std::uint32_t i = 0; i < count; ++i) {
        const double x = i % 2 == 0 ? 80.0 * number(i, 0) : number(i, 0);
        const double y = 1.0 - to_unit<double>(random_block(7, i, 0, 3)[1]) * (i % 4 == 0 ? 0x1p-12 : 1.0);
        const double scale = std::exp2(20.0 * number(i, 3) - 10.0);
        arguments.push_back(
            {rounded(x), rounded(y), rounded(number(i, 4) - 0.5), rounded(scale * (number(i, 5) - 0.5))});
        for (const double a : arguments.back()) words.push_back(std::bit_cast<std::uint32_t>(rounded(a)));
    }
    const std::vector<std::uint32_t> output = run_probe(function_probe_code, words, 8 * count, count);
    double worst_exp = 0.0, worst_log = 0.0, worst_turn = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto [x, y, a, b] = arguments[i];
        const auto result = [&](std::size_t k) { return double{std::bit_cast<float>(output[8 * i + k])}; };
        worst_exp = std::max(worst_exp, std::abs(result(0) / std::exp(-x) - 1.0));
        if (y < 1.0) worst_log = std::max(worst_log, std::abs(result(1) / -std::log(y) - 1.0));
        worst_turn = std::max(worst_turn, std::abs(result(2) - std::atan2(a, b) / (2.0 * std::numbers::pi)));
    }
    MESSAGE("relative errors of exp and log, absolute of turns: ", worst_exp, ", ", worst_log, ", ", worst_turn);
    CHECK(worst_exp < 4.0 * 0x1p-23);
    CHECK(worst_log < 4.0 * 0x1p-23);
    CHECK(worst_turn < 2.0 * 0x1p-24);
}

TEST_CASE("in double the device's own functions are as good as double") {
    std::vector<std::uint32_t> words;
    std::vector<std::array<double, 4>> arguments;
    constexpr std::uint32_t count = 20'000;
    for (std::uint32_t i = 0; i < count; ++i) {
        // Exponents to 600; logarithms down to 2^-24, many next to 0; turns of all directions, and angles in [0, 1/2).
        const double x = 600.0 * std::pow(number(i, 0), 6.0);
        const double y =
            i % 2 == 0 ? 1.0 - number(i, 1) * std::exp2(-20.0 * number(i, 2)) : std::exp2(-24.0 * number(i, 1));
        const double scale = std::exp2(8.0 * number(i, 2) - 8.0);
        arguments.push_back({x, y, scale * (number(i, 4) - 0.5), number(i, 5) - 0.5});
        for (const double a : arguments.back()) {
            words.push_back(static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(a)));
            words.push_back(static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(a) >> 32));
        }
    }
    const std::vector<std::uint32_t> output = run_probe(double_function_probe_code, words, 10 * count, count);
    double worst_exp = 0.0, worst_log = 0.0, worst_turn = 0.0, worst_circle = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto [x, y, a, b] = arguments[i];
        const auto result = [&](std::size_t k) {
            const std::size_t at = 10 * i + 2 * k;
            return std::bit_cast<double>(output[at] | std::uint64_t{output[at + 1]} << 32);
        };
        worst_exp = std::max(worst_exp, std::abs(result(0) / std::exp(-x) - 1.0));
        if (y < 1.0) worst_log = std::max(worst_log, std::abs(result(1) / -std::log(y) - 1.0));
        worst_turn = std::max(worst_turn, std::abs(result(2) - std::atan2(a, b) / (2.0 * std::numbers::pi)));
        const double angle = 2.0 * std::numbers::pi * std::abs(b);
        worst_circle =
            std::max({worst_circle, std::abs(result(3) - std::cos(angle)), std::abs(result(4) - std::sin(angle))});
    }
    MESSAGE("relative errors of exp and log, absolute of turns, cosines and sines: ", worst_exp, ", ", worst_log, ", ",
        worst_turn, ", ", worst_circle);
    CHECK(worst_exp < 4.0 * 0x1p-52);
    CHECK(worst_log < 4.0 * 0x1p-52);
    CHECK(worst_turn < 2.0 * 0x1p-53);
    CHECK(worst_circle < 2.0 * 0x1p-52);
}

TEST_CASE("pcg3d on the device is the published hash") {
    // The source is Jarzynski and Olano, Hash functions for GPU rendering, JCGT 9(3), 2020. The hash is a linear
    // congruential step a word, and two rounds of multiply-adds around an xor of the upper halves.
    const auto published = [](std::array<std::uint32_t, 3> v) {
        for (std::uint32_t& word : v) word = word * 1664525u + 1013904223u;
        const auto mix = [&] {
            v[0] += v[1] * v[2];
            v[1] += v[2] * v[0];
            v[2] += v[0] * v[1];
        };
        mix();
        for (std::uint32_t& word : v) word ^= word >> 16;
        mix();
        return v;
    };
    std::vector<std::uint32_t> words;
    for (std::uint32_t i = 0; i < 4000; ++i) {
        const RandomBlock block = i < 8 ? RandomBlock{i & 1, i >> 1 & 1, i >> 2, 0} : random_block(3, i, 0, 0);
        words.insert(words.end(), block.begin(), block.end());
    }
    const std::vector<std::uint32_t> output = run_probe(function_probe_code, words, 8 * 4000, 4000);
    for (std::size_t i = 0; i < 4000; ++i) {
        const auto answer = published({words[4 * i], words[4 * i + 1], words[4 * i + 2]});
        for (std::size_t k = 0; k < 3; ++k) REQUIRE(output[8 * i + 4 + k] == answer[k]);
    }
}
