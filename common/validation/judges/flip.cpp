// FLIP of low dynamic range: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP, a difference
// evaluator for alternating images. HPG 2020. Equation numbers are the paper's steps: spatial filters, colour,
// features.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "common/validation/judges/judges.h"

namespace tandem {

namespace {

using Colour = std::array<double, 3>;

constexpr double pi = std::numbers::pi;
constexpr double pixels_per_degree =
    0.7 * 3840.0 / 0.7 * pi / 180.0;  // a screen 0.7 m wide, of 3840 pixels, 0.7 m away
constexpr Colour white{0.950428545, 1.0, 1.088900371};

Colour to_xyz(const Colour& c) {  // relative to the white point
    return {(0.412390799 * c[0] + 0.357584339 * c[1] + 0.180480788 * c[2]) / white[0],
        (0.212639006 * c[0] + 0.715168679 * c[1] + 0.072192315 * c[2]) / white[1],
        (0.019330819 * c[0] + 0.119194780 * c[1] + 0.950532152 * c[2]) / white[2]};
}

Colour to_opponent(const Colour& rgb) {  // YCxCz
    const Colour n = to_xyz(rgb);
    return {116.0 * n[1] - 16.0, 500.0 * (n[0] - n[1]), 200.0 * (n[1] - n[2])};
}

Colour from_opponent(const Colour& c) {
    const double y = (c[0] + 16.0) / 116.0, x = (y + c[1] / 500.0) * white[0], z = (y - c[2] / 200.0) * white[2];
    const Colour rgb{3.240969942 * x - 1.537383178 * y - 0.498610760 * z,
        -0.969243636 * x + 1.875967502 * y + 0.041555057 * z, 0.055630080 * x - 0.203976959 * y + 1.056971514 * z};
    return {std::clamp(rgb[0], 0.0, 1.0), std::clamp(rgb[1], 0.0, 1.0), std::clamp(rgb[2], 0.0, 1.0)};
}

Colour to_hunt_lab(const Colour& rgb) {
    constexpr double delta = 6.0 / 29.0;
    const Colour n = to_xyz(rgb);
    const auto f = [](double t) {
        return t > delta * delta * delta ? std::cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
    };
    const double l = 116.0 * f(n[1]) - 16.0;
    return {l, 0.01 * l * 500.0 * (f(n[0]) - f(n[1])), 0.01 * l * 200.0 * (f(n[1]) - f(n[2]))};
}

double hyab(const Colour& a, const Colour& b) { return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

// A plane of numbers.
struct Plane {
    int width = 0, height = 0;
    std::vector<double> values;  // row by row
};

// Weights along one axis, from -radius to radius. Every filter of FLIP is a product of one along each axis, or a sum of
// two such products.
using Weights = std::vector<double>;

template <class Weight>
Weights weights_of(int radius, const Weight& weight) {
    Weights weights;
    for (int d = -radius; d <= radius; ++d) weights.push_back(weight(d));
    return weights;
}

double sum_of(const Weights& weights) { return std::accumulate(weights.begin(), weights.end(), 0.0); }

Weights scaled(Weights weights, double by) {
    for (double& weight : weights) weight *= by;
    return weights;
}

// Filters `count` values that lie `stride` apart; the first and the last are repeated outwards.
void filter_line(const double* values, double* result, int count, int stride, const Weights& weights) {
    const int radius = static_cast<int>(weights.size() / 2);
    for (int i = 0; i < count; ++i) {
        double sum = 0.0;
        for (int d = -radius; d <= radius; ++d)
            sum += weights[static_cast<std::size_t>(d + radius)] * values[std::clamp(i + d, 0, count - 1) * stride];
        result[i * stride] = sum;
    }
}

Plane convolved(const Plane& plane, const Weights& along_x, const Weights& along_y) {
    Plane rows = plane, result = plane;
    for (int y = 0; y < plane.height; ++y) {
        const int first = y * plane.width;
        filter_line(plane.values.data() + first, rows.values.data() + first, plane.width, 1, along_x);
    }
    for (int x = 0; x < plane.width; ++x)
        filter_line(rows.values.data() + x, result.values.data() + x, plane.height, plane.width, along_y);
    return result;
}

// By the contrast sensitivity in one opponent channel: a sum of Gaussians, whose weights sum to 1.
Plane filtered(const Plane& plane, double a1, double b1, double a2 = 0.0, double b2 = 1.0) {
    const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(0.04 / (2.0 * pi * pi)) * pixels_per_degree));
    const auto gaussian = [&](double b) {
        return weights_of(
            radius, [&](int d) { return std::exp(-pi * pi * d * d / (b * pixels_per_degree * pixels_per_degree)); });
    };
    const Weights first = gaussian(b1), second = gaussian(b2);
    const double whole1 = a1 * std::sqrt(pi / b1) * sum_of(first) * sum_of(first),
                 whole2 = a2 * std::sqrt(pi / b2) * sum_of(second) * sum_of(second), share = whole1 / (whole1 + whole2);
    const Weights unit1 = scaled(first, 1.0 / sum_of(first));
    Plane result = convolved(plane, scaled(unit1, share), unit1);
    if (!(a2 > 0.0)) return result;
    const Weights unit2 = scaled(second, 1.0 / sum_of(second));
    const Plane more = convolved(plane, scaled(unit2, 1.0 - share), unit2);
    for (std::size_t i = 0; i < more.values.size(); ++i) result.values[i] += more.values[i];
    return result;
}

// Magnitudes of derivatives of a Gaussian: of first order for edges, of second for points. Positive weights sum to 1,
// negative ones to −1.
Plane magnitude(const Plane& grey, bool points) {
    constexpr double width = 0.082;  // of the features, degrees
    const double sigma = 0.5 * width * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3.0 * sigma));
    const auto gaussian = [&](int d) { return std::exp(-d * d / (2.0 * sigma * sigma)); };
    const Weights bell = weights_of(radius, gaussian), across = scaled(bell, 1.0 / sum_of(bell));
    Weights along =
        weights_of(radius, [&](int d) { return gaussian(d) * (points ? d * d / (sigma * sigma) - 1.0 : -d); });
    double positive = 0.0, negative = 0.0;
    for (const double weight : along) (weight > 0.0 ? positive : negative) += std::abs(weight);
    for (double& weight : along) weight /= weight > 0.0 ? positive : negative;
    Plane x = convolved(grey, along, across);
    const Plane y = convolved(grey, across, along);
    for (std::size_t i = 0; i < x.values.size(); ++i) x.values[i] = std::hypot(x.values[i], y.values[i]);
    return x;
}

