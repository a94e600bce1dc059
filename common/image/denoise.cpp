#include "common/image/denoise.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numeric>
#include <thread>

#include "common/processors.h"

namespace tandem {

namespace {

using Plane = std::vector<double>;  // [y * width + x]

// MODEL.md section 11.6 has the equations. Lengths are pixels, the rest has no unit.
constexpr int window_radius = 8, patch_radius = 3;
constexpr double colour_bandwidth = 0.5;     // k_c: of the differences that noise explains
constexpr double albedo_offset = 0.01;       // so that light on black surfaces can be divided by their albedo
constexpr double normal_bandwidth = 0.15;    // of |n_p - n_q|, which is an angle where it is small
constexpr double depth_bandwidth = 0.02;     // relative
constexpr double depth_slope = 0.5;          // of what a slope foretells
constexpr double greatest_exponent = 20.0;   // exponents beyond it weigh nothing: e^-20
constexpr double unknown_variance = 1e76;    // the square of the greatest float
constexpr std::uint32_t rows_per_band = 16;  // fixed, so that bits do not depend on the number of threads

std::size_t offset_of(std::uint32_t y, std::uint32_t width, std::uint32_t x) { return std::size_t{y} * width + x; }

// Light per albedo, its variance and the features: what the distances are made of.
struct Guides {
    std::uint32_t width = 0, height = 0;
    std::array<Plane, channel_count> light, variance, albedo;  // albedo: plus the offset
    std::array<Plane, 3> normal;
    Plane normal_scale;                 // squared bandwidth
    Plane disparity, slope_x, slope_y;  // 1/depth, 0 where nothing was hit; it is linear in x and y on a plane
    double least_variance = 0.0;
};

// The smaller of both one-sided differences: across an edge the one that stays on its own side.
double slope(double before, double here, double after, bool has_before, bool has_after) {
    if (!has_before && !has_after) return 0.0;
    const double left = here - before, right = after - here;
    if (!has_before) return right;
    if (!has_after) return left;
    return std::abs(left) < std::abs(right) ? left : right;
}

double central(double before, double after, bool has_both) { return has_both ? 0.5 * (after - before) : 0.0; }

// Mean over the 3x3 pixels with weights (1 2 1) both ways: the variance of a few samples is itself noisy.
Plane smoothed(const Plane& values, std::uint32_t width, std::uint32_t height) {
    Plane result(values.size());
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            double sum = 0.0, weights = 0.0;
            for (std::uint32_t j = y == 0 ? 0 : y - 1; j < std::min(height, y + 2); ++j)
                for (std::uint32_t i = x == 0 ? 0 : x - 1; i < std::min(width, x + 2); ++i) {
                    const double weight = (i == x ? 2.0 : 1.0) * (j == y ? 2.0 : 1.0);
                    sum += weight * values[offset_of(j, width, i)];
                    weights += weight;
                }
            result[offset_of(y, width, x)] = sum / weights;
        }
    return result;
}

void add_colours(const NoisyImage& image, Guides& guides) {
    const std::size_t pixels = image.albedo.size();
    double mean = 0.0;
    for (std::size_t c = 0; c < channel_count; ++c) {
        Plane &light = guides.light.at(c), &variance = guides.variance.at(c), &albedo = guides.albedo.at(c);
        for (std::size_t i = 0; i < pixels; ++i) {
            albedo.push_back(std::max(0.0, image.albedo[i][static_cast<int>(c)]) + albedo_offset);
            light.push_back(image.mean[i * channel_count + c] / albedo[i]);
            const double of_mean = std::min(image.variance[i * channel_count + c], unknown_variance);
            variance.push_back(of_mean / (albedo[i] * albedo[i]));
            mean += std::abs(light[i]);
        }
        variance = smoothed(variance, image.width, image.height);
    }
    mean /= static_cast<double>(pixels * channel_count);
    constexpr double nothing = 1e-12;  // relative, squared: differences of a millionth are rounding
    guides.least_variance = nothing * mean * mean + 1e-300;
}

void add_features(const NoisyImage& image, Guides& guides) {
    const std::uint32_t width = image.width, height = image.height;
    const std::size_t pixels = image.depth.size();
    for (std::size_t i = 0; i < pixels; ++i) {
        const double depth = image.depth[i];
        guides.disparity.push_back(depth > 0.0 && std::isfinite(depth) ? 1.0 / depth : 0.0);
        for (int c = 0; c < 3; ++c) guides.normal.at(static_cast<std::size_t>(c)).push_back(image.normal[i][c]);
    }
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const std::size_t i = offset_of(y, width, x);
            const bool left = x > 0, right = x + 1 < width, above = y > 0, below = y + 1 < height;
            const auto at = [&](const Plane& plane, bool there, std::size_t place) {
                return there ? plane[place] : 0.0;
            };
            const Plane& d = guides.disparity;
            guides.slope_x.push_back(slope(at(d, left, i - 1), d[i], at(d, right, i + 1), left, right));
            guides.slope_y.push_back(slope(at(d, above, i - width), d[i], at(d, below, i + width), above, below));
            double gradient = 0.0;  // squared
            for (const Plane& n : guides.normal) {
                const double across = central(at(n, left, i - 1), at(n, right, i + 1), left && right);
                const double down = central(at(n, above, i - width), at(n, below, i + width), above && below);
                gradient += across * across + down * down;
            }
            guides.normal_scale.push_back(std::max(normal_bandwidth * normal_bandwidth, gradient));
        }
}

