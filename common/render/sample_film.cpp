#include "common/render/sample_film.h"

#include <algorithm>

#include "common/deadline.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

constexpr std::uint64_t most_samples = std::uint64_t{1} << 40;

// Adds ranges of samples to a film, whole blocks for good and a ragged one for the image in hand.
class FilmGrowth {
public:
    FilmGrowth(RenderJob& job, StoppedRender& result)
        : job_(job), result_(result), blocks_(result.film.width, result.film.height) {}

    // False: it was stopped. Either way the result's film is the one with the most samples.
    bool grow_to(std::uint64_t samples, const RenderControl& control) {
        const std::uint64_t whole = samples / samples_per_block * samples_per_block;
        if (blocks_.count() < whole && !add({blocks_.count(), whole}, control, blocks_)) return false;
        Estimate image = blocks_;
        return samples == whole ? take(image, samples) : add({whole, samples}, control, image);
    }

private:
    bool add(SampleRange range, const RenderControl& control, Estimate& sums) {
        RenderResult part = job_.render(range, control);
        result_.seconds += part.seconds;
        if (part.device_seconds) result_.device_seconds = result_.device_seconds.value_or(0.0) + *part.device_seconds;
        sums.merge(std::move(part.estimate));
        return take(sums, range.end);
    }

    bool take(const Estimate& sums, std::uint64_t samples) {
        if (static_cast<double>(sums.count()) > result_.film.count()) result_.film = film_of(sums);
        return sums.count() == samples;
    }

    RenderJob& job_;
    StoppedRender& result_;
    Estimate blocks_;
};

}  // namespace

StoppedRender render_film(RenderJob& job, const StoppingRule& rule, std::uint64_t factor, const std::stop_token& stop,
    const std::function<void(const RenderProgress&)>& progress,
    const std::function<void(std::uint64_t, const FilmMoments&)>& keep) {
    const Stopwatch watch;
    const std::uint64_t last = rule.samples.value_or(most_samples);
    StoppingRule first = rule;
    first.samples = 1;
    StoppedRender result = render_until(job, first, stop, progress);
    if (result.film.count() == 0.0) return result;
    keep(1, result.film);

    const Deadline limit(
        stop, rule.seconds ? std::optional(std::max(1e-3, *rule.seconds - watch.seconds())) : std::nullopt);
    FilmGrowth film(job, result);
    std::uint64_t done = 1;
    while (done < last && !limit.passed()) {
        const std::uint64_t next = done > last / factor ? last : done * factor;
        // Below a block each image is rendered from its first sample.
        const std::uint64_t kept = done / samples_per_block * samples_per_block;
        const auto tell = [&](double samples) {
            const double all = std::min(static_cast<double>(kept) + samples, static_cast<double>(next));
            double fraction = rule.samples ? all / static_cast<double>(last) : 0.0;
            if (rule.seconds) fraction = std::max(fraction, watch.seconds() / *rule.seconds);
            if (progress) progress({all, fraction, std::nullopt});
        };
        if (!film.grow_to(next, {.stop = limit.token(), .progress = tell})) break;
        done = next;
        keep(done, result.film);
    }
    result.relative_error = relative_error_of(result.film);
    result.relative_error_interval.reset();
    result.complete = !stop.stop_requested() || done == rule.samples;
    return result;
}

}  // namespace tandem
