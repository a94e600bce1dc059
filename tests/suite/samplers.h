// Samplers under test through the paths that they make. The vertices of `RenderJob::trace` tell direction, density and
// weight of every tracer in place, as renders use them. SAMPLERS.md is the table of what is tested how.
#pragma once

#include <algorithm>
#include <numbers>
#include <utility>

#include "common/render/path_trace.h"
#include "tests/chi_square.h"
#include "tests/suite/tracers.h"

namespace tandem::test::samplers {

inline constexpr double pi = std::numbers::pi;
inline constexpr std::uint64_t samples = 20000;
// False alarms: about 100 chi-square tests of fixed seeds.
inline constexpr double least_p = 1e-6;

// Cells of equal solid angle about +y, which the normals here are.
inline constexpr int rings = 24, sectors = 24, cells = rings * sectors;
inline std::size_t cell_of(const dvec3& d) {
    const double turn = std::atan2(d.z, d.x) / (2.0 * pi);
    const int ring = std::clamp(static_cast<int>(rings * 0.5 * (d.y + 1.0)), 0, rings - 1);
    const int sector = std::clamp(static_cast<int>(sectors * (turn - std::floor(turn))), 0, sectors - 1);
    return static_cast<std::size_t>(ring * sectors + sector);
}

using Density = std::function<double(const dvec3&)>;

// Calls visit(direction, solid angle) over a fine grid whose cells lie within those of `cell_of`.
inline void over_sphere(const std::function<void(const dvec3&, double)>& visit, int fine = 32) {
    const int rows = rings * fine, columns = sectors * fine;
    const double angle = 4.0 * pi / (static_cast<double>(rows) * columns);
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double y = 2.0 * (i + 0.5) / rows - 1.0, turn = 2.0 * pi * (j + 0.5) / columns;
            const double rho = std::sqrt(1.0 - y * y);
            visit({rho * std::cos(turn), y, rho * std::sin(turn)}, angle);
        }
}

// The share of a density in each cell; its sum is the integral.
inline std::vector<double> shares_of(const Density& density) {
    std::vector<double> shares(cells, 0.0);
    over_sphere([&](const dvec3& d, double angle) { shares[cell_of(d)] += angle * density(d); });
    return shares;
}
inline double sum_of(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum;
}

// Chi-square of directions, those that are zero (nothing drawn) in a cell of their own.
inline void check_directions(const std::vector<dvec3>& drawn, std::vector<double> shares) {
    std::vector<double> counts(cells + 1, 0.0);
    for (const dvec3& d : drawn) counts[d == dvec3(0.0) ? cells : cell_of(d)] += 1.0;
    const double rest = 1.0 - sum_of(shares);
    shares.push_back(rest > 1e-3 ? rest : 0.0);  // less is the error of the quadrature
    // A point beside the edge of an empty cell may round into it: cells are empty whose neighbours are.
    std::vector<double> expected(shares);
    for (std::size_t i = 0; i < cells; ++i) {
        if (shares[i] > 0.0) continue;
        const auto ring = static_cast<int>(i) / sectors, sector = static_cast<int>(i) % sectors;
        for (int r = std::max(0, ring - 1); r <= std::min(rings - 1, ring + 1); ++r)
            for (const int s : {sector, (sector + 1) % sectors, (sector + sectors - 1) % sectors})
                if (shares[static_cast<std::size_t>(r * sectors + s)] > 0.0) expected[i] = 1e-9;
    }
    for (double& share : expected) share *= static_cast<double>(drawn.size());
    const GoodnessOfFit fit = goodness_of_fit(counts, expected);
    CAPTURE(fit.cells);
    CHECK(fit.where_none == 0.0);
    CHECK(fit.p > least_p);
}

// The tracer's traces of one pixel's samples; none, and a failed check, where it cannot.
inline std::vector<PathTrace> traces_of(
    Tracer& tracer, const Scene& scene, const RenderSettings& settings, std::uint64_t count = samples) {
    try {
        return tracer.renderer->prepare(scene, settings)->trace(0, 0, {0, count});
    } catch (const UnsupportedError& error) {
        FAIL_CHECK(tracer.name << ": " << std::string(error.what()));
        return {};
    }
}

// One pixel that looks from `from` at the origin, too narrow for its directions to differ.
inline SceneBuilder looking_from(const dvec3& from) {
    SceneBuilder builder;
    builder.camera(from, {0, 0, 0}, 1e-3, std::abs(from.x) + std::abs(from.z) > 0.0 ? dvec3(0, 1, 0) : dvec3(0, 0, 1));
    return builder;
}

// Relative error allowed of figures of some hundred roundings, peaks of densities included.
inline double tolerance(const Tracer& tracer) { return 5e4 * tracer.unit_roundoff; }

inline double relative_error(double value, double answer) { return std::abs(value / answer - 1.0); }

}  // namespace tandem::test::samplers