Guides guides_of(const NoisyImage& image) {
    Guides guides;
    guides.width = image.width;
    guides.height = image.height;
    add_colours(image, guides);
    add_features(image, guides);
    return guides;
}

// How unlike the features of p and q are: the square of their distance in bandwidths. (dx, dy) leads from p to q.
double feature_distance(const Guides& guides, std::size_t p, std::size_t q, int dx, int dy) {
    double of_normal = 0.0;
    for (const Plane& normal : guides.normal) {
        const double difference = normal[p] - normal[q];
        of_normal += difference * difference;
    }
    const double here = guides.disparity[p], there = guides.disparity[q];
    const double foretold = guides.slope_x[p] * dx + guides.slope_y[p] * dy;
    const double off = there - here - foretold;
    const double width = depth_bandwidth * here + depth_slope * std::abs(foretold);
    const double of_depth = off == 0.0 ? 0.0 : width > 0.0 ? off * off / (width * width) : 2.0 * greatest_exponent;
    return std::max(of_normal / guides.normal_scale[p], of_depth);
}

// Rows [begin, end) of the result.
class Band {
public:
    Band(const Guides& guides, std::uint32_t begin, std::uint32_t end)
        : guides_(guides),
          begin_(begin),
          end_(end),
          from_(begin > reach ? begin - reach : 0),
          to_(std::min(guides.height, end + reach)),
          weights_(pixels(), 1.0) {
        for (Plane& sum : sums_) sum.assign(pixels(), 0.0);
        for (Plane* plane : {&distances_, &across_}) plane->assign(std::size_t{to_ - from_} * guides.width, 0.0);
    }

    // Takes in the pixels at (dx, dy) from each.
    void add(int dx, int dy) {
        const auto width = static_cast<int>(guides_.width), height = static_cast<int>(guides_.height);
        if (std::abs(dx) >= width || std::abs(dy) >= height) return;
        const int left = std::max(0, -dx), right = std::min(width, width - dx);
        const int above = std::max(static_cast<int>(from_), -dy), below = std::min(static_cast<int>(to_), height - dy);
        if (above >= below) return;
        for (int y = above; y < below; ++y) measure_row(y, left, right, dx, dy);
        for (int y = above; y < below; ++y) add_across(y, left, right);
        for (int y = std::max(above, static_cast<int>(begin_)); y < std::min(below, static_cast<int>(end_)); ++y)
            for (int x = left; x < right; ++x) weigh(x, y, {left, right, above, below}, dx, dy);
    }

    // Light that is gathered, times the albedo of its own pixel.
    void finish(const NoisyImage& image, std::vector<double>& result) const {
        for (std::size_t i = 0; i < pixels(); ++i) {
            const std::size_t pixel = std::size_t{begin_} * guides_.width + i;
            for (std::size_t c = 0; c < channel_count; ++c) {
                const double before = image.mean[pixel * channel_count + c];
                const double value = before + guides_.albedo.at(c)[pixel] * (sums_.at(c)[i] / weights_[i]);
                result[pixel * channel_count + c] = std::max(std::min(0.0, before), value);
            }
        }
    }

private:
    struct Bounds {
        int left, right, above, below;  // pixels with a counterpart
    };
    static constexpr std::uint32_t reach = patch_radius;

