// The backend "first": the path tracer of first_tracer/, which is there to be read, as a Renderer.
#include <fmt/format.h>

#include "common/error.h"
#include "common/processors.h"
#include "common/render/check_settings.h"
#include "common/render/floating_origin.h"
#include "common/scene/coincident_faces.h"
#include "common/stopwatch.h"
#include "cpu_ref/backend.h"
#include "cpu_ref/first_tracer/path.h"
#include "cpu_ref/parallel.h"

namespace tandem {

namespace {

constexpr EffectSet supported{Effect::triangles, Effect::spheres, Effect::cuboids, Effect::lens, Effect::diffuse,
    Effect::specular, Effect::fuzz, Effect::translucent, Effect::schlick, Effect::emission, Effect::one_sided_emission,
    Effect::translucent_emission, Effect::background, Effect::background_gradient, Effect::light_sampling,
    Effect::triangle_lights, Effect::sphere_lights, Effect::roulette};

void refuse(const std::string& what, const std::string& mend) {
    throw UnsupportedError("the first backend has no " + what + "; " + mend);
}

void check_choices(const RenderSettings& settings) {
    if (settings.integrator == Integrator::whitted) refuse("integrator whitted", "the backends cpu and vulkan do");
    if (settings.integrator == Integrator::bidirectional) refuse("integrator bidirectional", "the backend cpu does");
    if (settings.light_sampling != LightSampling::power)
        refuse("choice of light sampling", "the backends cpu and vulkan do; or leave --light-sampling out");
    if (settings.filter != PixelFilter::box)
        refuse("pixel filter but the box", "the backends cpu and vulkan have others; or leave --filter out");
    if (settings.sampling == Sampling::adaptive)
        refuse("adaptive sampling", "the backends cpu and vulkan do; or leave out --sampling");
    if (settings.intersection != IntersectionSettings{})
        refuse("choice of intersection tests and guards",
            "the backends cpu and vulkan do; or leave --triangle-test, --convex-test and --guard out");
    if (settings.hierarchy != HierarchyQuality::high)
        refuse("choice of a hierarchy", "the backends cpu and vulkan do; or leave --hierarchy-quality out");
    if (settings.accumulation.value_or(Accumulation::in_double) != Accumulation::in_double)
        refuse("sums but in double", "leave --accumulation out");
}

// One sample of every pixel, a row a thread. False, with some rows missing, after a stop.
bool render_sample(const first::PathTracer& tracer, std::uint64_t sample, tbb::task_arena& threads,
    const std::stop_token& stop, std::vector<first::dvec3>& image) {
    const std::uint32_t width = tracer.settings().width;
    cpu::parallel_for(threads, tracer.settings().height, [&](std::uint32_t y) {
        for (std::uint32_t i = y * width; i < (y + 1) * width && !stop.stop_requested(); ++i)
            image[i] = tracer.radiance(i, sample);
    });
    return !stop.stop_requested();
}

// Adds a sample of every pixel to the sums and sums of squares; returns how many were invalid (section 12).
std::uint64_t add_sample(const std::vector<first::dvec3>& image, double clamp, Estimate::Plane& sums) {
    std::uint64_t invalid = 0;
    for (std::size_t pixel = 0; pixel < image.size(); ++pixel) {
        const first::dvec3& light = image[pixel];
        if (!std::isfinite(light.x + light.y + light.z) || std::min({light.x, light.y, light.z}) < 0.0) {
            ++invalid;
            continue;
        }
        for (int channel = 0; channel < 3; ++channel) {
            const double x = std::min(light[channel], clamp);  // section 11.1
            Moments& moments = sums[pixel * channel_count + static_cast<std::size_t>(channel)];
            moments.sum += x;
            moments.sum_of_squares += x * x;
        }
    }
    return invalid;
}

// A scene for a few settings. One sample of every pixel after the other, so that a stop leaves each with as many.
class FirstJob final : public RenderJob {
public:
    FirstJob(const Scene& scene, const RenderSettings& settings, unsigned threads)
        : tracer_(scene, settings), threads_(static_cast<int>(threads)) {}

