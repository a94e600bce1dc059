#include "common/render/adaptive_sampling.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>

#include "common/error.h"

namespace tandem {

namespace {

void check_numbers(std::uint64_t samples, std::uint64_t numbers) {
    if (samples > numbers)
        throw UnsupportedError("adaptive sampling has no numbers for so many samples; use --sampling uniform");
}
constexpr double finest_unit = 0.125;  // of what a round adds to a pixel in the mean: counts are multiples of it

// Colour of a pixel's field on a chequerboard.
std::uint32_t colour_of(std::uint64_t pixel, std::uint32_t width) {
    return static_cast<std::uint32_t>((pixel % width + pixel / width) % 2);
}

std::array<std::vector<std::uint32_t>, 2> colours(std::uint32_t width, std::uint64_t pixels) {
    std::array<std::vector<std::uint32_t>, 2> lists;
    for (std::uint64_t pixel = 0; pixel < pixels; ++pixel)
        lists[colour_of(pixel, width)].push_back(static_cast<std::uint32_t>(pixel));
    return lists;
}

// Variances of one sample, the channels of a pixel added up.
std::vector<double> pixel_variances(const Estimate& estimate) {
    const std::vector<double> of_channels = variance_of(estimate);
    std::vector<double> variances(estimate.pixel_count(), 0.0);
    for (std::size_t i = 0; i < of_channels.size(); ++i) variances[i / channel_count] += of_channels[i];
    return variances;
}

template <class Value>
std::vector<Value> picked(std::span<const Value> values, std::span<const std::uint32_t> places) {
    std::vector<Value> result;
    result.reserve(places.size());
    for (const std::uint32_t place : places) result.push_back(values[place]);
    return result;
}

struct Neighbour {
    int x = 0, y = 0;
    double weight = 0.0;
};

// Pixels of the other colour: the four nearest, and those a knight's move away.
constexpr std::array<Neighbour, 12> neighbours = [] {
    constexpr int reach = 2;
    constexpr double nearest = 1.0, others = 0.125;
    std::array<Neighbour, 12> all;
    std::size_t next = 0;
    for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x)
            if ((x + y) % 2 != 0) all[next++] = {x, y, x == 0 || y == 0 ? nearest : others};
    return all;
}();

// Whole numbers near the values, whose partial sums are the values' own, rounded.
std::vector<std::uint64_t> rounded(const std::vector<double>& values) {
    std::vector<std::uint64_t> result;
    result.reserve(values.size());
    double sum = 0.0, before = 0.0;
    for (const double value : values) {
        sum += value;
        const double now = std::round(sum);
        result.push_back(static_cast<std::uint64_t>(now - before));
        before = now;
    }
    return result;
}

}  // namespace

std::vector<double> neighbour_deviations(std::uint32_t width, std::uint32_t height, std::span<const double> variances) {
    const int columns = static_cast<int>(width), rows = static_cast<int>(height);
    std::vector<double> result(variances.size(), 0.0);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x) {
            double sum = 0.0, weights = 0.0;
            for (const Neighbour& near : neighbours) {
                const int u = x + near.x, v = y + near.y;
                if (u < 0 || u >= columns || v < 0 || v >= rows) continue;
                sum += near.weight * variances[static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)];
                weights += near.weight;
            }
            if (weights > 0.0)
                result[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = std::sqrt(sum / weights);
        }
    return result;
}

// The minimum has n_i = max(least_i, s deviation_i) [by Lagrange multipliers]. First s is computed from all pixels, and
// those below their least are set to it. Then s is computed from the others. It only becomes smaller, so no pixel has
// been set wrongly.
std::vector<double> allocate(std::span<const double> deviations, std::span<const double> least, double total) {
    std::vector<double> counts(least.begin(), least.end());
    std::vector<std::size_t> free;  // not set yet
    double left = total, sum = 0.0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        left -= least[i];
        if (!(deviations[i] > 0.0)) continue;
        free.push_back(i);
        sum += deviations[i];
    }
    if (free.empty()) {
        for (double& count : counts) count += left / static_cast<double>(counts.size());
        return counts;
    }
    for (const std::size_t i : free) left += least[i];
    for (;;) {
        const double scale = left / sum;
        const auto below = [&](std::size_t i) { return scale * deviations[i] < least[i]; };
        const auto first_set = std::stable_partition(free.begin(), free.end(), std::not_fn(below));
        if (first_set == free.end() || first_set == free.begin()) {
            for (const std::size_t i : free) counts[i] = std::max(least[i], scale * deviations[i]);
            return counts;
        }
        std::for_each(first_set, free.end(), [&](std::size_t i) {
            left -= least[i];
            sum -= deviations[i];
        });
        free.erase(first_set, free.end());
    }
}

