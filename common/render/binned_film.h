// A large film seen as a small one. Each pixel of the small film is a bin: a rectangle of pixels of the large film. A
// sample of a bin is one of a pixel that is chosen at random in it. So its distribution is that of a pixel as large as
// the bin, and statistics made for small films hold. Every pixel of the large film may be chosen, with its own numbers.
#pragma once

#include <memory>

#include "common/render/renderer.h"

namespace tandem {

[[nodiscard]] inline FilmSize size_of(const RenderSettings& settings) { return {settings.width, settings.height}; }

// Which sample of the film a sample of a bin is. The choice depends on bin, sample and seed alone, and so is the same
// for all renderers. `bins`: how many there are, at most as many as pixels either way.
struct FilmSample {
    std::uint32_t x = 0, y = 0;  // of the film
    std::uint64_t sample = 0;    // a multiple of samples_per_block, another one for each sample of the bin
};
[[nodiscard]] FilmSample film_sample(
    FilmSize film, FilmSize bins, std::uint32_t x, std::uint32_t y, std::uint64_t sample, std::uint64_t seed);

// All bins have equally many pixels. Else the mean over bins is not quite that over the film.
[[nodiscard]] inline bool bins_are_equal(FilmSize film, FilmSize bins) {
    return film.width % bins.width == 0 && film.height % bins.height == 0;
}

// Its jobs render settings.width x settings.height bins of `film`; a size that exceeds the film is rendered as it is.
// What `renderer` cannot render as lists of pixels, it refuses (why_no_pixel_lists). Memory is that of the bins alone.
[[nodiscard]] std::unique_ptr<Renderer> binned_renderer(Renderer& renderer, FilmSize film);
[[nodiscard]] std::unique_ptr<Renderer> binned_renderer(std::unique_ptr<Renderer> renderer, FilmSize film);

}  // namespace tandem
