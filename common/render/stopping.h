// Renders until a number of samples, a time or an error is reached, or a stop is requested, whichever comes first.
#pragma once

#include <functional>
#include <optional>

#include "common/render/renderer.h"

namespace tandem {

struct StoppingRule {
    std::optional<std::uint64_t> samples;  // a pixel
    std::optional<double> seconds;         // wall clock; what is begun of a sample by then is dropped
    std::optional<double> relative_error;  // see relative_error_of
    // So long, in place of `seconds`, may the first sample take; empty: as long as it does.
    std::optional<double> first_sample_seconds = {};
    // That the error is forecast to need, of all scramblings. Fewer than a block of each let the first look come there.
    std::optional<double> expected_samples = {};
    bool whole_blocks = false;  // looks come at whole blocks alone: for plain sums, which go on from block to block
};

// No fewer samples a pixel are forecast to be enough, as their scatter tells too little: of some 10^5 paths in all.
[[nodiscard]] std::uint64_t least_judged(std::uint64_t pixels, unsigned scramblings);

struct RenderProgress {
    double samples = 0.0;   // a pixel
    double fraction = 0.0;  // of the whole, by the rule that will likely end it
    std::optional<double> relative_error;
};

// An error and the interval that holds what an image like this one really has, with 95 %.
struct ErrorInterval {
    double low = 0.0, high = 0.0;
};

struct StoppedRender {
    FilmMoments film;      // of no size where no pixel has a sample that counts
    double seconds = 0.0;  // of rendering; by error wall clock, with looks and the planning of passes
    std::optional<double> device_seconds;
    std::optional<double> relative_error;                  // none below two samples
    std::optional<ErrorInterval> relative_error_interval;  // none of an image without noise
    bool complete = true;  // false: stop request, or an error asked for of a black image
    double begun = 0.0;    // where no pixel has a sample that counts: the part of the first that was done
};

// Root mean square, over pixels and channels, of the standard error of the mean, divided by the mean over pixels and
// channels. None below two samples or for a black image.
[[nodiscard]] std::optional<double> relative_error_of(const FilmMoments& film);

// Adaptive: samples of the rule are a pixel's in the mean, and the job is prepared for it. Scramblings: of Sobol
// points, for which the job is prepared; with two or more the error is known by them (scrambled_film.h).
[[nodiscard]] StoppedRender render_until(RenderJob& job, const StoppingRule& rule, std::stop_token stop,
    const std::function<void(const RenderProgress&)>& progress, Sampling sampling = Sampling::uniform,
    unsigned scramblings = 1);

}  // namespace tandem
