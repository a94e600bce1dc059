#include "common/validation/verdict/registration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "common/validation/verdict/levels.h"

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

// A factor is constant if nothing is left to see in tiles once it is taken out.
bool is_constant(const SampledImage& reference, SampledImage candidate, double exposure) {
    for (PixelStatistics& pixel : candidate.pixels) {
        pixel.mean /= exposure;
        pixel.variance /= exposure * exposure;
    }
    const Criteria criteria;
    const LevelResult tiles = compare_regions("tiles", reference, candidate, standard_tile_edge,
        scales_of(reference, candidate, criteria.margins), criteria.negligible.tile, criteria.margins.tile_floor,
        0.5 * criteria.doubt);
    return tiles.p > criteria.false_alarm;
}

std::string describe(const Registration& r) {
    std::string text;
    if (r.exposure_found)
        text = fmt::format("a constant exposure factor of {:.4f} ± {:.4f}", r.exposure, r.exposure_error);
    if (r.shift_found) {
        // First order overrates shifts across edges that are sharper than a pixel, by a quarter or so.
        const auto half = [](double s) { return std::abs(std::abs(s) - 0.5) < 0.25; };
        const bool is_half = half(r.shift_x) || half(r.shift_y);
        text += fmt::format("{}a shift of the candidate by ({:+.2f} ± {:.2f}, {:+.2f} ± {:.2f}) pixels{}",
            text.empty() ? "" : " and ", r.shift_x, r.shift_x_error, r.shift_y, r.shift_y_error,
            is_half ? ", about half a pixel" : "");
    }
    return text;
}

}  // namespace

Registration register_images(const SampledImage& reference, const SampledImage& candidate) {
    Registration result;
    const std::vector<Equation> equations = equations_of(reference, candidate);
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0);
    for (const Equation& e : equations) {
        normal += e.weight * glm::outerProduct(e.regressors, e.regressors);
        for (glm::length_t k = 0; k < 3; ++k) normal[k][k] -= e.weight * e.noise[k];
        right += e.weight * e.difference * e.regressors;
    }
    // Where the noise hides a gradient, nothing can be said of the shift along it.
    for (glm::length_t k = 0; k < 3; ++k)
        if (!(normal[k][k] > 0.0)) return result;
    if (!(glm::determinant(normal) > 0.0)) return result;
    const glm::dmat3 inverse = glm::inverse(normal);
    const glm::dvec3 solution = inverse * right;

    glm::dmat3 scatter(0.0);
    double before = 0.0, after = 0.0, noise = 0.0;
    for (const Equation& e : equations) {
        const double residual = e.difference - glm::dot(solution, e.regressors);
        scatter += e.weight * e.weight * residual * residual * glm::outerProduct(e.regressors, e.regressors);
        before += e.weight * e.difference * e.difference;
        after += e.weight * residual * residual;
        noise += e.weight * e.variance;
    }
    const glm::dmat3 covariance = inverse * scatter * inverse;
    const auto error = [&](glm::length_t k) { return std::sqrt(std::max(0.0, covariance[k][k])); };
    // b - a = e (a + b) / 2 is b = a (1 + e/2) / (1 - e/2).
    result.exposure = (1.0 + 0.5 * solution.x) / (1.0 - 0.5 * solution.x);
    result.exposure_error = error(0);
    result.shift_x = -solution.y;
    result.shift_y = -solution.z;
    result.shift_x_error = error(1);
    result.shift_y_error = error(2);
    result.explained = before > noise ? std::clamp((before - after) / (before - noise), 0.0, 1.0) : 0.0;
    constexpr double sigmas = 5.0, least_shift = 0.05, least_exposure = 1e-3, least_exposure_beside_shift = 5e-3;
    const auto found = [](double value, double sigma, double least) {
        return std::abs(value) > std::max(sigmas * sigma, least);
    };
    result.shift_found = found(result.shift_x, result.shift_x_error, least_shift) ||
                         found(result.shift_y, result.shift_y_error, least_shift);
    // Beside a shift, what first order leaves of sharp edges looks like a few thousandths of exposure.
    result.exposure_found = found(result.exposure - 1.0, result.exposure_error,
                                result.shift_found ? least_exposure_beside_shift : least_exposure) &&
                            (result.shift_found || is_constant(reference, candidate, result.exposure));
    result.text = describe(result);
    return result;
}

}  // namespace tandem
