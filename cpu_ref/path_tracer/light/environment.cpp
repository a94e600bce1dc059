#include "cpu_ref/path_tracer/light/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cpu_ref/path_tracer/material/textures.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

namespace {

using glm::dvec3;
constexpr double pi = std::numbers::pi;

// Place of a unit direction: u and v of section 8.1, in [0, 1].
glm::dvec2 place_of(const dvec3& d) {
    return {0.5 + std::atan2(-d.z, d.x) / (2.0 * pi), std::acos(std::clamp(-d.y, -1.0, 1.0)) / pi};
}

// The least index whose cumulative sum exceeds v times the last, and the place of v within it, in [0, 1).
struct Choice {
    std::size_t index;
    double within;
};
Choice choose(const double* cumulative, std::size_t count, double v) {
    const double target = v * cumulative[count - 1];
    std::size_t index = static_cast<std::size_t>(std::upper_bound(cumulative, cumulative + count, target) - cumulative);
    if (index == count)  // rounding left none: the last one that has a share
        for (--index; index > 0 && cumulative[index - 1] == cumulative[index];) --index;
    const double below = index == 0 ? 0.0 : cumulative[index - 1];
    const double within = (target - below) / (cumulative[index] - below);
    return {index, std::clamp(within, 0.0, std::nextafter(1.0, 0.0))};
}

// Factor of a row's densities: 1, or with a planted bug the row's sine, as if all rows were as wide as the equator.
double row_factor(std::size_t row, std::size_t height) {
    if (!planted(PlantedBug::sky_sine_missing)) return 1.0;
    return std::sin(pi * (static_cast<double>(row) + 0.5) / static_cast<double>(height));
}

}  // namespace

ImageEnvironment::ImageEnvironment(const Background& background)
    : image_(background.image),
      scale_(background.image_scale),
      cosine_(std::cos(glm::radians(background.rotation_degrees))),
      sine_(std::sin(glm::radians(background.rotation_degrees))) {
    if (!background.sampled) return;
    const std::size_t width = image_->width, height = image_->height;
    const auto brightness = [&](std::size_t column, std::size_t row) {
        const float* texel = &image_->rgb[3 * (row * width + column)];
        return static_cast<double>(texel[0]) + static_cast<double>(texel[1]) + static_cast<double>(texel[2]);
    };
    for (std::size_t row = 0; row < height; ++row) {
        double sum = 0.0;
        const std::size_t above = row == 0 ? 0 : row - 1, below = std::min(row + 1, height - 1);
        for (std::size_t column = 0; column < width; ++column) {
            double brightest = 0.0;
            for (const std::size_t r : {above, row, below})
                for (const std::size_t c : {(column + width - 1) % width, column, (column + 1) % width})
                    brightest = std::max(brightest, brightness(c, r));
            shares_.push_back(brightest * solid_angle(row));
            row_sums_.push_back(sum += shares_.back());
        }
        cumulative_.push_back(total_ += sum);
    }
}

double ImageEnvironment::solid_angle(std::size_t row) const {
    const double height = image_->height, j = static_cast<double>(row);
    // cos a - cos b = 2 sin((a + b)/2) sin((b - a)/2), without cancellation.
    const double height_of_band = 2.0 * std::sin(pi * (j + 0.5) / height) * std::sin(0.5 * pi / height);
    return 2.0 * pi / image_->width * height_of_band;
}

dvec3 ImageEnvironment::to_image(const dvec3& d) const {
    return {d.x * cosine_ - d.z * sine_, d.y, d.x * sine_ + d.z * cosine_};
}

dvec3 ImageEnvironment::radiance(const dvec3& direction) const {
    const glm::dvec2 place = place_of(to_image(direction));
    return scale_ * bilinear(*image_, place.x, place.y, Rows::held);
}

ImageEnvironment::Sample ImageEnvironment::sample(double v1, double v2) const {
    const std::size_t width = image_->width, height = image_->height;
    const Choice row = choose(cumulative_.data(), height, v1);
    const Choice column = choose(&row_sums_[row.index * width], width, v2);
    const double top = std::cos(pi * static_cast<double>(row.index) / static_cast<double>(height));
    const double bottom = std::cos(pi * static_cast<double>(row.index + 1) / static_cast<double>(height));
    const double y = top + row.within * (bottom - top), rho = std::sqrt(std::max(0.0, 1.0 - y * y));
    const double u = (static_cast<double>(column.index) + column.within) / static_cast<double>(width);
    const double azimuth = 2.0 * pi * (u - 0.5), x = rho * std::cos(azimuth), z = -rho * std::sin(azimuth);
    const dvec3 direction(x * cosine_ + z * sine_, y, z * cosine_ - x * sine_);  // turned back
    return {direction,
        shares_[row.index * width + column.index] / (solid_angle(row.index) * total_) * row_factor(row.index, height)};
}

double ImageEnvironment::density(const dvec3& direction) const {
    const glm::dvec2 place = place_of(to_image(direction));
    const auto cell = [](double fraction, std::uint32_t count) {
        return std::min(static_cast<std::size_t>(std::max(0.0, fraction * count)), std::size_t{count} - 1);
    };
    const std::size_t row = cell(1.0 - place.y, image_->height), column = cell(place.x, image_->width);
    return shares_[row * image_->width + column] / (solid_angle(row) * total_) * row_factor(row, image_->height);
}

}  // namespace tandem::cpu
