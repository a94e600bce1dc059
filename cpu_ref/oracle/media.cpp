#include "cpu_ref/oracle/media.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {
namespace {

using glm::dvec3;

// A stretch of the ray of one density > 0.
struct Piece {
    double begin, end, density;
};

double density_at(const DensityGrid& grid, const dvec3& p) {
    std::size_t index = 0;
    for (int axis = 2; axis >= 0; --axis) {
        const auto count = grid.cells[static_cast<std::size_t>(axis)];
        const double cell = std::floor((p[axis] - grid.low[axis]) / (grid.high[axis] - grid.low[axis]) * count);
        if (!(cell >= 0.0 && cell < count)) return 0.0;
        index = index * count + static_cast<std::size_t>(cell);
    }
    return grid.density[index];
}

// The pieces of [0, end] in order.
std::vector<Piece> pieces_of(const Medium& medium, const Ray& ray, double end) {
    if (!medium.grid) return {{0.0, end, 1.0}};
    const DensityGrid& grid = *medium.grid;
    std::vector<double> cuts{0.0};
    if (std::isfinite(end)) cuts.push_back(end);
    for (int axis = 0; axis < 3; ++axis) {
        const auto count = grid.cells[static_cast<std::size_t>(axis)];
        for (std::uint32_t plane = 0; plane <= count; ++plane) {
            const double at = glm::mix(grid.low[axis], grid.high[axis], static_cast<double>(plane) / count);
            const double t = (at - ray.origin[axis]) / ray.direction[axis];
            if (t > 0.0 && t < end) cuts.push_back(t);  // not for a ray along the plane: t is infinite or NaN
        }
    }
    std::ranges::sort(cuts);
    std::vector<Piece> pieces;
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
        if (cuts[i] == cuts[i + 1]) continue;
        const double middle = 0.5 * (cuts[i] + cuts[i + 1]);
        const double density = density_at(grid, ray.origin + middle * ray.direction);
        if (density > 0.0) pieces.push_back({cuts[i], cuts[i + 1], density});
    }
    return pieces;
}

double optical_length(const std::vector<Piece>& pieces) {  // N
    double sum = 0.0;
    for (const Piece& piece : pieces) sum += piece.density * (piece.end - piece.begin);
    return sum;
}

// exp(-sigma N), 1 where sigma = 0 even if N is infinite.
dvec3 transmittance_of(const dvec3& sigma, double n) {
    dvec3 result(1.0);
    for (int channel = 0; channel < 3; ++channel)
        if (sigma[channel] != 0.0) result[channel] = std::exp(-sigma[channel] * n);
    return result;
}

double mean(const dvec3& v) { return (v.x + v.y + v.z) / 3.0; }

}  // namespace

dvec3 transmittance(const Medium& medium, const Ray& ray, double end) {
    return transmittance_of(medium.absorption + medium.scattering, optical_length(pieces_of(medium, ray, end)));
}

Flight fly(const Medium& medium, const Ray& ray, double end, double channel_number, double number) {
    const std::vector<Piece> pieces = pieces_of(medium, ray, end);
    const dvec3 extinction = medium.absorption + medium.scattering;
    const dvec3 at_end = transmittance_of(extinction, optical_length(pieces));
    if (medium.scattering == dvec3(0.0)) return {std::nullopt, at_end};

    const double sigma = extinction[std::min(2, static_cast<int>(3.0 * channel_number))];
    const double target = sigma == 0.0 ? std::numeric_limits<double>::infinity() : -std::log(1.0 - number) / sigma;
    double before = 0.0;  // N where the piece begins
    for (const Piece& piece : pieces) {
        const double t = piece.begin + (target - before) / piece.density;
        if (t < piece.end) {
            const dvec3 left = transmittance_of(extinction, target);
            return {t, medium.scattering * left / mean(extinction * left)};
        }
        before += piece.density * (piece.end - piece.begin);
    }
    return {std::nullopt, at_end / mean(at_end)};
}

double phase_function(double g, double cosine) {
    return (1.0 - g * g) / (2.0 * two_pi * std::pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
}

dvec3 phase_direction(double g, const dvec3& direction, double a, double b) {
    double cosine = 1.0 - 2.0 * a;
    if (g != 0.0) {
        const double s = (1.0 - g * g) / (1.0 - g + 2.0 * g * a);
        cosine = std::clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
    }
    const double sine = std::sqrt(1.0 - cosine * cosine);
    return glm::normalize(
        Frame(direction).to_world({sine * std::cos(two_pi * b), sine * std::sin(two_pi * b), cosine}));
}

}  // namespace tandem::oracle
