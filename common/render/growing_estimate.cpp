#include "common/render/growing_estimate.h"

#include <algorithm>
#include <utility>

namespace tandem {

GrowingEstimate::Growth GrowingEstimate::grow_to(RenderJob& job, std::uint64_t samples, const RenderControl& control,
    const std::function<void(const Estimate&)>& added) {
    const std::uint64_t whole = blocks_.count(), before = count();
    RenderControl inner{.stop = control.stop, .progress = {}};
    if (control.progress)
        inner.progress = [&](double done) {
            control.progress(std::max(0.0, static_cast<double>(whole) + done - static_cast<double>(before)));
        };
    RenderResult part = job.render({first_sample_ + whole, first_sample_ + samples}, inner);
    const std::uint64_t now = whole + part.estimate.count();
    if (blocks_.pixel_count() == 0) blocks_ = Estimate(part.estimate.width(), part.estimate.height());
    // A stop may come before a block has again what it had.
    if (now > before) {
        rest_ = part.estimate.take_ragged();
        if (added && part.estimate.count() > 0) added(part.estimate);
        blocks_.merge(std::move(part.estimate));
    }
    return {part.seconds, part.device_seconds, now == samples};
}

Estimate GrowingEstimate::all() const {
    Estimate all = blocks_;
    if (ends_within_block()) all.merge(rest_);
    return all;
}

FilmMoments GrowingEstimate::film() const {
    FilmMoments film = film_of(blocks_);
    if (!ends_within_block()) return film;
    const std::vector<Estimate::Piece> pieces = rest_.pieces();
    const Estimate::Plane& more = *pieces.front().moments;  // the last one, as Estimate::totals() adds them
    for (std::size_t i = 0; i < more.size(); ++i) {
        film.moments[i].sum += more[i].sum;
        film.moments[i].sum_of_squares += more[i].sum_of_squares;
    }
    for (std::uint64_t& samples : film.counts) samples += rest_.count();
    return film;
}

}  // namespace tandem