struct Prepared {
    std::array<Plane, 3> filtered;  // YCxCz
    Plane edges, points;            // magnitudes
};

Prepared prepare(const std::vector<double>& linear, std::uint32_t width, std::uint32_t height) {
    const Plane empty{static_cast<int>(width), static_cast<int>(height), std::vector<double>(linear.size() / 3)};
    std::array<Plane, 3> planes{empty, empty, empty};
    Plane grey = empty;
    for (std::size_t i = 0; i < linear.size() / 3; ++i) {
        const Colour rgb{std::clamp(linear[3 * i], 0.0, 1.0), std::clamp(linear[3 * i + 1], 0.0, 1.0),
            std::clamp(linear[3 * i + 2], 0.0, 1.0)};
        const Colour opponent = to_opponent(rgb);
        for (std::size_t c = 0; c < 3; ++c) planes[c].values[i] = opponent[c];
        grey.values[i] = (opponent[0] + 16.0) / 116.0;
    }
    return {{filtered(planes[0], 1.0, 0.0047), filtered(planes[1], 1.0, 0.0053),
                filtered(planes[2], 34.1, 0.04, 13.5, 0.025)},
        magnitude(grey, false), magnitude(grey, true)};
}

// Compresses large differences of colour: 0.4 of the greatest comes to 0.95.
double redistributed(double difference, double greatest) {
    constexpr double part = 0.4, target = 0.95;
    const double knee = part * greatest;
    return difference < knee ? target / knee * difference
                             : target + (difference - knee) / (greatest - knee) * (1.0 - target);
}

}  // namespace

double flip_error(
    const std::vector<double>& reference, const std::vector<double>& test, std::uint32_t width, std::uint32_t height) {
    constexpr double exponent = 0.7;
    const Prepared a = prepare(reference, width, height), b = prepare(test, width, height);
    const double greatest = std::pow(hyab(to_hunt_lab({0.0, 1.0, 0.0}), to_hunt_lab({0.0, 0.0, 1.0})), exponent);
    const auto seen = [](const Prepared& image, std::size_t i) {
        return to_hunt_lab(
            from_opponent({image.filtered[0].values[i], image.filtered[1].values[i], image.filtered[2].values[i]}));
    };
    double sum = 0.0;
    const std::size_t pixels = reference.size() / 3;
    for (std::size_t i = 0; i < pixels; ++i) {
        const double colour = redistributed(std::pow(hyab(seen(a, i), seen(b, i)), exponent), greatest);
        const double feature = std::max(
            std::abs(a.edges.values[i] - b.edges.values[i]), std::abs(a.points.values[i] - b.points.values[i]));
        sum += std::pow(colour, 1.0 - std::sqrt(std::min(1.0, feature / std::sqrt(2.0))));
    }
    return sum / static_cast<double>(pixels);
}

}  // namespace tandem
