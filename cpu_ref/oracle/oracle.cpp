// The reference oracle as a backend. It says which of two disagreeing tracers is wrong. Double precision, brute force
// over all primitives, no acceleration structure, no light sampling but for `whitted`. Slow by intention.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "common/error.h"
#include "common/processors.h"
#include "common/render/check_settings.h"
#include "common/render/contacts.h"
#include "common/render/effects.h"
#include "common/stopwatch.h"
#include "cpu_ref/backend.h"
#include "cpu_ref/oracle/paths.h"

namespace tandem {
namespace {

using oracle::PathSampler;

bool is_valid(const glm::dvec3& radiance) {  // MODEL.md section 12
    return std::isfinite(radiance.x + radiance.y + radiance.z) && std::min({radiance.x, radiance.y, radiance.z}) >= 0.0;
}

// Adds the samples of `range`, ascending, of pixel (x, y); returns how many were invalid. A stop leaves it unfinished.
std::uint64_t render_pixel(const PathSampler& sampler, std::uint32_t x, std::uint32_t y, SampleRange range,
    const std::stop_token& stop, Moments* moments) {
    std::uint64_t invalid = 0;
    for (std::uint64_t sample = range.begin; sample < range.end; ++sample) {
        const glm::dvec3 radiance = sampler.radiance(x, y, sample, stop);
        if (stop.stop_requested()) return invalid;
        if (!is_valid(radiance)) {
            ++invalid;
            continue;
        }
        for (int channel = 0; channel < 3; ++channel) {
            const double counted = std::min(radiance[channel], sampler.settings().clamp);  // section 11.1
            moments[channel].sum += counted;
            moments[channel].sum_of_squares += counted * counted;
        }
    }
    return invalid;
}

class OracleJob final : public RenderJob {
public:
    OracleJob(const Scene& scene, const RenderSettings& settings, unsigned threads)
        : sampler_(scene, settings), threads_(threads) {}

    RenderResult render(SampleRange range, const RenderControl& control) override {
        const RenderSettings& settings = sampler_.settings();
        return render_film(range, {}, {settings.width, settings.height}, control);
    }

    // Without any setting: it has no passes over the film that would have to know.
    RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        return render_film(range, pixels, {static_cast<std::uint32_t>(pixels.size()), 1}, control);
    }

    std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        if (x >= sampler_.settings().width || y >= sampler_.settings().height)
            throw Error("the pixel to trace lies outside of the image");
        std::vector<PathTrace> traces;
        for (std::uint64_t sample = samples.begin; sample < samples.end; ++sample)
            traces.push_back(sampler_.trace(x, y, sample));
        return traces;
    }

private:
    struct Size {
        std::uint32_t width, height;
    };

    // `pixels`: as render_pixels has them; empty: all.
    RenderResult render_film(
        SampleRange range, std::span<const std::uint32_t> pixels, Size size, const RenderControl& control) const {
        if (range.begin % samples_per_block != 0 || range.end < range.begin)
            throw Error("a sample range begins at a multiple of " + std::to_string(samples_per_block) +
                        " and does not end before it begins");
        const Stopwatch watch;
        RenderResult result{Estimate(size.width, size.height), 0.0, std::nullopt};
        for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block) {
            const SampleRange block{begin, std::min(begin + samples_per_block, range.end)};
            if (!render_block(block, pixels, begin - range.begin, control, result.estimate)) break;
        }
        result.seconds = watch.seconds();
        return result;
    }

    // Adds the block, or, after a stop, as many of its samples as every pixel has. They come in passes, each as long as
    // all before it: a stop costs half of the block's work at most. False: it was stopped.
    bool render_block(SampleRange block, std::span<const std::uint32_t> pixels, std::uint64_t samples_before,
        const RenderControl& control, Estimate& estimate) const {
        Estimate::Plane plane(estimate.pixel_count() * channel_count), before;
        std::uint64_t done = 0, invalid = 0;
        bool whole = true;
        while (whole && done < block.count()) {
            const std::uint64_t count = std::min(std::max<std::uint64_t>(1, done), block.count() - done);
            const SampleRange pass{block.begin + done, block.begin + done + count};
            if (done > 0) before = plane;
            const auto faults = render_pass(pass, pixels, static_cast<double>(samples_before + done), control, plane);
            whole = faults.has_value();
            if (!whole) break;
            invalid += *faults;
            done += count;
        }
        if (done == 0) return false;
        estimate.add_block({block.begin, block.begin + done}, std::move(whole ? plane : before));
        estimate.add_invalid(invalid);
        return whole;
    }

    // Returns how many samples were invalid; nothing, with the plane spoilt, if it was stopped.
    std::optional<std::uint64_t> render_pass(SampleRange pass, std::span<const std::uint32_t> pixels,
        double samples_before, const RenderControl& control, Estimate::Plane& plane) const {
        const std::uint32_t width = sampler_.settings().width;
        const std::size_t count = plane.size() / channel_count, parts = (count + width - 1) / width;
        std::atomic<std::size_t> next_part = 0;
        std::atomic<std::uint64_t> invalid = 0;
        std::mutex progress_mutex;
        std::size_t parts_done = 0;  // under progress_mutex
        const auto work = [&] {
            for (std::size_t part = next_part++; part < parts; part = next_part++) {
                for (std::size_t k = part * width; k < std::min(count, (part + 1) * width); ++k) {
                    const auto pixel = pixels.empty() ? static_cast<std::uint32_t>(k) : pixels[k];
                    invalid += render_pixel(
                        sampler_, pixel % width, pixel / width, pass, control.stop, &plane[k * channel_count]);
                    if (control.stop.stop_requested()) return;
                }
                const std::scoped_lock lock(progress_mutex);
                ++parts_done;
                if (control.progress)
                    control.progress(samples_before + static_cast<double>(pass.count()) *
                                                          static_cast<double>(parts_done) / static_cast<double>(parts));
            }
        };
        {
            std::vector<std::jthread> helpers;
            for (unsigned i = 1; i < threads_; ++i) helpers.emplace_back(work);
            work();
        }
        if (parts_done < parts) return std::nullopt;
        return invalid;
    }

    PathSampler sampler_;
    unsigned threads_;
};

