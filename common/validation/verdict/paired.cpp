#include "common/validation/verdict/paired.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/statistics/distributions.h"
#include "common/statistics/multiple_tests.h"
#include "common/text.h"

namespace tandem {

std::string Arithmetic::text() const {
    return fmt::format("{} of the samples differ beyond rounding, single precision explains {}, {} are allowed",
        percent(level.worst.relative), percent(expected.share()), percent(allowed));
}

PairedDifferences::PairedDifferences(std::uint32_t width, std::uint32_t height, double rounding_tolerance)
    : width_(width),
      height_(height),
      rounding_tolerance_(rounding_tolerance),
      differences_(std::size_t{width} * height * channel_count),
      alternating_(differences_.size(), 0.0),
      reference_(differences_.size(), 0.0) {}

void PairedDifferences::add(const Estimate& reference, const Estimate& candidate) {
    const Estimate::Plane a = reference.totals(), b = candidate.totals();
    const double count = static_cast<double>(reference.count());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double difference = (b[i].sum - a[i].sum) / count;
        differences_[i].sum += difference;
        differences_[i].sum_of_squares += difference * difference;
        alternating_[i] += blocks_ % 2 == 0 ? difference : -difference;
        reference_[i] += a[i].sum / count;
        if (difference == 0.0) ++identical_;
        const double larger = std::max(std::abs(a[i].sum), std::abs(b[i].sum));
        if (std::abs(b[i].sum - a[i].sum) > rounding_tolerance_ * larger) ++diverged_;
    }
    ++blocks_;
    samples_ += reference.count();
}

LevelResult PairedDifferences::level(const std::string& name, std::uint32_t edge, const Scales& scales,
    double negligible, double tile_floor, double alpha_each_side) const {
    const TileGrid grid(width_, height_, edge);
    const double blocks = static_cast<double>(blocks_);
    struct Sums {
        MeanOfMeans difference;
        double reference = 0.0, squares = 0.0, pixels = 0.0;
    };
    std::vector<Sums> sums(grid.size() * channel_count);
    for (std::size_t i = 0; i < differences_.size(); ++i) {
        Sums& s = sums[grid.tile_of_pixel()[i / channel_count] * channel_count + i % channel_count];
        const Difference& d = differences_[i];
        const double mean = d.sum / blocks;
        const double variance = std::max(0.0, d.sum_of_squares - d.sum * mean) / (blocks - 1.0);
        s.difference.add(mean, variance / blocks, blocks - 1.0);
        s.reference += reference_[i] / blocks;
        s.squares += d.sum_of_squares / (blocks * blocks);
        s.pixels += 1.0;
    }
    LevelResult result;
    result.name = name;
    result.test = "paired t and distribution-free bound, Bonferroni";
    result.tests = sums.size();
    result.columns = grid.columns();
    result.rows = grid.rows();
    std::vector<double> p_values;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const MeanEstimate mean = sums[i].difference.result();
        const MeanDifference difference{mean.mean, std::sqrt(mean.variance), mean.dof};
        RegionComparison region;
        region.region = grid.rectangle(i / channel_count);
        region.channel = static_cast<std::uint32_t>(i % channel_count);
        region.reference = sums[i].reference / sums[i].pixels;
        region.candidate = region.reference + mean.mean;
        region.dof = mean.dof;
        const double floor = scales.image[region.channel] * (edge == 0 ? 1.0 : tile_floor);
        const double scale = std::max(region.reference, floor);
        if (scale > 0.0) {
            const Interval interval = difference.interval(alpha_each_side);
            const MeanDifference symmetric{mean.mean, std::sqrt(sums[i].squares) / sums[i].pixels, mean.dof};
            region.relative = mean.mean / scale;
            region.relative_low = interval.low / scale;
            region.relative_high = interval.high / scale;
            region.relative_error = difference.standard_error / scale;
            region.statistic = difference.statistic(negligible * scale);
            region.p = std::max(
                difference.p_value(negligible * scale), symmetric_sum_tail(symmetric.statistic(negligible * scale)));
        }
        p_values.push_back(region.p);
        result.regions.push_back(region);
    }
    result.p = bonferroni(p_values);
    result.worst = *std::ranges::min_element(result.regions, [](const RegionComparison& a, const RegionComparison& b) {
        return a.p != b.p ? a.p < b.p : std::abs(a.relative) > std::abs(b.relative);
    });
    return result;
}

