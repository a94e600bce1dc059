#include "common/render/growing_estimate.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tandem {

GrowingEstimate::Growth GrowingEstimate::grow_to(RenderJob& job, std::uint64_t samples, const RenderControl& control,
    const std::function<void(const Estimate&)>& added) {
    const std::uint64_t whole = blocks_.count(), before = count();
    RenderControl inner{.stop = control.stop, .progress = {}, .begun = &rest_};
    if (control.progress)
        inner.progress = [&](double done) {
            control.progress(std::max(0.0, static_cast<double>(whole) + done - static_cast<double>(before)));
        };
    RenderResult part = job.render({first_sample_ + whole, first_sample_ + samples}, inner);
    const std::uint64_t now = whole + part.estimate.count();
    if (blocks_.pixel_count() == 0) blocks_ = Estimate(part.estimate.width(), part.estimate.height());
    // A stop may come before a block has again what it had. Then that is still there, unless the job went on from it.
    if (now > before || whole + rest_.count() < before) {
        rest_ = part.estimate.take_ragged();
        if (added && part.estimate.count() > 0) added(part.estimate);
        blocks_.merge(std::move(part.estimate));
    }
    return {part.seconds, part.device_seconds, now == samples};
}

FilmMoments GrowingEstimate::film() const {
    FilmMoments film = film_of(blocks_);
    rest_.add_to(film.moments);  // the last piece
    for (std::uint64_t& samples : film.counts) samples += rest_.count();
    return film;
}

std::vector<Estimate::Piece> GrowingEstimate::pieces() const {
    std::vector<Estimate::Piece> all = blocks_.pieces();
    std::ranges::copy(rest_.pieces(), std::back_inserter(all));
    return all;
}

void GrowingEstimate::add_to(Estimate::Plane& sums) const {
    blocks_.add_to(sums);
    rest_.add_to(sums);
}

}  // namespace tandem