void refuse_choices(const RenderSettings& settings) {
    if (settings.intersection != IntersectionSettings{})
        throw UnsupportedError(
            "the oracle has one intersection test a primitive and one guard; leave --triangle-test, --convex-test and "
            "--guard out");
    if (settings.hierarchy != HierarchyQuality::high)
        throw UnsupportedError("the oracle asks every primitive, by no hierarchy; leave --hierarchy-quality out");
    if (settings.accumulation.value_or(Accumulation::in_double) != Accumulation::in_double)
        throw UnsupportedError("the oracle adds its samples in double alone; leave --accumulation out");
}

// The oracle keeps close to a kilobyte a primitive, and asks each for every ray.
void refuse_many_primitives(const Scene& scene) {
    constexpr std::uint32_t most = 1u << 21;
    if (const std::uint32_t count = placed_primitives(scene).size(); count > most)
        throw UnsupportedError(
            fmt::format("the oracle tries every primitive for every ray, and {} are too many: at most {}; use "
                        "--backend cpu or vulkan",
                count, most));
}

// Rays of the caller, one after another.
class OracleIntersector final : public RayIntersector {
public:
    explicit OracleIntersector(const Scene& scene) : world_(scene) {}

    [[nodiscard]] RayHits intersect(std::span<const GivenRay> rays) override {
        RayHits result;
        const Stopwatch watch;
        for (const GivenRay& given : rays) result.hits.push_back(hit_of(given));
        result.seconds = watch.seconds();
        return result;
    }

private:
    [[nodiscard]] RayHit hit_of(const GivenRay& given) const {
        glm::dvec3 direction = given.direction;
        if (!(std::abs(glm::length(direction) - 1.0) <= 1e-6)) {  // common/render/ray_batch.h
            const double size = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
            if (!(size > 0.0) || !std::isfinite(size)) return {};
            direction = glm::normalize(direction / size);
        }
        if (!std::isfinite(given.t_min) || std::isnan(given.t_max)) return {};
        const oracle::Ray ray{given.origin, direction, given.left_primitive, !given.inside, 0.0};
        const auto hit = world_.closest_hit(ray, given.t_min, given.t_max);
        if (!hit) return {};
        return {hit->t, hit->primitive, hit->position, hit->front_normal, leaving_origin(*hit, true),
            leaving_origin(*hit, false)};
    }

    oracle::World world_;
};

class OracleRenderer final : public Renderer {
public:
    explicit OracleRenderer(unsigned threads) : threads_(threads != 0 ? threads : usable_processors()) {}

    RendererInfo info() const override {
        RendererInfo info{"oracle", "host processor, " + std::to_string(threads_) + " threads",
            "brute force, double precision", "C++20"};
        info.samples_lights = false;
        return info;
    }

    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        check_settings(scene, settings);
        if (settings.integrator == Integrator::bidirectional)
            throw UnsupportedError(
                "the oracle has the integrators path, next_event and whitted alone; bidirectional has the mean of "
                "path");
        refuse_choices(settings);
        refuse_many_primitives(scene);
        if (settings.sampling == Sampling::adaptive)
            throw UnsupportedError("the oracle gives every pixel as many samples; leave out --sampling");
        static_cast<void>(effects_to_simulate(scene, settings, EffectSet::all(), "oracle"));  // it has no variants
        const std::optional<Scene> changed = changed_by(settings, scene);
        const std::optional<Scene> apart = with_contacts_apart(changed ? *changed : scene);
        return std::make_unique<OracleJob>(apart ? *apart : changed ? *changed : scene, settings, threads_);
    }

    std::unique_ptr<RayIntersector> intersector(const Scene& scene, const RenderSettings& settings) override {
        refuse_choices(settings);
        return std::make_unique<OracleIntersector>(scene);
    }

private:
    unsigned threads_;
};

std::unique_ptr<Renderer> create_oracle(const BackendOptions& options) {
    if (options.precision.value_or(Precision::double_precision) != Precision::double_precision)
        throw UnsupportedError("the oracle has double precision only: a reference is not to round like what it judges");
    if (!options.device.empty())
        throw UnsupportedError("the oracle runs on the host alone: it has no device to choose");
    if (!options.kernel.empty()) throw UnsupportedError("the oracle has no kernels to choose; leave out --kernel");
    if (options.validation) throw UnsupportedError("the oracle uses no Vulkan: it has no validation layers");
    if (options.planted_bug != PlantedFault())
        throw UnsupportedError("the oracle takes no planted bug: it is what bugs are found with");
    return std::make_unique<OracleRenderer>(options.threads);
}

}  // namespace

Backend oracle_backend() {
    return {"oracle",
        "brute force in double precision, no light sampling but for whitted: slow, for judging the other two",
        create_oracle};
}

}  // namespace tandem
