#include "common/render/film_regions.h"

#include <algorithm>
#include <cmath>

#include "common/render/tiled_renderer.h"

namespace tandem {

namespace {

// Ascending, as RenderJob::render_pixels takes them.
std::vector<std::uint32_t> pixels_of(const PixelRectangle& region, std::uint32_t width) {
    std::vector<std::uint32_t> pixels;
    pixels.reserve(region.pixel_count());
    for (std::uint32_t y = region.y0; y < region.y1; ++y)
        for (std::uint32_t x = region.x0; x < region.x1; ++x) pixels.push_back(y * width + x);
    return pixels;
}

FilmMoments without_samples(const PixelRectangle& region) {
    FilmMoments film;
    film.width = region.x1 - region.x0;
    film.height = region.y1 - region.y0;
    film.moments.resize(region.pixel_count() * channel_count);
    film.counts.resize(region.pixel_count());
    return film;
}

// Sums for relative_error_of(), over regions.
struct ErrorSums {
    double mean = 0.0, variance = 0.0, values = 0.0;

    void add(const FilmMoments& film) {
        for (std::size_t i = 0; i < film.moments.size(); ++i) {
            const std::uint64_t count = film.counts[i / channel_count];
            mean += mean_from(film.moments[i], count);
            variance += variance_from(film.moments[i], count) / static_cast<double>(count);
            values += 1.0;
        }
    }
    [[nodiscard]] std::optional<double> relative() const {
        if (!(mean > 0.0) || std::isnan(variance)) return std::nullopt;
        return std::sqrt(variance / values) / (mean / values);
    }
};

}  // namespace

std::vector<PixelRectangle> film_regions(
    std::uint32_t width, std::uint32_t height, std::uint32_t edge, std::uint64_t tiles) {
    const std::uint32_t columns = (width - 1) / edge + 1, rows = (height - 1) / edge + 1;
    const auto across = static_cast<std::uint32_t>(std::min<std::uint64_t>(tiles, columns));
    const auto down = static_cast<std::uint32_t>(std::min<std::uint64_t>(tiles / across, rows));
    const std::uint32_t high = across < columns ? 1 : down;
    std::vector<PixelRectangle> regions;
    for (std::uint32_t row = 0; row < rows; row += high)
        for (std::uint32_t column = 0; column < columns; column += across)
            regions.push_back({column * edge, row * edge, std::min(width, (column + across) * edge),
                std::min(height, (row + high) * edge)});
    return regions;
}

std::string why_no_pixel_lists(const RenderSettings& settings) {
    if (settings.sampling == Sampling::adaptive) return "adaptive sampling looks at the whole film; leave it out";
    if (settings.generator == Generator::sobol)
        return "tiles are rendered as lists of pixels, which Sobol points are not made for; use --generator philox";
    if (settings.integrator == Integrator::bidirectional)
        return "a bidirectional sample lights pixels of other tiles; use --integrator next-event";
    if (settings.accumulation == Accumulation::plain)
        return "plain sums run over all samples of every pixel alike; leave --accumulation out";
    return {};
}

std::unique_ptr<RenderJob> prepare_pixel_lists(
    Renderer& renderer, const Scene& scene, RenderSettings settings, std::uint32_t most) {
    settings.sampling = Sampling::adaptive;  // jobs that also render lists of pixels
    if (auto* tiled = dynamic_cast<TiledRenderer*>(&renderer)) return tiled->prepare_tiled(scene, settings, most);
    return renderer.prepare(scene, settings);
}

RegionsRender render_regions(RenderJob& job, std::uint32_t width, const std::vector<PixelRectangle>& regions,
    std::uint64_t samples, const RenderControl& control,
    const std::function<void(const PixelRectangle&, FilmMoments)>& keep) {
    RegionsRender result;
    double all = 0.0, pixels_done = 0.0;
    for (const PixelRectangle& region : regions) all += static_cast<double>(region.pixel_count());
    ErrorSums error;
    bool stopped = false;
    for (const PixelRectangle& region : regions) {
        if (stopped) {
            keep(region, without_samples(region));
            continue;
        }
        const std::vector<std::uint32_t> pixels = pixels_of(region, width);
        const auto share = static_cast<double>(pixels.size());
        const auto tell = [&](double samples_done) {
            result.done = (pixels_done + share * samples_done / static_cast<double>(samples)) / all;
            if (control.progress) control.progress(result.done);
        };
        RenderResult rendered = job.render_pixels({0, samples}, pixels, {.stop = control.stop, .progress = tell});
        result.seconds += rendered.seconds;
        if (rendered.device_seconds)
            result.device_seconds = result.device_seconds.value_or(0.0) + *rendered.device_seconds;
        stopped = rendered.estimate.count() < samples;
        result.samples_done += share * static_cast<double>(rendered.estimate.count());
        if (result.samples_done == 0.0) return result;
        FilmMoments film = rendered.estimate.count() > 0 ? film_of(rendered.estimate) : without_samples(region);
        rendered.estimate = Estimate();
        film.width = region.x1 - region.x0;
        film.height = region.y1 - region.y0;
        result.invalid += film.invalid;
        if (samples > 1 && !stopped) error.add(film);
        keep(region, std::move(film));
        if (stopped) continue;
        pixels_done += share;
        result.done = pixels_done / all;
    }
    result.complete = !stopped;
    if (samples > 1 && result.complete) result.relative_error = error.relative();
    return result;
}

}  // namespace tandem
