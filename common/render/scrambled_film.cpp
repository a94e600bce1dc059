#include "common/render/scrambled_film.h"

#include <algorithm>
#include <utility>

#include "common/error.h"

namespace tandem {

namespace {

// Samples this far apart are scrambled anew (MODEL.md section 3.2).
constexpr unsigned scrambling_shift = 32;

}  // namespace

GrowingFilm::Growth ScrambledFilm::grow_to(std::uint64_t points, const RenderControl& control) {
    if (points > std::uint64_t{1} << scrambling_shift)
        throw UnsupportedError("a scrambling of Sobol points has 2^32 of them; use another --generator");
    GrowingFilm::Growth growth;
    double done = 0.0;  // of this call
    for (std::size_t i = 0; i < of_scramblings_.size(); ++i) {
        Estimate& own = of_scramblings_[i];
        const std::uint64_t has = own.count(), begin = std::uint64_t{i} << scrambling_shift;
        if (has >= points) continue;
        if (has % samples_per_block != 0) throw Error("a film cannot grow from samples that end within a block");
        if (control.stop.stop_requested()) return growth;
        RenderControl inner{.stop = control.stop, .progress = {}};
        if (control.progress) inner.progress = [&](double samples) { control.progress(done + samples); };
        RenderResult part = job_.render({begin + has, begin + points}, inner);
        growth.seconds += part.seconds;
        if (part.device_seconds) growth.device_seconds = growth.device_seconds.value_or(0.0) + *part.device_seconds;
        const std::uint64_t count = part.estimate.count();
        done += static_cast<double>(count);
        if (own.pixel_count() == 0)
            own = std::move(part.estimate);
        else if (count > 0)
            own.merge(std::move(part.estimate));
        if (count < points - has) return growth;
    }
    growth.complete = true;
    return growth;
}

double ScrambledFilm::samples() const {
    double sum = 0.0;
    for (const Estimate& own : of_scramblings_) sum += static_cast<double>(own.count());
    return sum;
}

FilmMoments ScrambledFilm::film() const {
    Estimate all = of_scramblings_.front();
    for (std::size_t i = 1; i < of_scramblings_.size(); ++i)
        if (of_scramblings_[i].count() > 0) all.merge(of_scramblings_[i]);
    return film_of(all);
}

// A stop may leave them with different numbers of points. A mean over n_r of them counts n_r times, and its variance is
// taken to fall as 1 / n_r.
std::vector<double> ScrambledFilm::pixel_errors() const {
    if (of_scramblings_.size() < 2 ||
        std::ranges::any_of(of_scramblings_, [](const Estimate& own) { return own.count() == 0; }))
        return {};
    const double all = samples(), degrees = static_cast<double>(of_scramblings_.size() - 1);
    const std::vector<double> mean = mean_of(film());
    std::vector<double> errors(mean.size() / channel_count, 0.0);
    for (const Estimate& own : of_scramblings_) {
        const double weight = static_cast<double>(own.count()) / all;
        const std::vector<double> of_own = mean_of(own);
        for (std::size_t i = 0; i < mean.size(); ++i) {
            const double deviation = of_own[i] - mean[i];
            errors[i / channel_count] += weight * deviation * deviation / degrees;
        }
    }
    return errors;
}

}  // namespace tandem
