// The verdict on a film that does not fit into memory: on bins of its pixels (common/render/binned_film.h).
#pragma once

#include "common/render/binned_film.h"
#include "common/validation/verify/verify.h"

namespace tandem {

// As verify_scene() of a film of options.settings, each pixel of which is a bin of `film`. Every statistic, threshold
// and closed form is that of the small film. The worst pixel is one of `film`; other places are bins. A note says how
// much of the film was looked at. options.settings is given.
[[nodiscard]] SceneVerdict verify_in_bins(
    const Scene& scene, Renderer& reference, Renderer& candidate, VerifyOptions options, FilmSize film);

}  // namespace tandem
