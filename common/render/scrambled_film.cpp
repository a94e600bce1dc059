#include "common/render/scrambled_film.h"

#include <algorithm>

#include "common/error.h"

namespace tandem {

namespace {

// Samples this far apart are scrambled anew (MODEL.md section 3.2).
constexpr unsigned scrambling_shift = 32;
static_assert(std::uint64_t{1} << scrambling_shift == most_points);

}  // namespace

ScrambledFilm::ScrambledFilm(RenderJob& job, unsigned scramblings) : job_(job) {
    for (std::uint64_t i = 0; i < scramblings; ++i) of_scramblings_.emplace_back(i << scrambling_shift);
}

GrowingFilm::Growth ScrambledFilm::grow_to(std::uint64_t points, const RenderControl& control) {
    if (points > most_points)
        throw UnsupportedError("a scrambling of Sobol points has 2^32 of them; use another --generator");
    GrowingFilm::Growth growth;
    double done = 0.0;  // of this call
    for (GrowingEstimate& own : of_scramblings_) {
        const std::uint64_t has = own.count();
        if (has >= points) continue;
        if (control.stop.stop_requested()) return growth;
        RenderControl inner{.stop = control.stop, .progress = {}};
        if (control.progress) inner.progress = [&](double samples) { control.progress(done + samples); };
        const GrowingFilm::Growth part = own.grow_to(job_, points, inner);
        growth.add_time(part.seconds, part.device_seconds);
        done += static_cast<double>(own.count() - has);
        if (!part.complete) return growth;
    }
    growth.complete = true;
    return growth;
}

double ScrambledFilm::samples() const {
    double sum = 0.0;
    for (const GrowingEstimate& own : of_scramblings_) sum += static_cast<double>(own.count());
    return sum;
}

FilmMoments ScrambledFilm::film() const {
    FilmMoments film = of_scramblings_.front().film();
    for (std::size_t i = 1; i < of_scramblings_.size(); ++i) {
        const GrowingEstimate& own = of_scramblings_[i];
        own.add_to(film.moments);
        for (std::uint64_t& samples : film.counts) samples += own.count();
        film.invalid += own.blocks().invalid();
    }
    return film;
}

// A stop may leave them with different numbers of points. A mean over n_r of them counts n_r times, and its variance is
// taken to fall as 1 / n_r.
ScrambledFilm::Look ScrambledFilm::look() const {
    struct Own {
        std::vector<const Moments*> pieces;
        double per_point = 0.0, weight = 0.0, mean = 0.0;
    };
    const double all = samples(), degrees = static_cast<double>(of_scramblings_.size() - 1);
    if (all == 0.0) return {};
    std::vector<Own> scramblings;
    for (const GrowingEstimate& own : of_scramblings_) {
        const auto count = static_cast<double>(own.count());
        scramblings.push_back({{}, count > 0.0 ? 1.0 / count : 0.0, count / all});
        for (const Estimate::Piece& piece : own.pieces()) scramblings.back().pieces.push_back(piece.moments->data());
    }
    const bool tells =
        degrees > 0.0 && std::ranges::all_of(scramblings, [](const Own& own) { return own.weight > 0.0; });
    const std::uint64_t pixels = of_scramblings_.front().blocks().pixel_count();
    Look look{0.0, std::vector<double>(tells ? pixels : 0)};
    for (std::size_t i = 0; i < pixels * channel_count; ++i) {
        double mean = 0.0, error = 0.0;
        for (Own& own : scramblings) {
            double sum = 0.0;
            for (const Moments* piece : own.pieces) sum += piece[i].sum;
            own.mean = own.per_point * sum;
            mean += own.weight * own.mean;
        }
        for (const Own& own : scramblings) error += own.weight * (own.mean - mean) * (own.mean - mean);
        look.mean += mean;
        if (tells) look.pixel_errors[i / channel_count] += error / degrees;
    }
    look.mean /= static_cast<double>(pixels * channel_count);
    return look;
}

}  // namespace tandem
