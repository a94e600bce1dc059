// FLIP of low dynamic range: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP, a difference
// evaluator for alternating images. HPG 2020. Equation numbers are the paper's steps: spatial filters, colour,
// features.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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

// A plane of numbers, its rim repeated outwards.
struct Plane {
    int width = 0, height = 0;
    std::vector<double> values;
    [[nodiscard]] double at(int x, int y) const {
        return values[static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1))];
    }
};

struct Kernel {
    int radius = 0;
    std::vector<double> weights;  // row by row
};

template <class Weight>
Kernel kernel_of(int radius, const Weight& weight) {
    Kernel kernel{radius, {}};
    for (int y = -radius; y <= radius; ++y)
        for (int x = -radius; x <= radius; ++x) kernel.weights.push_back(weight(x, y));
    return kernel;
}

Plane convolved(const Plane& plane, const Kernel& kernel) {
    Plane result = plane;
    for (int y = 0; y < plane.height; ++y)
        for (int x = 0; x < plane.width; ++x) {
            double sum = 0.0;
            std::size_t i = 0;
            for (int dy = -kernel.radius; dy <= kernel.radius; ++dy)
                for (int dx = -kernel.radius; dx <= kernel.radius; ++dx)
                    sum += kernel.weights[i++] * plane.at(x + dx, y + dy);
            result.values[static_cast<std::size_t>(y * plane.width + x)] = sum;
        }
    return result;
}

// Contrast sensitivity in one opponent channel: a sum of Gaussians.
Kernel sensitivity(double a1, double b1, double a2, double b2) {
    const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(0.04 / (2.0 * pi * pi)) * pixels_per_degree));
    Kernel kernel = kernel_of(radius, [&](int x, int y) {
        const double square = (x * x + y * y) / (pixels_per_degree * pixels_per_degree);
        const auto gaussian = [&](double a, double b) {
            return a * std::sqrt(pi / b) * std::exp(-pi * pi * square / b);
        };
        return gaussian(a1, b1) + gaussian(a2, b2);
    });
    double sum = 0.0;
    for (const double weight : kernel.weights) sum += weight;
    for (double& weight : kernel.weights) weight /= sum;
    return kernel;
}

// Derivatives of a Gaussian along x or y: of first order for edges, of second for points. Positive weights sum to 1,
// negative ones to −1.
Kernel detector(bool points, bool along_y) {
    constexpr double width = 0.082;  // of the features, degrees
    const double sigma = 0.5 * width * pixels_per_degree;
    Kernel kernel = kernel_of(static_cast<int>(std::ceil(3.0 * sigma)), [&](int x, int y) {
        const double along = along_y ? y : x, gaussian = std::exp(-(x * x + y * y) / (2.0 * sigma * sigma));
        return points ? (along * along / (sigma * sigma) - 1.0) * gaussian : -along * gaussian;
    });
    double positive = 0.0, negative = 0.0;
    for (const double weight : kernel.weights) (weight > 0.0 ? positive : negative) += std::abs(weight);
    for (double& weight : kernel.weights) weight /= weight > 0.0 ? positive : negative;
    return kernel;
}

struct Prepared {
    std::array<Plane, 3> filtered;  // YCxCz
    Plane edges, points;            // magnitudes
};

Plane magnitude(const Plane& grey, bool points) {
    Plane x = convolved(grey, detector(points, false));
    const Plane y = convolved(grey, detector(points, true));
    for (std::size_t i = 0; i < x.values.size(); ++i) x.values[i] = std::hypot(x.values[i], y.values[i]);
    return x;
}

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
    return {{convolved(planes[0], sensitivity(1.0, 0.0047, 0.0, 1e-5)),
                convolved(planes[1], sensitivity(1.0, 0.0053, 0.0, 1e-5)),
                convolved(planes[2], sensitivity(34.1, 0.04, 13.5, 0.025))},
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
