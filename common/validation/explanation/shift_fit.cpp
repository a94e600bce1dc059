#include "common/validation/explanation/shift_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace tandem {

namespace {

// Variances of pixel means, both sides added, averaged over 8x8 tiles: a pixel's own estimate goes with its value, and
// weights must not.
std::vector<double> smooth_variances(const SampledImage& a, const SampledImage& b) {
    const TileGrid grid(a.width, a.height, standard_tile_edge / 2);
    std::vector<double> sums(grid.size() * channel_count, 0.0), pixels(grid.size(), 0.0), result(a.pixels.size());
    const auto& tiles = grid.tile_of_pixel();
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const std::size_t tile = tiles[i / channel_count], c = i % channel_count;
        sums[tile * channel_count + c] +=
            a.pixels[i].variance / a.pixels[i].count + b.pixels[i].variance / b.pixels[i].count;
        if (c == 0) pixels[tile] += 1.0;
    }
    for (std::size_t i = 0; i < result.size(); ++i) {
        const std::size_t tile = tiles[i / channel_count];
        result[i] = sums[tile * channel_count + i % channel_count] / pixels[tile];
    }
    return result;
}

struct Equation {
    glm::dvec3 regressors;  // mean, d/dx, d/dy
    glm::dvec3 noise;       // variance of each regressor
    double difference, weight, variance;
};

std::vector<Equation> equations_of(const SampledImage& a, const SampledImage& b) {
    const std::vector<double> variance = smooth_variances(a, b);
    const auto means_a = channel_means(a);
    const std::size_t row = std::size_t{a.width} * channel_count;
    const auto middle = [&](std::size_t i) { return 0.5 * (a.pixels[i].mean + b.pixels[i].mean); };
    std::vector<Equation> equations;
    for (std::size_t y = 1; y + 1 < a.height; ++y)
        for (std::size_t k = channel_count; k + channel_count < row; ++k) {
            const std::size_t i = y * row + k, left = i - channel_count, right = i + channel_count;
            Equation equation;
            equation.regressors = {
                middle(i), 0.5 * (middle(right) - middle(left)), 0.5 * (middle(i + row) - middle(i - row))};
            equation.noise = 0.25 * glm::dvec3(variance[i], 0.25 * (variance[left] + variance[right]),
                                        0.25 * (variance[i - row] + variance[i + row]));
            equation.difference = b.pixels[i].mean - a.pixels[i].mean;
            // A hundredth of the mean beside the noise (Negligible::pixel), so that pixels without noise do not decide
            // alone.
            const double floor = 0.01 * means_a[i % channel_count];
            equation.variance = variance[i];
            equation.weight = 1.0 / (variance[i] + floor * floor + 1e-300);
            equations.push_back(equation);
        }
    return equations;
}

}  // namespace

std::optional<Registration> register_images(const ImagePair& pair) {
    const std::vector<Equation> equations = equations_of(pair.reference, pair.candidate);
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0);
    for (const Equation& e : equations) {
        normal += e.weight * glm::outerProduct(e.regressors, e.regressors);
        for (glm::length_t k = 0; k < 3; ++k) normal[k][k] -= e.weight * e.noise[k];
        right += e.weight * e.difference * e.regressors;
    }
    for (glm::length_t k = 0; k < 3; ++k)
        if (!(normal[k][k] > 0.0)) return std::nullopt;
    if (!(glm::determinant(normal) > 0.0)) return std::nullopt;
    const glm::dmat3 inverse = glm::inverse(normal);
    const glm::dvec3 solution = inverse * right;

    glm::dmat3 scatter(0.0);
    for (const Equation& e : equations) {
        const double residual = e.difference - glm::dot(solution, e.regressors);
        scatter += e.weight * e.weight * residual * residual * glm::outerProduct(e.regressors, e.regressors);
    }
    const glm::dmat3 covariance = inverse * scatter * inverse;
    const auto error = [&](glm::length_t k) { return std::sqrt(std::max(0.0, covariance[k][k])); };
    // b - a = e (a + b) / 2 is b = a (1 + e/2) / (1 - e/2).
    return Registration{
        (1.0 + 0.5 * solution.x) / (1.0 - 0.5 * solution.x), error(0), -solution.y, error(1), -solution.z, error(2)};
}

