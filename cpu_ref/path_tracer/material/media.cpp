#include "cpu_ref/path_tracer/material/media.h"

#include <array>
#include <cmath>
#include <limits>

#include "cpu_ref/planted.h"

namespace tandem::cpu {

namespace {

using glm::dvec3;
constexpr double infinity = std::numeric_limits<double>::infinity();

// The part of [0, length] in which the ray is within [low, high].
struct Interval {
    double begin, end;
};
Interval clip(const MediumRay& ray, const DensityGrid& grid, double length) {
    Interval inside{0.0, length};
    for (int i = 0; i < 3; ++i) {
        if (ray.direction[i] == 0.0) {
            if (ray.origin[i] < grid.low[i] || ray.origin[i] > grid.high[i]) inside.end = -1.0;
            continue;
        }
        const double a = (grid.low[i] - ray.origin[i]) / ray.direction[i];
        const double b = (grid.high[i] - ray.origin[i]) / ray.direction[i];
        inside.begin = std::max(inside.begin, std::min(a, b));
        inside.end = std::min(inside.end, std::max(a, b));
    }
    return inside;
}

}  // namespace

MediumForm::MediumForm(const Medium& medium)
    : scattering_(medium.scattering),
      extinction_(medium.absorption + medium.scattering),
      anisotropy_(medium.anisotropy),
      scatters_(scattering_ != dvec3(0.0)),
      grid_(medium.grid) {}

// Calls visit(density, begin, end) for the cells along the ray in order, until it returns false. Where a ray crosses
// into the next cell is computed from the cell's own border, so that errors do not add up.
template <class Visit>
void MediumForm::walk(const MediumRay& ray, double length, Visit visit) const {
    const DensityGrid& grid = *grid_;
    const Interval inside = clip(ray, grid, length);
    if (!(inside.begin < inside.end)) return;
    std::array<std::int64_t, 3> cell{}, count{}, step{};
    const dvec3 start = ray.origin + inside.begin * ray.direction;
    dvec3 size;
    for (int i = 0; i < 3; ++i) {
        const auto k = static_cast<std::size_t>(i);
        count[k] = grid.cells[k];
        size[i] = (grid.high[i] - grid.low[i]) / static_cast<double>(count[k]);
        const auto place = static_cast<std::int64_t>(std::floor((start[i] - grid.low[i]) / size[i]));
        cell[k] = std::min(count[k] - 1, std::max(std::int64_t{0}, place));
        step[k] = ray.direction[i] > 0.0 ? 1 : -1;
    }
    const auto border = [&](int i) {
        if (ray.direction[i] == 0.0) return infinity;
        const auto k = static_cast<std::size_t>(i);
        const double place = static_cast<double>(cell[k] + (step[k] > 0 ? 1 : 0));
        return (grid.low[i] + place * size[i] - ray.origin[i]) / ray.direction[i];
    };
    double begin = inside.begin;
    dvec3 next(border(0), border(1), border(2));
    while (begin < inside.end) {
        const int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
        const double end = std::max(begin, std::min(next[axis], inside.end));
        const auto index = static_cast<std::size_t>((cell[2] * count[1] + cell[1]) * count[0] + cell[0]);
        if (!visit(static_cast<double>(grid.density[index]), begin, end)) return;
        begin = end;
        const auto k = static_cast<std::size_t>(axis);
        cell[k] += step[k];
        if (cell[k] < 0 || cell[k] >= count[k]) return;
        next[axis] = border(axis);
    }
}

double MediumForm::density_integral(const MediumRay& ray, double length) const {
    if (!grid_) return length;
    double sum = 0.0;
    walk(ray, length, [&](double density, double begin, double end) {
        if (density > 0.0) sum += density * (end - begin);
        return true;
    });
    return sum;
}

double MediumForm::distance_to(const MediumRay& ray, double length, double target) const {
    if (!grid_) return target <= length ? target : infinity;
    double sum = 0.0, found = infinity;
    walk(ray, length, [&](double density, double begin, double end) {
        if (density <= 0.0) return true;
        const double through = sum + density * (end - begin);
        if (through < target) {
            sum = through;
            return true;
        }
        found = std::min(end, begin + (target - sum) / density);
        return false;
    });
    return found;
}

dvec3 MediumForm::attenuation(double integral) const {
    dvec3 result(1.0);
    for (int c = 0; c < 3; ++c)
        if (extinction_[c] > 0.0) result[c] = std::exp(-extinction_[c] * integral);
    return result;
}

dvec3 MediumForm::transmittance(const MediumRay& ray, double length) const {
    return attenuation(density_integral(ray, length));
}

MediumForm::Step MediumForm::advance(const MediumRay& ray, double end, double m1, double m2) const {
    if (!scatters_) return {false, 0.0, transmittance(ray, end)};
    const double sigma = extinction_[std::min(2, static_cast<int>(3.0 * m1))];
    const double target = sigma > 0.0 ? -std::log(1.0 - m2) / sigma : infinity;
    const double t = target < infinity ? distance_to(ray, end, target) : infinity;
    if (t < end) {
        // N(t) = target by construction. The density cancels from the weight.
        const dvec3 through = attenuation(target), rate = extinction_ * through;
        if (planted(PlantedBug::free_path_unweighted)) return {true, t, dvec3(1.0)};
        return {true, t, scattering_ * through * (3.0 / (rate.x + rate.y + rate.z))};
    }
    const dvec3 through = attenuation(density_integral(ray, end));
    return {false, 0.0, through * (3.0 / (through.x + through.y + through.z))};
}

}  // namespace tandem::cpu
