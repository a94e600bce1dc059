#include "common/cost/denoised_film.h"

#include <algorithm>

#include "common/image/denoise.h"
#include "common/render/path_trace.h"

namespace tandem {

FilmDenoiser::FilmDenoiser(Renderer& renderer, const Scene& scene, const RenderSettings& settings, unsigned threads)
    : scene_(scene),
      settings_(settings),
      threads_(threads),
      job_(renderer.prepare(scene, feature_settings(settings, scene))) {
    (void)job_->trace(0, 0, {0, 1});
}

std::optional<FilmDenoiser::Result> FilmDenoiser::denoise(
    const FilmMoments& film, std::uint64_t begin, const std::function<double()>& now, const std::stop_token& stop) {
    const std::uint64_t least = std::ranges::min(film.counts);
    const SampleRange wanted{begin, begin + std::min(least, most_feature_samples)};
    if (!(wanted == known_)) {
        const double start = now();
        auto features = render_features(*job_, scene_, settings_, wanted, stop, {});
        if (!features) return std::nullopt;
        features_ = std::move(*features);
        known_ = wanted;
        feature_seconds_ = now() - start;
    }
    const double start = now();
    auto image = tandem::denoise(noisy_image_of(film, features_), {.threads = threads_, .stop = stop, .progress = {}});
    if (!image) return std::nullopt;
    return Result{std::move(*image), feature_seconds_ + (now() - start), feature_seconds_};
}

}  // namespace tandem
