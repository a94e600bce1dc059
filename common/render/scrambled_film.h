// An image rendered with Sobol points, and an estimate of its error (MODEL.md section 11.4). Its samples come from a
// few independent scramblings of the sequence. The differences of their means give the error.
#pragma once

#include <optional>
#include <vector>

#include "common/render/adaptive_sampling.h"

namespace tandem {

// A scrambling has so many. Further samples are those of the next one (MODEL.md section 3.2).
inline constexpr std::uint64_t most_points = std::uint64_t{1} << 32;

// How many scramblings an image of so many pixels has. Fewer points each are less even, so there are two where the
// pixels are many enough to tell the error by all of them together.
[[nodiscard]] constexpr unsigned scramblings_for(std::uint64_t pixels) { return pixels >= 4096 ? 2 : 8; }

class ScrambledFilm {
public:
    // `job` must outlive it, and be prepared with Generator::sobol. `scramblings` >= 1; one tells no error.
    ScrambledFilm(RenderJob& job, unsigned scramblings);

    // Goes on until each scrambling has `points` a pixel, or until a stop. `progress` tells samples that are added.
    GrowingFilm::Growth grow_to(std::uint64_t points, const RenderControl& control);

    [[nodiscard]] double samples() const;  // a pixel, of all scramblings
    [[nodiscard]] FilmMoments film() const;

    struct Look {
        double mean = 0.0;  // of the image, over pixels and channels
        // The variance of the mean of every pixel, its channels added up, as the scramblings tell it. It is known by
        // scramblings - 1 degrees of freedom a pixel. Empty where a scrambling has no samples, or is the only one.
        std::vector<double> pixel_errors;
    };
    // Copies no sums, as a GPU idles meanwhile.
    [[nodiscard]] Look look() const;

private:
    RenderJob& job_;
    std::vector<GrowingEstimate> of_scramblings_;
};

}  // namespace tandem
