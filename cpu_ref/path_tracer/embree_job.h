// Spreads the samples of an image over threads. Blocks of 64 samples come one after another, each in passes of about a
// quarter of a second. A pass has batches of neighbouring pixels. A pixel's samples are added in ascending order,
// whatever the cut. So the bits of an estimate depend on its sample range alone (MODEL.md section 11).
#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "common/error.h"
#include "common/processors.h"
#include "common/stopwatch.h"
#include "cpu_ref/parallel.h"
#include "cpu_ref/path_tracer/film.h"
#include "cpu_ref/path_tracer/path_tracer.h"
#include "cpu_ref/path_tracer/render_job.h"
#include "cpu_ref/path_tracer/traced_path.h"
#include "cpu_ref/path_tracer/variants.h"

namespace tandem::cpu {

inline constexpr double pass_seconds = 0.25;     // so long at most (about) does a stop request wait
inline constexpr double progress_seconds = 0.1;  // between calls of `progress` within a pass
// Enough to keep a path pool full, few enough for the second-level cache.
inline constexpr std::uint32_t batch_paths = 8192;

// Tells the caller how far the render is, from one thread at a time.
class Progress {
public:
    Progress(const RenderControl& control, std::uint64_t pixels)
        : control_(control), pixels_(static_cast<double>(pixels)) {}
    void add(std::uint64_t samples) {
        const std::uint64_t done = samples_ += samples;
        if (!control_.progress) return;
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (!lock || since_last_.seconds() < progress_seconds) return;
        since_last_ = Stopwatch();
        control_.progress(static_cast<double>(done) / pixels_);
    }
    void finish() const {
        if (control_.progress) control_.progress(static_cast<double>(samples_.load()) / pixels_);
    }

private:
    const RenderControl& control_;
    double pixels_;
    std::atomic<std::uint64_t> samples_{0};
    std::mutex mutex_;
    Stopwatch since_last_;
};

// One thread's tools.
template <class Real, std::uint64_t effects, class Shade>
struct Worker {
    Worker(const Tables<Real>& tables, const Tables<Shade>& shading, const Accelerator<Real>& accelerator)
        : tracer(tables, shading, accelerator) {}
    PathTracer<Real, effects, NoRecorder, Shade> tracer;
    std::vector<std::array<Real, 3>> radiance;
};

// The tables that shading reads: geometry's own, or others where the precisions differ.
template <class Real, class Shade>
class ShadingTables {
public:
    ShadingTables(const Tables<Real>&, const Scene& scene, const RenderSettings& settings)
        : own_(make_tables<Shade>(scene, settings)) {}
    [[nodiscard]] const Tables<Shade>& get() const { return own_; }

private:
    Tables<Shade> own_;
};
template <class Real>
class ShadingTables<Real, Real> {
public:
    ShadingTables(const Tables<Real>& tables, const Scene&, const RenderSettings&) : tables_(tables) {}
    [[nodiscard]] const Tables<Real>& get() const { return tables_; }

private:
    const Tables<Real>& tables_;
};

template <class Real, std::uint64_t effects, class Shade>
class EmbreeJob final : public RenderJob {
public:
    EmbreeJob(RTCDevice device, const Scene& scene, const RenderSettings& settings, unsigned threads)
        : tables_(make_tables<Real>(scene, settings)),
          shading_(tables_, scene, settings),
          accelerator_(device, tables_),
          workers_([this] { return Worker<Real, effects, Shade>(tables_, shading_.get(), accelerator_); }),
          thread_limit_(tbb::global_control::max_allowed_parallelism, std::max(threads, usable_processors())),
          arena_(threads == 0 ? tbb::task_arena::automatic : static_cast<int>(threads)),
          film_(settings.accumulation.value_or(Accumulation::in_double),
              std::size_t{settings.width} * settings.height * channel_count) {}

    [[nodiscard]] JobFacts facts() const override {
        JobFacts facts;
        // The general variant leaves out at run time what the job does not simulate; the others have no such switches.
        const EffectSet compiled = EffectSet::from_bits(effects);
        facts.effects = compiled == variants::general ? tables_.settings.effects.value_or(compiled) : compiled;
        facts.compiled = compiled;
        facts.variant = variants::name(compiled);
        using Tracer = PathTracer<Real, effects, NoRecorder, Shade>;
        facts.bytes_per_path = Tracer::bytes_per_path();
        // The scene's tables are as large as what it has, in every variant.
        facts.buffers = {{"paths-of-a-thread", Tracer::bytes_of_paths()}};
        facts.hierarchy_seconds = accelerator_.hierarchy_seconds();
        return facts;
    }