LevelResult PairedDifferences::pixel_level(const Scales& scales, double negligible, double tile_floor) const {
    const TileGrid grid(width_, height_, standard_tile_edge);
    const double odd = static_cast<double>(blocks_ / 2), even = static_cast<double>(blocks_) - odd;
    struct Sums {
        double products = 0.0, squares = 0.0, reference = 0.0, pixels = 0.0;
    };
    std::vector<Sums> sums(grid.size() * channel_count);
    for (std::size_t i = 0; i < differences_.size(); ++i) {
        Sums& s = sums[grid.tile_of_pixel()[i / channel_count] * channel_count + i % channel_count];
        const double total = differences_[i].sum;
        const double product = 0.25 * (total + alternating_[i]) / even * (total - alternating_[i]) / odd;
        s.products += product;
        s.squares += product * product;
        s.reference += reference_[i] / static_cast<double>(blocks_);
        s.pixels += 1.0;
    }
    LevelResult result;
    result.name = paired_pixels_level;
    result.test = "products of halves, distribution-free bound, Bonferroni";
    result.tests = sums.size();
    result.columns = grid.columns();
    result.rows = grid.rows();
    std::vector<double> p_values;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const Sums& s = sums[i];
        RegionComparison region;
        region.region = grid.rectangle(i / channel_count);
        region.channel = static_cast<std::uint32_t>(i % channel_count);
        region.reference = s.reference / s.pixels;
        const double scale = std::max(region.reference, scales.image[region.channel] * tile_floor);
        const double excess = s.products - s.pixels * negligible * negligible * scale * scale;
        if (scale > 0.0) region.relative = std::sqrt(std::max(0.0, s.products / s.pixels)) / scale;
        if (excess > 0.0 && s.squares > 0.0) region.p = symmetric_sum_tail(excess / std::sqrt(s.squares));
        p_values.push_back(region.p);
        if (i == 0 || region.p < result.worst.p) result.worst = region;
    }
    result.p = bonferroni(p_values);
    return result;
}

PairedResult PairedDifferences::result(const Criteria& criteria, double alpha_each_side) const {
    PairedResult result;
    if (blocks_ < 2) return result;
    Scales scales;
    for (std::size_t i = 0; i < reference_.size(); ++i) scales.image[i % channel_count] += reference_[i];
    double grey = 0.0;
    for (double& mean : scales.image) {
        mean /= static_cast<double>(blocks_) * static_cast<double>(reference_.size() / channel_count);
        grey += mean / channel_count;
    }
    for (double& mean : scales.image) mean = std::max(mean, criteria.margins.channel_floor * grey);
    result.done = true;
    result.samples = samples_;
    result.blocks = blocks_;
    const Negligible& negligible = criteria.negligible;
    const double floor = criteria.margins.tile_floor;
    result.image = level("paired image", 0, scales, negligible.paired_image, floor, alpha_each_side);
    result.tiles =
        level("paired tiles 16x16", standard_tile_edge, scales, negligible.paired_tile, floor, alpha_each_side);
    result.pixels = pixel_level(scales, negligible.paired_pixel, floor);
    const double figures = static_cast<double>(blocks_) * static_cast<double>(differences_.size());
    result.identical_fraction = static_cast<double>(identical_) / figures;
    result.diverged_fraction = static_cast<double>(diverged_) / figures;
    return result;
}

LevelResult compare_paths(const Estimate& reference, const Estimate& candidate, double rounding_tolerance) {
    // Independent pixels differ by more than a quarter of their deviation with P(|N| > 1/4) = 80 %. Where a share q of
    // the samples has parted the deviation is sqrt(q) of that, so a quarter of the pixels parts at q = 4.7 %. That is a
    // hundred times the few in ten thousand that rounding parts. Yet 205 of a tile's 256 pixels are as many as 64
    // expected ones become once in 10^75.
    constexpr double tolerated_share = 0.25, parted_deviations = 0.25;
    const TileGrid grid(reference.width(), reference.height(), standard_tile_edge);
    const Estimate::Plane a = reference.totals(), b = candidate.totals();
    const double n = static_cast<double>(reference.count());
    std::vector<unsigned> noisy(grid.size()), parted(grid.size());
    for (std::size_t pixel = 0; pixel < reference.pixel_count(); ++pixel) {
        double difference = 0.0, variance = 0.0, mean = 0.0;
        for (std::size_t c = pixel * channel_count; c < (pixel + 1) * channel_count; ++c) {
            const auto variance_of = [&](const Moments& m) {
                return std::max(0.0, m.sum_of_squares - m.sum * m.sum / n) / (n - 1.0) / n;
            };
            const double both = variance_of(a[c]) + variance_of(b[c]);
            if (both <= variance) continue;
            variance = both;
            difference = std::abs(b[c].sum - a[c].sum) / n;
            mean = std::max(a[c].sum, b[c].sum) / n;
        }
        const double deviation = std::sqrt(variance);
        // A pixel whose quarter deviation is not above twice what rounding may do says nothing.
        if (!(parted_deviations * deviation > 2.0 * rounding_tolerance * mean)) continue;
        const std::uint32_t tile = grid.tile_of_pixel()[pixel];
        ++noisy[tile];
        if (difference > parted_deviations * deviation) ++parted[tile];
    }
    LevelResult result;
    result.name = paired_paths_level;
    result.test = "binomial tail of parted pixels, Bonferroni";
    result.tests = grid.size();
    result.columns = grid.columns();
    result.rows = grid.rows();
    std::vector<double> p_values;
    for (std::size_t tile = 0; tile < grid.size(); ++tile) {
        RegionComparison region;
        region.region = grid.rectangle(tile);
        region.reference = static_cast<double>(noisy[tile]);
        region.candidate = static_cast<double>(parted[tile]);
        region.relative = noisy[tile] > 0 ? region.candidate / region.reference : 0.0;
        region.p = parted[tile] > 0 ? binomial_upper_tail(parted[tile], noisy[tile], tolerated_share) : 1.0;
        p_values.push_back(region.p);
        if (tile == 0 || region.p < result.worst.p) result.worst = region;
    }
    result.p = bonferroni(p_values);
    return result;
}

}  // namespace tandem