std::optional<Foretold> foretell(const Estimate& pilot) {
    const std::vector<double> variances = pixel_variances(pilot);
    const std::vector<double> deviations = neighbour_deviations(pilot.width(), pilot.height(), variances);
    double uniform = 0.0, adaptive = 0.0;
    Foretold foretold;
    for (const std::vector<std::uint32_t>& colour : colours(pilot.width(), pilot.pixel_count())) {
        const std::vector<double> counts = allocate(picked<double>(deviations, colour),
            std::vector<double>(colour.size(), uniform_share), static_cast<double>(colour.size()));
        for (std::size_t i = 0; i < colour.size(); ++i) {
            uniform += variances[colour[i]];
            adaptive += variances[colour[i]] / counts[i];
            foretold.most = std::max(foretold.most, counts[i]);
            if (counts[i] > 1.0) foretold.favoured.push_back(colour[i]);
        }
    }
    if (!(uniform > 0.0)) return std::nullopt;
    std::ranges::sort(foretold.favoured);
    foretold.squared_error = adaptive / uniform;
    return foretold;
}

void VarianceScatter::add(const Estimate& part, std::span<const std::uint32_t> pixels) {
    const auto samples = static_cast<double>(part.count());
    if (samples < 2.0) return;
    const std::vector<double> variances = pixel_variances(part);
    if (pixels.empty()) pixels_.resize(variances.size());
    for (std::size_t i = 0; i < variances.size(); ++i) {
        Sums& sums = pixels_[pixels.empty() ? i : pixels[i]];
        sums.samples += samples;
        sums.variance += samples * variances[i];
        sums.squares += samples * variances[i] * variances[i];
        ++sums.parts;
    }
}

std::optional<VarianceScatter::Misjudged> VarianceScatter::misjudged(std::span<const std::uint64_t> counts) const {
    double error = 0.0, variance = 0.0, by_degrees = 0.0;
    if (pixels_.size() != counts.size()) return std::nullopt;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const Sums& sums = pixels_[i];
        if (sums.parts < 2) return std::nullopt;
        const auto n = static_cast<double>(counts[i]), degrees = static_cast<double>(sums.parts - 1);
        const double mean = sums.variance / sums.samples;
        const double scatter =
            std::max(0.0, sums.squares - sums.variance * mean) / degrees / sums.samples / (n * n);  // of mean / n
        error += mean / n;
        variance += scatter;
        by_degrees += scatter * scatter / degrees;
    }
    if (!(error > 0.0) || !(by_degrees > 0.0)) return std::nullopt;
    return Misjudged{std::sqrt(variance) / error, variance * variance / by_degrees};
}

bool GrowingFilm::grow_alike(std::uint64_t samples, const RenderControl& control, Growth& growth) {
    if (control.stop.stop_requested()) return false;
    const std::uint64_t before = uniform_.count();
    RenderControl inner{.stop = control.stop, .progress = {}};
    if (control.progress) inner.progress = [&, had = samples_](double more) { control.progress(had + more); };
    const Growth part =
        uniform_.grow_to(job_, samples, inner, [&](const Estimate& blocks) { scatter_.add(blocks, {}); });
    growth.add_time(part.seconds, part.device_seconds);
    samples_ += static_cast<double>(uniform_.count() - before);
    return part.complete;
}

bool GrowingFilm::render_pass(
    SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control, Growth& growth) {
    if (control.stop.stop_requested()) return false;
    const double share = static_cast<double>(pixels.size()) / static_cast<double>(more_counts_.size());
    RenderControl inner{.stop = control.stop, .progress = {}};
    if (control.progress) inner.progress = [&, had = samples_](double more) { control.progress(had + share * more); };
    const RenderResult part = job_.render_pixels(range, pixels, inner);
    growth.add_time(part.seconds, part.device_seconds);
    const std::uint64_t count = part.estimate.count();
    samples_ += share * static_cast<double>(count);
    scatter_.add(part.estimate, pixels);
    const Estimate::Plane sums = part.estimate.totals();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        more_counts_[pixels[i]] += count;
        for (std::size_t c = 0; c < channel_count; ++c) {
            Moments& target = more_[pixels[i] * channel_count + c];
            target.sum += sums[i * channel_count + c].sum;
            target.sum_of_squares += sums[i * channel_count + c].sum_of_squares;
        }
    }
    more_invalid_ += part.estimate.invalid();
    return count == range.count();
}

