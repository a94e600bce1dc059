// A sample of a pixel also adds light to other pixels, if its subpath from a light is seen through the lens. So samples
// are taken by whole images. One sample of every pixel, with all that they add to each other, is one independent sample
// of the image. Each thread renders an image at a time. Images are added in ascending order, so that the bits do not
// depend on threads.
#include "cpu_ref/bidirectional/bidirectional.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "common/error.h"
#include "common/processors.h"
#include "common/render/path_trace.h"
#include "common/stopwatch.h"
#include "cpu_ref/bidirectional/paths.h"
#include "cpu_ref/parallel.h"

namespace tandem::cpu {
namespace {

using Image = std::vector<glm::dvec3>;

// All surfaces and the lights of section 9.2. With shading normals light and importance scatter differently, which its
// weights do not know [Veach 1997, section 5.3].
constexpr EffectSet simulated = EffectSet::all().without({Effect::boundary, Effect::medium_absorption,
    Effect::medium_scattering, Effect::anisotropic_phase, Effect::density_grid, Effect::interiors,
    Effect::nested_dielectrics, Effect::direct_only, Effect::shading_normals});

class BidirectionalJob final : public RenderJob {
public:
    BidirectionalJob(
        RTCDevice device, const Scene& scene, const RenderSettings& settings, unsigned threads, EffectSet effects)
        : sampler_(device, scene, settings),
          threads_(threads == 0 ? usable_processors() : threads),
          thread_limit_(tbb::global_control::max_allowed_parallelism, std::max(threads_, usable_processors())),
          arena_(static_cast<int>(threads_)),
          effects_(effects) {}

    [[nodiscard]] JobFacts facts() const override {
        JobFacts facts;
        facts.effects = effects_;
        facts.compiled = simulated;
        facts.variant = "bidirectional";
        facts.bytes_per_path = sampler_.bytes_per_path();
        const std::uint64_t pixels = std::uint64_t{sampler_.settings().width} * sampler_.settings().height;
        facts.buffers = {{"image-of-a-thread", pixels * sizeof(Image::value_type)}};
        return facts;
    }

    RenderResult render(SampleRange range, const RenderControl& control) override {
        if (range.begin % samples_per_block != 0 || range.end < range.begin)
            throw Error("a sample range must begin at a multiple of " + std::to_string(samples_per_block) +
                        " and not end before it begins");
        const Stopwatch watch;
        const RenderSettings& settings = sampler_.settings();
        RenderResult result{Estimate(settings.width, settings.height), 0.0, std::nullopt};
        for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block) {
            const SampleRange block{begin, std::min(begin + samples_per_block, range.end)};
            if (!render_block(block, begin - range.begin, control, result.estimate)) break;
        }
        result.seconds = watch.seconds();
        return result;
    }

    std::vector<PathTrace> trace(std::uint32_t, std::uint32_t, SampleRange) override {
        throw UnsupportedError(
            "a bidirectional sample is no single path, but all joins of one from the camera with one from a light; "
            "trace another integrator");
    }

private:
    // Adds the block, or, after a stop, its samples so far. False: it was stopped.
    bool render_block(
        SampleRange block, std::uint64_t samples_before, const RenderControl& control, Estimate& estimate) {
        Estimate::Plane plane(estimate.pixel_count() * channel_count);
        std::uint64_t invalid = 0, done = 0;
        std::vector<Image> images(std::min<std::uint64_t>(threads_, block.count()));
        while (done < block.count()) {
            const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(images.size(), block.count() - done));
            const std::uint64_t first = block.begin + done;
            parallel_for(arena_, count, [&](std::uint32_t i) { make_image(first + i, control.stop, images[i]); });
            if (control.stop.stop_requested()) break;
            for (std::uint32_t i = 0; i < count; ++i) invalid += add_image(images[i], sampler_.settings().clamp, plane);
            done += count;
            if (control.progress) control.progress(static_cast<double>(samples_before + done));
        }
        if (done == 0) return false;
        estimate.add_block({block.begin, block.begin + done}, std::move(plane));
        estimate.add_invalid(invalid);
        return done == block.count();
    }

    void make_image(std::uint64_t sample, const std::stop_token& stop, Image& image) const {
        const RenderSettings& settings = sampler_.settings();
        image.assign(std::size_t{settings.width} * settings.height, glm::dvec3(0.0));
        const auto splat = [&](std::uint32_t pixel, const glm::dvec3& radiance) { image[pixel] += radiance; };
        for (std::uint32_t pixel = 0; pixel < image.size(); ++pixel) {
            if (stop.stop_requested()) return;
            image[pixel] += sampler_.radiance(pixel, sample, splat, stop);
        }
    }

    // Returns how many pixels' samples are invalid (section 12).
    static std::uint64_t add_image(const Image& image, double clamp, Estimate::Plane& plane) {
        std::uint64_t invalid = 0;
        for (std::size_t pixel = 0; pixel < image.size(); ++pixel) {
            const glm::dvec3& x = image[pixel];
            if (!(std::min({x.x, x.y, x.z}) >= 0.0 && std::isfinite(x.x + x.y + x.z))) {
                ++invalid;
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                Moments& moments = plane[pixel * channel_count + static_cast<std::size_t>(c)];
                const double value = std::min(x[c], clamp);  // section 11.1
                moments.sum += value;
                moments.sum_of_squares += value * value;
            }
        }
        return invalid;
    }

    BidirectionalSampler sampler_;
    unsigned threads_;
    tbb::global_control thread_limit_;  // else no more threads than processors
    tbb::task_arena arena_;
    EffectSet effects_;
};

}  // namespace

std::unique_ptr<RenderJob> make_bidirectional_job(
    RTCDevice device, const Scene& scene, const RenderSettings& settings, unsigned threads) {
    if (settings.ray_min != 0.0 || settings.ray_max != std::numeric_limits<double>::infinity())
        throw UnsupportedError(
            "bidirectional paths need whole rays: leave out the ray interval, or choose path or next-event");
    if (needed_effects(scene, settings).has(Effect::shading_normals))
        throw UnsupportedError(
            "bidirectional paths have no shading normals: light and importance scatter differently there (MODEL.md "
            "section 5.4); give the models \"normals\": \"flat\", or choose path or next-event");
    const EffectSet effects = effects_to_simulate(scene, settings, simulated, "bidirectional cpu");
    return std::make_unique<BidirectionalJob>(device, scene, settings, threads, effects);
}

}  // namespace tandem::cpu