    [[nodiscard]] bool goes_on_in_blocks() const override {
        return tables_.settings.accumulation.value_or(Accumulation::in_double) == Accumulation::in_double;
    }
    RenderResult render(SampleRange range, const RenderControl& control) override {
        return render_film(range, {}, tables_.settings.width, tables_.settings.height, control);
    }

    RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
        if (tables_.settings.sampling != Sampling::adaptive) return RenderJob::render_pixels(range, pixels, control);
        return render_film(range, pixels, static_cast<std::uint32_t>(pixels.size()), 1, control);
    }
    std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return traced_paths(tables_, shading_.get(), accelerator_, x, y, samples);
    }
    std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        return traced_paths(tables_, shading_.get(), accelerator_, x, y, samples, changed);
    }
    bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) override {
        check_one_block(samples);
        const auto count = static_cast<std::uint32_t>(samples.count());
        const auto pixels = static_cast<std::uint32_t>(film.pixel_count());
        Progress progress(control, pixels);
        tbb::enumerable_thread_specific<FirstVertexTracer> tracers(
            [this] { return first_vertex_tracer<Real, Shade>(tables_, shading_.get(), accelerator_); });
        in_batches(pixels, count, [&](std::uint32_t first, std::uint32_t batch_pixels) {
            if (control.stop.stop_requested()) return;
            const Batch batch{first, batch_pixels, samples.begin, count};
            const std::span<TracedVertex> vertices = tracers.local()(batch, control.stop);
            for (std::uint32_t p = 0; p < batch_pixels && !control.stop.stop_requested(); ++p)
                visit(first + p, vertices.subspan(std::size_t{p} * count, count));
            progress.add(batch.paths());
        });
        if (control.stop.stop_requested()) return false;
        progress.finish();
        return true;
    }