// What pixels lack of `samples` a pixel. Each colour shares out its own by the other's noise, as the samples that all
// pixels have alike show it. Nothing here depends on a pixel's own samples. Counts so far do not either, as they came
// about in the same way.
std::vector<std::uint64_t> GrowingFilm::units_to_add(std::uint64_t samples, std::uint64_t unit) const {
    const std::uint32_t width = uniform_.blocks().width();
    const std::vector<double> deviations =
        neighbour_deviations(width, uniform_.blocks().height(), pixel_variances(uniform_.blocks()));
    const double alike = static_cast<double>(uniform_.count()), mean = static_cast<double>(samples);
    std::vector<std::uint64_t> units(deviations.size(), 0);
    for (const std::vector<std::uint32_t>& colour : colours(width, deviations.size())) {
        std::vector<double> counts;
        for (const std::uint32_t pixel : colour) counts.push_back(alike + static_cast<double>(more_counts_[pixel]));
        const double have = std::accumulate(counts.begin(), counts.end(), 0.0);
        const double total = std::max(have, mean * static_cast<double>(colour.size()));
        std::vector<double> wanted = allocate(picked<double>(deviations, colour), counts, total);
        for (std::size_t i = 0; i < wanted.size(); ++i)
            wanted[i] = std::max(0.0, wanted[i] - counts[i]) / static_cast<double>(unit);
        const std::vector<std::uint64_t> whole = rounded(wanted);
        for (std::size_t i = 0; i < whole.size(); ++i) units[colour[i]] = whole[i];
    }
    return units;
}

// A pass for every binary digit of the counts, the greatest first: so many samples of the pixels whose counts have it.
bool GrowingFilm::add_passes(std::uint64_t samples, const RenderControl& control, Growth& growth) {
    const double left = std::max(0.0, static_cast<double>(samples) - samples_);
    const std::uint64_t unit =
        std::max<std::uint64_t>(2, std::bit_floor(static_cast<std::uint64_t>(finest_unit * left)));
    const std::vector<std::uint64_t> units = units_to_add(samples, unit);
    const std::uint64_t most = units.empty() ? 0 : *std::ranges::max_element(units);
    for (std::uint64_t digit = std::bit_floor(most); digit > 0; digit /= 2) {
        std::vector<std::uint32_t> pixels;
        for (std::size_t i = 0; i < units.size(); ++i)
            if ((units[i] & digit) != 0) pixels.push_back(static_cast<std::uint32_t>(i));
        if (pixels.empty()) continue;
        const std::uint64_t begin = first_sample_ + numbers_alike + next_more_, count = unit * digit;
        check_numbers(next_more_ + count, film_numbers - numbers_alike);
        if (!render_pass({begin, begin + count}, pixels, control, growth)) return false;
        next_more_ += (count + samples_per_block - 1) / samples_per_block * samples_per_block;
    }
    return true;
}

GrowingFilm::Growth GrowingFilm::grow_to(std::uint64_t samples, const RenderControl& control) {
    Growth growth;
    RenderControl here{.stop = control.stop, .progress = {}};
    if (control.progress) here.progress = [&, before = samples_](double done) { control.progress(done - before); };
    std::uint64_t wanted = samples;
    const bool adapts = sampling_ == Sampling::adaptive && samples > least_alike;
    if (adapts) {
        // In whole blocks, but no more than are left to be shared out.
        const double blocks = std::ceil(uniform_share * static_cast<double>(samples) / samples_per_block);
        const double had = samples_ - static_cast<double>(uniform_.rest().count());
        const double left = std::floor((static_cast<double>(samples) - had) / samples_per_block);
        wanted = std::min(std::max(least_alike, static_cast<std::uint64_t>(blocks) * samples_per_block),
            uniform_.blocks().count() + static_cast<std::uint64_t>(std::max(0.0, left)) * samples_per_block);
        check_numbers(wanted, numbers_alike);
    }
    if (wanted > uniform_.count() && !grow_alike(wanted, here, growth)) return growth;
    if (adapts) {
        more_.resize(uniform_.blocks().pixel_count() * channel_count);
        more_counts_.resize(uniform_.blocks().pixel_count(), 0);
        if (!add_passes(samples, here, growth)) return growth;
    }
    growth.complete = true;
    return growth;
}

FilmMoments GrowingFilm::film() const {
    FilmMoments film = uniform_.film();
    film.invalid += more_invalid_;
    for (std::size_t i = 0; i < more_.size(); ++i) {
        film.moments[i].sum += more_[i].sum;
        film.moments[i].sum_of_squares += more_[i].sum_of_squares;
    }
    for (std::size_t i = 0; i < more_counts_.size(); ++i) film.counts[i] += more_counts_[i];
    return film;
}

VarianceScatter GrowingFilm::scatter() const {
    VarianceScatter scatter = scatter_;
    if (uniform_.ends_within_block()) scatter.add(uniform_.rest(), {});
    return scatter;
}

}  // namespace tandem
