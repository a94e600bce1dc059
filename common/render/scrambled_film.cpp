#include "common/render/scrambled_film.h"

#include <algorithm>

#include "common/error.h"

namespace tandem {

namespace {

// Samples this far apart are scrambled anew (MODEL.md section 3.2).
constexpr unsigned scrambling_shift = 32;

}  // namespace

ScrambledFilm::ScrambledFilm(RenderJob& job, unsigned scramblings) : job_(job) {
    for (std::uint64_t i = 0; i < scramblings; ++i) of_scramblings_.emplace_back(i << scrambling_shift);
}

GrowingFilm::Growth ScrambledFilm::grow_to(std::uint64_t points, const RenderControl& control) {
    if (points > std::uint64_t{1} << scrambling_shift)
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
std::vector<double> ScrambledFilm::pixel_errors(const FilmMoments& film) const {
    if (of_scramblings_.size() < 2 ||
        std::ranges::any_of(of_scramblings_, [](const GrowingEstimate& own) { return own.count() == 0; }))
        return {};
    const double all = samples(), degrees = static_cast<double>(of_scramblings_.size() - 1);
    std::vector<double> errors(film.pixel_count(), 0.0);
    Estimate::Plane sums;
    for (const GrowingEstimate& own : of_scramblings_) {
        const auto count = static_cast<double>(own.count());
        const double weight = count / all;
        sums.assign(film.moments.size(), {});
        own.add_to(sums);
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const double deviation = sums[i].sum / count - film.moments[i].sum / all;
            errors[i / channel_count] += weight * deviation * deviation / degrees;
        }
    }
    return errors;
}

}  // namespace tandem