    RenderResult render(SampleRange range, const RenderControl& control) override {
        if (range.begin % samples_per_block != 0 || range.end < range.begin)
            throw Error(fmt::format("a sample range begins at a multiple of {} and ends after it", samples_per_block));
        const Stopwatch watch;
        RenderResult result{Estimate(tracer_.settings().width, tracer_.settings().height), 0.0, std::nullopt};
        for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block) {
            const SampleRange block{begin, std::min(begin + samples_per_block, range.end)};
            if (!render_block(block, range.begin, control, result.estimate)) break;
        }
        result.seconds = watch.seconds();
        return result;
    }

    std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
        if (x >= tracer_.settings().width || y >= tracer_.settings().height)
            throw Error("the pixel to trace lies outside of the image");
        std::vector<PathTrace> traces(samples.count());
        for (std::uint64_t i = 0; i < samples.count(); ++i)
            traces[i].radiance =
                tracer_.radiance(y * tracer_.settings().width + x, samples.begin + i, &traces[i].vertices);
        return traces;
    }

private:
    // False after a stop.
    bool render_block(SampleRange block, std::uint64_t start, const RenderControl& control, Estimate& estimate) {
        Estimate::Plane sums(estimate.pixel_count() * channel_count);
        std::vector<first::dvec3> image(estimate.pixel_count());
        std::uint64_t sample = block.begin;
        for (; sample < block.end && render_sample(tracer_, sample, threads_, control.stop, image); ++sample) {
            estimate.add_invalid(add_sample(image, tracer_.settings().clamp, sums));
            if (control.progress) control.progress(static_cast<double>(sample + 1 - start));
        }
        if (sample > block.begin) estimate.add_block({block.begin, sample}, std::move(sums));
        return sample == block.end;
    }

    first::PathTracer tracer_;
    tbb::task_arena threads_;
};

class FirstRenderer final : public Renderer {
public:
    explicit FirstRenderer(unsigned threads) : threads_(threads != 0 ? threads : usable_processors()) {}

    RendererInfo info() const override {
        return {"first", fmt::format("host processor, {} threads", threads_), "brute force, double precision", "C++20",
            true};
    }

    std::unique_ptr<RenderJob> prepare(const Scene& given, const RenderSettings& settings) override {
        check_settings(given, settings);
        check_choices(settings);
        if (const EffectSet lacking = needed_effects(given, settings).without(supported); lacking.size() > 0)
            throw UnsupportedError(fmt::format(
                "the first backend does not simulate {}, which this scene calls for; the backends cpu, vulkan and "
                "oracle do",
                effect_names(lacking)));
        constexpr std::uint32_t most = 1u << 21;  // it tries every primitive for every ray
        if (const std::uint32_t count = placed_primitives(given).size(); count > most)
            refuse(fmt::format("tree, and {} primitives are more than {}", count, most),
                "the backends cpu and vulkan have");
        static_cast<void>(effects_to_simulate(given, settings, supported, "first"));
        const std::optional<Scene> changed = changed_by(settings, given);
        return prepare_near_origin(changed ? *changed : given, settings, [&](const Scene& scene) {
            if (passed_faces_coincide(scene))  // section 5.2, rules 16 to 26
                refuse("faces of glass in the plane of another body's", "the backends cpu, vulkan and oracle do");
            return std::make_unique<FirstJob>(scene, settings, threads_);
        });
    }

private:
    unsigned threads_;
};

std::unique_ptr<Renderer> create_first(const BackendOptions& options) {
    if (options.precision.value_or(Precision::double_precision) != Precision::double_precision)
        refuse("precision but double", "leave out --precision");
    if (!options.device.empty()) refuse("choice of devices", "leave out --device");
    if (!options.kernel.empty()) refuse("choice of kernels", "leave out --kernel");
    if (options.validation) refuse("validation layers", "leave out --validation");
    if (options.planted_bug != PlantedFault()) refuse("planted bugs", "the backends cpu and vulkan do");
    return std::make_unique<FirstRenderer>(options.threads);
}

}  // namespace

Backend first_backend() {
    return {"first", "a path tracer to read, in double precision, without an acceleration structure", create_first};
}

}  // namespace tandem
