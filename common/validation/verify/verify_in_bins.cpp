#include "common/validation/verify/verify_in_bins.h"

#include <fmt/format.h>

#include <cmath>

namespace tandem {

namespace {

// The share of the pixels that a side has chosen at least once, expected.
double share_looked_at(double samples, double bin_pixels) {
    return -std::expm1(samples * std::log1p(-1.0 / bin_pixels));
}

std::string share_text(double share) { return share > 0.9995 ? "nearly all" : fmt::format("{:.2g} %", 100.0 * share); }

}  // namespace

SceneVerdict verify_in_bins(
    const Scene& scene, Renderer& reference, Renderer& candidate, VerifyOptions options, FilmSize film) {
    const FilmSize bins{options.settings->width, options.settings->height};
    const auto a = binned_renderer(reference, film), b = binned_renderer(candidate, film);
    const auto oracle = options.oracle != nullptr ? binned_renderer(*options.oracle, film) : nullptr;
    const auto other = options.other_precision != nullptr ? binned_renderer(*options.other_precision, film) : nullptr;
    options.oracle = oracle.get();
    options.other_precision = other.get();
    if (options.with_kernel)
        options.with_kernel = [film, make = options.with_kernel](
                                  const std::string& kernel) { return binned_renderer(make(kernel), film); };
    if (options.in_precision)
        options.in_precision = [film, make = options.in_precision](VerifiedSide side, Precision precision) {
            std::unique_ptr<Renderer> renderer = make(side, precision);
            return renderer ? binned_renderer(std::move(renderer), film) : nullptr;
        };
    options.equal_pixels = bins_are_equal(film, bins);
    SceneVerdict verdict = verify_scene(scene, *a, *b, options);
    verdict.film = film;
    if (verdict.worst) {
        WorstPixel& worst = *verdict.worst;
        const FilmSample at = film_sample(film, bins, worst.x, worst.y, worst.sample, worst.seed);
        worst.x = at.x;
        worst.y = at.y;
        worst.sample = at.sample;
    }
    const double bin_pixels = static_cast<double>(film.pixel_count()) / static_cast<double>(bins.pixel_count());
    const auto samples = static_cast<double>(std::min(verdict.reference.samples, verdict.candidate.samples));
    verdict.notes.push_back(fmt::format(
        "judged are {}x{} bins of the film of {}x{} pixels, each sample at a pixel of its bin that was chosen at "
        "random; each side looked at {} of all pixels",
        bins.width, bins.height, film.width, film.height, share_text(share_looked_at(samples, bin_pixels))));
    return verdict;
}

}  // namespace tandem