    [[nodiscard]] std::size_t pixels() const { return std::size_t{end_ - begin_} * guides_.width; }
    [[nodiscard]] std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y - static_cast<int>(from_)) * guides_.width + static_cast<std::size_t>(x);
    }
    [[nodiscard]] std::size_t pixel(int x, int y) const {
        return static_cast<std::size_t>(y) * guides_.width + static_cast<std::size_t>(x);
    }

    // The squared difference of each pixel to its counterpart, less what noise explains, by what noise explains.
    void measure_row(int y, int left, int right, int dx, int dy) {
        const auto count = static_cast<std::size_t>(right - left);
        double* distances = &distances_[place(left, y)];
        std::fill_n(distances, count, 0.0);
        constexpr double squared_bandwidth = colour_bandwidth * colour_bandwidth;
        for (std::size_t c = 0; c < channel_count; ++c) {
            const double *light = &guides_.light.at(c)[pixel(left, y)],
                         *other = &guides_.light.at(c)[pixel(left + dx, y + dy)];
            const double *own = &guides_.variance.at(c)[pixel(left, y)],
                         *theirs = &guides_.variance.at(c)[pixel(left + dx, y + dy)];
            for (std::size_t i = 0; i < count; ++i) {
                const double difference = light[i] - other[i];
                distances[i] += (difference * difference - own[i] - std::min(own[i], theirs[i])) /
                                (guides_.least_variance + squared_bandwidth * (own[i] + theirs[i]));
            }
        }
    }

    void add_across(int y, int left, int right) {
        const double* distances = &distances_[place(0, y)];
        double* across = &across_[place(0, y)];
        for (int x = left; x < right; ++x) {
            double sum = 0.0;
            for (int i = std::max(left, x - patch_radius); i < std::min(right, x + patch_radius + 1); ++i)
                sum += distances[i];
            across[x] = sum;
        }
    }

    void weigh(int x, int y, Bounds bounds, int dx, int dy) {
        const int first = std::max(bounds.above, y - patch_radius), last = std::min(bounds.below, y + patch_radius + 1);
        const int columns = std::min(bounds.right, x + patch_radius + 1) - std::max(bounds.left, x - patch_radius);
        double sum = 0.0;
        for (int j = first; j < last; ++j) sum += across_[place(x, j)];
        const double colour =
            sum / static_cast<double>(channel_count * static_cast<std::uint32_t>(columns * (last - first)));
        if (!(colour < greatest_exponent)) return;
        const std::size_t p = pixel(x, y), q = pixel(x + dx, y + dy), own = p - pixel(0, static_cast<int>(begin_));
        const double distance = std::max({0.0, colour, feature_distance(guides_, p, q, dx, dy)});
        if (!(distance < greatest_exponent)) return;
        const double weight = std::exp(-distance);
        weights_[own] += weight;
        for (std::size_t c = 0; c < channel_count; ++c)
            sums_.at(c)[own] += weight * (guides_.light.at(c)[q] - guides_.light.at(c)[p]);
    }

    const Guides& guides_;
    std::uint32_t begin_, end_, from_, to_;  // rows of the result; rows that patches reach
    Plane weights_, distances_, across_;
    std::array<Plane, channel_count> sums_;
};

// False after a stop.
bool filter_band(const NoisyImage& image, const Guides& guides, std::uint32_t band, const std::stop_token& stop,
    std::vector<double>& result) {
    const std::uint32_t begin = band * rows_per_band;
    Band rows(guides, begin, std::min(guides.height, begin + rows_per_band));
    for (int dy = -window_radius; dy <= window_radius; ++dy) {
        if (stop.stop_requested()) return false;
        for (int dx = -window_radius; dx <= window_radius; ++dx)
            if (dx != 0 || dy != 0) rows.add(dx, dy);
    }
    rows.finish(image, result);
    return true;
}

}  // namespace

std::optional<std::vector<double>> denoise(const NoisyImage& image, const DenoiseControl& control) {
    const Guides guides = guides_of(image);
    std::vector<double> result(image.mean.size());
    const std::uint32_t bands = (image.height + rows_per_band - 1) / rows_per_band;
    std::atomic<std::uint32_t> next = 0;
    std::atomic<bool> stopped = false;
    std::mutex telling;
    std::uint32_t done = 0;  // under `telling`
    const auto work = [&] {
        for (std::uint32_t band = next++; band < bands; band = next++) {
            if (!filter_band(image, guides, band, control.stop, result)) {
                stopped = true;
                return;
            }
            const std::lock_guard lock(telling);
            ++done;
            if (control.progress) control.progress(static_cast<double>(done) / bands);
        }
    };
    const unsigned wanted = control.threads > 0 ? control.threads : usable_processors();
    {
        std::vector<std::jthread> others;
        for (unsigned i = 1; i < std::min(wanted, bands); ++i) others.emplace_back(work);
        work();
    }
    if (stopped) return std::nullopt;
    return result;
}

}  // namespace tandem