private:
    // Renders all pixels, or those that are listed, as a film of their number.
    RenderResult render_film(SampleRange range, std::span<const std::uint32_t> listed, std::uint32_t width,
        std::uint32_t height, const RenderControl& control) {
        const Stopwatch watch;
        if (range.begin % samples_per_block != 0 || range.end < range.begin)
            throw Error("a sample range must begin at a multiple of " + std::to_string(samples_per_block) +
                        " and not end before it begins");
        RenderResult result{Estimate(width, height), 0.0, std::nullopt};
        listed_ = listed;
        pixels_ = static_cast<std::uint32_t>(result.estimate.pixel_count());
        film_.resize(std::size_t{pixels_} * channel_count);
        Progress progress(control, pixels_);
        SampleRange block{range.begin, 0};
        for (; block.begin < range.end && !control.stop.stop_requested(); block.begin = block.end) {
            block.end = std::min(block.begin + samples_per_block, range.end);
            const bool goes_on = block.begin == range.begin && listed.empty() && goes_on_in_blocks();
            render_block(block, goes_on ? samples_begun(control, block) : 0, control, progress, result.estimate);
        }
        progress.finish();
        result.seconds = watch.seconds();
        return result;
    }

    // `begun` of its samples are there.
    void render_block(
        SampleRange block, std::uint64_t begun, const RenderControl& control, Progress& progress, Estimate& estimate) {
        film_.begin_block(std::exchange(summed_to_, nowhere) == block.begin);
        std::optional<Film> before;
        std::uint64_t done = block.begin, invalid = 0;
        if (begun > 0) {
            film_.go_on(control.begun->take_ragged_moments(block.begin));
            done += begun;
            progress.add(begun * pixels_);
        }
        while (done < block.end && !control.stop.stop_requested()) {
            const SampleRange pass{done, std::min(block.end, done + pass_samples())};
            if (done > block.begin) before = film_;
            const Stopwatch watch;
            std::uint64_t faults = 0;
            if (!render_pass(pass, control.stop, progress, faults)) {
                if (before) film_ = std::move(*before);
                break;
            }
            seconds_per_path_ = watch.seconds() / (static_cast<double>(pass.count()) * pixels_);
            invalid += faults;
            done = pass.end;
        }
        if (done == block.begin) return;
        summed_to_ = done;
        estimate.add_block({block.begin, done}, film_.take_block());
        estimate.add_invalid(invalid);
    }

    // As many samples a pixel as the last pass promises to fit.
    [[nodiscard]] std::uint64_t pass_samples() const {
        if (seconds_per_path_ <= 0.0) return 1;
        return static_cast<std::uint64_t>(std::clamp(
            std::floor(pass_seconds / (seconds_per_path_ * pixels_)), 1.0, static_cast<double>(samples_per_block)));
    }

    // False if a stop request cut it short; the film is then spoilt.
    bool render_pass(SampleRange pass, const std::stop_token& stop, Progress& progress, std::uint64_t& faults) {
        const auto samples = static_cast<std::uint32_t>(pass.count());
        std::atomic<std::uint64_t> invalid{0};
        in_batches(pixels_, samples, [&](std::uint32_t first, std::uint32_t batch_pixels) {
            if (stop.stop_requested()) return;
            const Batch batch{first, batch_pixels, pass.begin, samples, listed_};
            Worker<Real, effects, Shade>& worker = workers_.local();
            worker.radiance.resize(batch.paths());
            worker.tracer.run(batch, worker.radiance, stop);
            if (stop.stop_requested()) return;
            invalid += add_samples(batch, worker.radiance);
            progress.add(batch.paths());
        });
        faults = invalid;
        return !stop.stop_requested();
    }

    // body(first pixel, pixels) for batches of all pixels, of so many samples each.
    template <class Body>
    void in_batches(std::uint32_t pixels, std::uint32_t samples, const Body& body) {
        // Small images are cut finer, so that every thread has its share.
        const std::uint32_t share =
            std::max(1u, pixels / (8u * static_cast<std::uint32_t>(std::max(1, arena_.max_concurrency()))));
        const std::uint32_t batch_pixels = std::clamp(batch_paths / samples, 1u, share);
        parallel_for(arena_, (pixels - 1) / batch_pixels + 1, [&](std::uint32_t index) {
            const std::uint32_t first = index * batch_pixels;
            body(first, std::min(batch_pixels, pixels - first));
        });
    }

    // Adds the samples of each pixel in ascending order; returns how many are invalid (section 12).
    std::uint64_t add_samples(const Batch& batch, const std::vector<std::array<Real, 3>>& radiance) {
        std::uint64_t invalid = 0;
        for (std::uint32_t p = 0; p < batch.pixel_count; ++p) {
            const std::size_t first = (std::size_t{batch.first_pixel} + p) * channel_count;
            for (std::uint32_t s = 0; s < batch.sample_count; ++s) {
                const std::array<Real, 3>& value = radiance[std::size_t{p} * batch.sample_count + s];
                const bool valid = std::ranges::all_of(value, [](Real x) { return x >= Real(0) && std::isfinite(x); });
                if (!valid) {
                    ++invalid;
                    continue;
                }
                for (std::size_t c = 0; c < channel_count; ++c) {
                    const double x = static_cast<double>(value[c]);
                    film_.add(first + c, std::min(x, tables_.settings.clamp));  // MODEL.md section 11.1
                }
            }
        }
        return invalid;
    }

    Tables<Real> tables_;
    ShadingTables<Real, Shade> shading_;
    Accelerator<Real> accelerator_;
    tbb::enumerable_thread_specific<Worker<Real, effects, Shade>> workers_;
    tbb::global_control thread_limit_;  // else no more threads than processors
    tbb::task_arena arena_;
    std::span<const std::uint32_t> listed_;  // of the render in hand; empty: all pixels
    std::uint32_t pixels_ = 0;               // so many
    double seconds_per_path_ = 0.0;
    static constexpr std::uint64_t nowhere = std::numeric_limits<std::uint64_t>::max();
    Film film_;
    std::uint64_t summed_to_ = nowhere;  // the sample up to which the film's sums go
};

template <class Real, std::uint64_t effects, class Shade>
std::unique_ptr<RenderJob> make_embree_job(const JobParts& parts) {
    return std::make_unique<EmbreeJob<Real, effects, Shade>>(parts.device, parts.scene, parts.settings, parts.threads);
}

}  // namespace tandem::cpu
