#include "common/render/estimate.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include "common/error.h"

namespace tandem {

namespace {

void add_into(Estimate::Plane& target, const Estimate::Plane& addend) {
    for (std::size_t i = 0; i < target.size(); ++i) {
        target[i].sum += addend[i].sum;
        target[i].sum_of_squares += addend[i].sum_of_squares;
    }
}

// The run that the range is; nothing where it is none.
std::optional<Estimate::Run> run_of(SampleRange range) {
    if (range.count() < samples_per_block || !std::has_single_bit(range.count()) || range.begin % range.count() != 0)
        return std::nullopt;
    return Estimate::Run{range.begin / samples_per_block,
        static_cast<std::uint32_t>(std::countr_zero(range.count() / samples_per_block))};
}

SampleRange range_of(const Estimate::Run& run) {
    const std::uint64_t begin = run.first_block * samples_per_block;
    return {begin, begin + (samples_per_block << run.level)};
}

}  // namespace

Estimate::Estimate(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {}

void Estimate::check_free(SampleRange range) const {
    for (const SampleRange& taken : ranges())
        if (range.begin < taken.end && taken.begin < range.end)
            throw Error("samples " + std::to_string(range.begin) + " to " + std::to_string(range.end) +
                        " are already part of this estimate; merge disjoint ranges only");
}

void Estimate::add_block(SampleRange range, Plane moments) {
    if (moments.size() != pixel_count() * channel_count)
        throw Error("a block's moments do not fit the estimate's size");
    const std::optional<Run> run = run_of(range);
    const bool in_a_block = range.begin < range.end && range.count() < samples_per_block;
    if (range.begin % samples_per_block != 0 || (!run && !in_a_block))
        throw Error("a sample range must begin at a multiple of " + std::to_string(samples_per_block) +
                    " and be a run of blocks or lie in one");
    check_free(range);
    if (run)
        insert(*run, std::move(moments));
    else
        ragged_.emplace(range.begin, std::pair{range.end, std::move(moments)});
}

// Joins complete siblings, always lower + upper, until the run has none: the forest depends on the set of blocks alone.
void Estimate::insert(Run run, Plane plane) {
    for (;;) {
        const std::uint64_t length = std::uint64_t{1} << run.level;
        const bool lower = (run.first_block / length) % 2 == 0;
        const Run sibling{lower ? run.first_block + length : run.first_block - length, run.level};
        const auto found = runs_.find(sibling);
        if (found == runs_.end()) break;
        if (lower) {
            add_into(plane, found->second);
        } else {
            add_into(found->second, plane);
            plane = std::move(found->second);
        }
        runs_.erase(found);
        run = {std::min(run.first_block, sibling.first_block), run.level + 1};
    }
    runs_.emplace(run, std::move(plane));
}

void Estimate::merge(Estimate other) {
    if (other.width_ != width_ || other.height_ != height_)
        throw Error("estimates of different sizes cannot be merged");
    for (const SampleRange& range : other.ranges()) check_free(range);
    for (auto& [run, plane] : other.runs_) insert(run, std::move(plane));
    ragged_.merge(other.ragged_);
    invalid_ += other.invalid_;
}

Estimate Estimate::take_ragged() {
    Estimate taken(width_, height_);
    taken.ragged_.swap(ragged_);
    return taken;
}

std::uint64_t Estimate::ragged_count(std::uint64_t begin) const {
    const auto found = ragged_.find(begin);
    return found == ragged_.end() ? 0 : found->second.first - begin;
}

Estimate::Plane Estimate::take_ragged_moments(std::uint64_t begin) {
    Plane moments = std::move(ragged_.at(begin).second);
    ragged_.erase(begin);
    return moments;
}

std::uint64_t Estimate::count() const {
    std::uint64_t total = 0;
    for (const SampleRange& range : ranges()) total += range.count();
    return total;
}

std::vector<SampleRange> Estimate::ranges() const {
    std::vector<SampleRange> joined;
    for (const auto& [range, plane] : pieces()) {
        if (!joined.empty() && joined.back().end == range.begin)
            joined.back().end = range.end;
        else
            joined.push_back(range);
    }
    return joined;
}

std::vector<Estimate::Piece> Estimate::pieces() const {
    std::vector<Piece> all;
    for (const auto& [run, plane] : runs_) all.push_back({range_of(run), &plane});
    for (const auto& [begin, ragged] : ragged_) all.push_back({{begin, ragged.first}, &ragged.second});
    std::ranges::sort(all, {}, [](const Piece& piece) { return piece.range.begin; });
    return all;
}

Estimate::Plane Estimate::totals() const {
    Plane total(pixel_count() * channel_count);
    add_to(total);
    return total;
}

void Estimate::add_to(Plane& sums) const {
    for (const Piece& piece : pieces()) add_into(sums, *piece.moments);
}

double mean_from(const Moments& moments, std::uint64_t count) {
    return count == 0 ? 0.0 : moments.sum / static_cast<double>(count);
}

double variance_from(const Moments& moments, std::uint64_t count) {
    if (count < 2) return std::numeric_limits<double>::quiet_NaN();
    const double n = static_cast<double>(count);
    // Cancellation can leave a tiny negative number where all samples are equal.
    return std::max(0.0, (moments.sum_of_squares - moments.sum * (moments.sum / n)) / (n - 1.0));
}

namespace {

template <class Figure>
std::vector<double> per_channel(const FilmMoments& film, Figure figure) {
    std::vector<double> result(film.moments.size());
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = figure(film.moments[i], film.counts[i / channel_count]);
    return result;
}

}  // namespace

std::vector<double> mean_of(const FilmMoments& film) { return per_channel(film, mean_from); }
std::vector<double> variance_of(const FilmMoments& film) { return per_channel(film, variance_from); }
std::vector<double> mean_of(const Estimate& estimate) { return mean_of(film_of(estimate)); }
std::vector<double> variance_of(const Estimate& estimate) { return variance_of(film_of(estimate)); }

std::uint64_t FilmMoments::paths() const { return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}); }

double FilmMoments::count() const {
    return counts.empty() ? 0.0 : static_cast<double>(paths()) / static_cast<double>(counts.size());
}

FilmMoments film_of(const Estimate& estimate) {
    return {estimate.width(), estimate.height(), estimate.totals(),
        std::vector<std::uint64_t>(estimate.pixel_count(), estimate.count()), estimate.invalid()};
}

}  // namespace tandem
