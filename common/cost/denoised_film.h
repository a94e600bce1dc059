// The denoised film of an arm of `tandem cost`, and the time that features and filter take. It is the film that `tandem
// denoise` makes of `tandem render --aov albedo,normal,depth`.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/render/feature_images.h"

namespace tandem {

// Fewer samples have hardly a variance.
inline constexpr std::uint64_t fewest_to_denoise = 4;

class FilmDenoiser {
public:
    // `scene` and `renderer` must outlive it. `threads` of the filter; 0: as many as the machine has. Throws
    // UnsupportedError where the renderer cannot follow single paths.
    FilmDenoiser(Renderer& renderer, const Scene& scene, const RenderSettings& settings, unsigned threads);

    struct Result {
        std::vector<double> image;                    // [(y * width + x) * 3 + channel]
        double seconds = 0.0, feature_seconds = 0.0;  // of features and filter; of the former
    };
    // A film of samples from `begin` on, of fewest_to_denoise a pixel at least; nothing after a stop. Features are
    // those of its first samples, as many as render takes. Those that it has already are not rendered again; their time
    // counts. Times are by `now`, in seconds.
    [[nodiscard]] std::optional<Result> denoise(
        const FilmMoments& film, std::uint64_t begin, const std::function<double()>& now, const std::stop_token& stop);

private:
    const Scene& scene_;
    RenderSettings settings_;
    unsigned threads_;
    std::unique_ptr<RenderJob> job_;
    SampleRange known_{0, 0};  // samples that features_ are of
    std::vector<PixelFeatures> features_;
    double feature_seconds_ = 0.0;
};

}  // namespace tandem