namespace {

struct Whole {
    std::int32_t x = 0, y = 0;
};

// The shift by whole pixels that leaves least; a large image is looked at every so many pixels.
Whole whole_shift(const ImagePair& pair) {
    const auto width = static_cast<std::int32_t>(pair.reference.width),
               height = static_cast<std::int32_t>(pair.reference.height);
    const std::int32_t reach = std::min(8, std::min(width, height) / 8);
    const auto grey = [](const SampledImage& image, std::int32_t x, std::int32_t y) {
        const std::size_t i = (static_cast<std::size_t>(y) * image.width + static_cast<std::size_t>(x)) * channel_count;
        return image.pixels[i].mean + image.pixels[i + 1].mean + image.pixels[i + 2].mean;
    };
    constexpr double enough = 65536.0;
    const auto step = static_cast<std::int32_t>(std::ceil(std::sqrt(static_cast<double>(width) * height / enough)));
    Whole best;
    double least = -1.0;
    for (std::int32_t dy = -reach; dy <= reach; ++dy)
        for (std::int32_t dx = -reach; dx <= reach; ++dx) {
            double sum = 0.0;
            for (std::int32_t y = reach; y < height - reach; y += step)  // the same part of the candidate for all
                for (std::int32_t x = reach; x < width - reach; x += step) {
                    const double d = grey(pair.candidate, x, y) - grey(pair.reference, x - dx, y - dy);
                    sum += d * d;
                }
            if (least < 0.0 || sum < least) {
                least = sum;
                best = {dx, dy};
            }
        }
    return best;
}

constexpr double shift_sigmas = 5.0, least_shift = 0.05;

// What is left in each quarter is no shift of its own.
bool same_in_all_quarters(const ImagePair& mended, double length) {
    const std::uint32_t width = mended.reference.width, height = mended.reference.height, x = width / 2, y = height / 2;
    for (const Rectangle& quarter :
        {Rectangle{0, 0, x, y}, {x, 0, width, y}, {0, y, x, height}, {x, y, width, height}}) {
        const std::optional<Registration> left = register_images(part_of(mended, quarter));
        if (!left) continue;  // nothing there by which to tell
        const double allowed = std::max(least_shift, 0.25 * length);
        if (std::abs(left->x) > shift_sigmas * left->x_error + allowed ||
            std::abs(left->y) > shift_sigmas * left->y_error + allowed)
            return false;
    }
    return true;
}

}  // namespace

std::optional<Shift> find_shift(const ImagePair& pair) {
    constexpr std::uint32_t least_side = 16;  // quarters of 7 pixels
    if (std::min(pair.reference.width, pair.reference.height) < least_side) return std::nullopt;
    const Whole whole = whole_shift(pair);
    const ImagePair laid = overlapped(pair, whole.x, whole.y), smooth = smoothed(laid);
    const std::optional<Registration> first = register_images(smooth);
    if (!first || std::abs(first->x) > 1.0 || std::abs(first->y) > 1.0) return std::nullopt;
    double x = first->x, y = first->y;
    for (int repeat = 0; repeat < 3; ++repeat) {  // beyond first order
        const std::optional<Registration> more = register_images(met_halfway(smooth, x, y));
        if (!more) return std::nullopt;
        x = std::clamp(x + more->x, -1.0, 1.0);
        y = std::clamp(y + more->y, -1.0, 1.0);
    }
    Shift shift{whole.x + x, whole.y + y, first->x_error, first->y_error, {}, met_halfway(laid, x, y),
        met_halfway(smooth, x, y)};
    const auto found = [](double value, double error) {
        return std::abs(value) > std::max(shift_sigmas * error, least_shift);
    };
    if (!found(shift.x, shift.x_error) && !found(shift.y, shift.y_error)) return std::nullopt;
    if (!same_in_all_quarters(shift.mended_smooth, std::hypot(shift.x, shift.y))) return std::nullopt;
    // Where they lay: the same pixels of the candidate.
    const std::uint32_t left = static_cast<std::uint32_t>(std::max(whole.x, 0)) + 1,
                        top = static_cast<std::uint32_t>(std::max(whole.y, 0)) + 1;
    shift.before = part_of(pair, {left, top, left + shift.mended.candidate.width, top + shift.mended.candidate.height});
    return shift;
}

}  // namespace tandem
