#include "common/render/binned_film.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/render/film_regions.h"
#include "common/render/path_trace.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

// The first pixel of bin i of `bins` along a side of `pixels`.
std::uint32_t boundary(std::uint32_t i, std::uint32_t pixels, std::uint32_t bins) {
    return static_cast<std::uint32_t>(std::uint64_t{i} * pixels / bins);
}

// A place in bin i, by 32 random bits.
std::uint32_t place_in(std::uint32_t i, std::uint32_t pixels, std::uint32_t bins, std::uint32_t random) {
    const std::uint32_t begin = boundary(i, pixels, bins), end = boundary(i + 1, pixels, bins);
    return begin + static_cast<std::uint32_t>(std::uint64_t{end - begin} * random >> 32u);
}

class BinnedJob final : public RenderJob {
public:
    BinnedJob(std::unique_ptr<RenderJob> job, FilmSize film, const RenderSettings& bins)
        : job_(std::move(job)), film_(film), bins_{bins.width, bins.height}, seed_(bins.seed) {}

    [[nodiscard]] JobFacts facts() const override { return job_->facts(); }

    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        std::vector<std::uint32_t> all(bins_.pixel_count());
        std::iota(all.begin(), all.end(), 0u);
        return render_bins(range, all, bins_, control);
    }
    [[nodiscard]] RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> bins, const RenderControl& control) override {
        return render_bins(range, bins, {static_cast<std::uint32_t>(bins.size()), 1}, control);
    }
    [[nodiscard]] std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        std::vector<PathTrace> traces;
        for (std::uint64_t sample = samples.begin; sample < samples.end; ++sample) {
            const FilmSample at = film_sample(film_, bins_, x, y, sample, seed_);
            std::vector<PathTrace> one = job_->trace(at.x, at.y, {at.sample, at.sample + 1});
            std::ranges::move(one, std::back_inserter(traces));
        }
        return traces;
    }

private:
    [[nodiscard]] RenderResult render_bins(
        SampleRange range, std::span<const std::uint32_t> bins, FilmSize shape, const RenderControl& control) {
        const Stopwatch watch;
        RenderResult result{Estimate(shape.width, shape.height), 0.0, std::nullopt};
        for (std::uint64_t begin = range.begin; begin < range.end && !control.stop.stop_requested();
             begin += samples_per_block) {
            const SampleRange block{begin, std::min(range.end, begin + samples_per_block)};
            Estimate::Plane sums(bins.size() * channel_count);
            std::uint64_t at = block.begin;
            while (at < block.end && add_sample(at, bins, sums, result, control.stop)) {
                ++at;
                if (control.progress) control.progress(static_cast<double>(at - range.begin));
            }
            if (at > block.begin) result.estimate.add_block({block.begin, at}, std::move(sums));
        }
        result.seconds = watch.seconds();
        return result;
    }

    // One sample of each bin; false: stopped before all had it.
    bool add_sample(std::uint64_t sample, std::span<const std::uint32_t> bins, Estimate::Plane& sums,
        RenderResult& result, const std::stop_token& stop) {
        // The bins' places in the list, in the order of their pixels.
        std::vector<std::pair<std::uint32_t, std::uint32_t>> chosen(bins.size());
        for (std::uint32_t k = 0; k < bins.size(); ++k) {
            const FilmSample at =
                film_sample(film_, bins_, bins[k] % bins_.width, bins[k] / bins_.width, sample, seed_);
            chosen[k] = {at.y * film_.width + at.x, k};
        }
        std::ranges::sort(chosen);
        std::vector<std::uint32_t> pixels(chosen.size());
        std::ranges::transform(chosen, pixels.begin(), [](const auto& one) { return one.first; });
        const std::uint64_t number = sample * samples_per_block;
        const RenderResult one = job_->render_pixels({number, number + 1}, pixels, {.stop = stop, .progress = {}});
        if (one.device_seconds) result.device_seconds = result.device_seconds.value_or(0.0) + *one.device_seconds;
        if (one.estimate.count() == 0) return false;
        result.estimate.add_invalid(one.estimate.invalid());
        const Estimate::Plane totals = one.estimate.totals();
        for (std::size_t i = 0; i < chosen.size(); ++i)
            for (std::size_t c = 0; c < channel_count; ++c) {
                Moments& bin = sums[chosen[i].second * channel_count + c];
                bin.sum += totals[i * channel_count + c].sum;
                bin.sum_of_squares += totals[i * channel_count + c].sum_of_squares;
            }
        return true;
    }

    std::unique_ptr<RenderJob> job_;
    FilmSize film_, bins_;
    std::uint64_t seed_;
};

class BinnedRenderer final : public Renderer {
public:
    BinnedRenderer(Renderer& renderer, std::unique_ptr<Renderer> own, FilmSize film)
        : own_(std::move(own)), renderer_(renderer), film_(film) {}

    [[nodiscard]] RendererInfo info() const override { return renderer_.info(); }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        if (settings.width > film_.width || settings.height > film_.height) return renderer_.prepare(scene, settings);
        RenderSettings whole = settings;
        whole.width = film_.width;
        whole.height = film_.height;
        return std::make_unique<BinnedJob>(
            prepare_pixel_lists(renderer_, scene, whole, settings.width * settings.height), film_, settings);
    }
    [[nodiscard]] std::unique_ptr<RayIntersector> intersector(
        const Scene& scene, const RenderSettings& settings) override {
        return renderer_.intersector(scene, settings);
    }
    [[nodiscard]] std::unique_ptr<ArithmeticProbe> arithmetic() override { return renderer_.arithmetic(); }

private:
    std::unique_ptr<Renderer> own_;
    Renderer& renderer_;
    FilmSize film_;
};

}  // namespace

FilmSample film_sample(
    FilmSize film, FilmSize bins, std::uint32_t x, std::uint32_t y, std::uint64_t sample, std::uint64_t seed) {
    constexpr std::uint32_t no_block = 0xffffffff;  // paths draw from none of this number (MODEL.md section 3)
    const RandomBlock random = random_block(seed, y * bins.width + x, sample, no_block);
    return {place_in(x, film.width, bins.width, random[0]), place_in(y, film.height, bins.height, random[1]),
        sample * samples_per_block};
}

std::unique_ptr<Renderer> binned_renderer(Renderer& renderer, FilmSize film) {
    return std::make_unique<BinnedRenderer>(renderer, nullptr, film);
}

std::unique_ptr<Renderer> binned_renderer(std::unique_ptr<Renderer> renderer, FilmSize film) {
    Renderer& of = *renderer;
    return std::make_unique<BinnedRenderer>(of, std::move(renderer), film);
}

}  // namespace tandem
