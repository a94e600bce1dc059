// The backend "cpu": the Embree path tracer as a Renderer.
#include <fmt/format.h>

#include "common/error.h"
#include "common/processors.h"
#include "common/render/check_settings.h"
#include "common/render/floating_origin.h"
#include "cpu_ref/backend.h"
#include "cpu_ref/bidirectional/bidirectional.h"
#include "cpu_ref/path_tracer/memory.h"
#include "cpu_ref/path_tracer/ray_batch.h"
#include "cpu_ref/path_tracer/render_job.h"
#include "cpu_ref/path_tracer/variants.h"
#include "cpu_ref/planted.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace tandem {

namespace {

// The processor's own name, as it tells it.
std::string processor_name() {
#if defined(__x86_64__)
    std::array<unsigned, 12> words{};
    constexpr unsigned first_leaf = 0x80000002u;
    for (unsigned i = 0; i < 3; ++i)
        if (__get_cpuid(first_leaf + i, &words[4 * i], &words[4 * i + 1], &words[4 * i + 2], &words[4 * i + 3]) == 0)
            return "processor";
    std::string name;
    for (const unsigned word : words)
        for (unsigned byte = 0; byte < 4; ++byte)
            if (const char c = static_cast<char>((word >> (8 * byte)) & 0xFFu); c != '\0') name += c;
    const std::size_t begin = name.find_first_not_of(' '), end = name.find_last_not_of(' ');
    return begin == std::string::npos ? "processor" : name.substr(begin, end - begin + 1);
#else
    return "processor";
#endif
}

class EmbreeRenderer final : public Renderer, public ForecastingRenderer {
public:
    explicit EmbreeRenderer(const BackendOptions& options) : options_(options), device_(rtcNewDevice(nullptr)) {
        if (!options.device.empty())
            throw UnsupportedError("the cpu backend has no choice of devices; leave out --device");
        if (!options.kernel.empty())
            throw UnsupportedError("the cpu backend has no choice of kernel shapes; leave out --kernel");
        if (options.validation)
            throw UnsupportedError("the cpu backend has no validation layers; leave out --validation");
#ifndef TANDEM_PLANTED_BUGS
        if (options.planted_bug != PlantedFault())
            throw UnsupportedError("planted bugs exist in test builds only; this is none");
#endif
        if (options.precision == Precision::contracted)
            throw UnsupportedError(
                "the cpu backend rounds every operation by itself; contracted arithmetic is the vulkan backend's");
        if (options.precision == Precision::half_storage)
            throw UnsupportedError(
                "the cpu backend carries paths in the precision that it computes in; half storage is the vulkan "
                "backend's");
        if (!device_)
            throw Error(
                fmt::format("Embree could not be started (error {})", static_cast<int>(rtcGetDeviceError(nullptr))));
    }

    [[nodiscard]] RendererInfo info() const override {
        const unsigned threads = options_.threads == 0 ? usable_processors() : options_.threads;
        return {"cpu", fmt::format("{}, {} thread{}", processor_name(), threads, threads == 1 ? "" : "s"),
            cpu::embree::version(), cpu::embree::version(), true};
    }

    [[nodiscard]] MemoryForecast forecast(
        const Scene& scene, const RenderSettings& settings, std::uint64_t /*pixels*/) const override {
        const bool from_both_ends = settings.integrator == Integrator::bidirectional;
        return cpu::memory_forecast(scene, settings,
            options_.precision.value_or(from_both_ends ? Precision::double_precision : Precision::single_precision),
            options_.threads);
    }

    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& given, const RenderSettings& settings) override {
        const std::optional<Scene> changed = changed_by(settings, given);
        return prepare_near_origin(
            changed ? *changed : given, settings, [&](const Scene& scene) { return make_job(scene, settings); });
    }

    [[nodiscard]] std::unique_ptr<RayIntersector> intersector(
        const Scene& scene, const RenderSettings& settings) override {
        return cpu::make_intersector(
            device_.get(), scene, settings, options_.precision.value_or(Precision::single_precision), options_.threads);
    }

private:
    [[nodiscard]] std::unique_ptr<RenderJob> make_job(const Scene& scene, const RenderSettings& settings) {
        check_settings(scene, settings);
        if (settings.integrator == Integrator::bidirectional) {
            if (options_.precision.value_or(Precision::double_precision) != Precision::double_precision)
                throw UnsupportedError(
                    "bidirectional paths are traced in double precision alone; leave out --precision");
            if (settings.intersection != IntersectionSettings{})
                throw UnsupportedError(
                    "bidirectional paths have the default intersection tests and guard alone; leave --triangle-test, "
                    "--convex-test and --guard out");
            if (settings.accumulation.value_or(Accumulation::in_double) != Accumulation::in_double)
                throw UnsupportedError("bidirectional samples are added in double alone; leave --accumulation out");
            return cpu::make_bidirectional_job(device_.get(), scene, settings, options_.threads);
        }
        cpu::check_kernels(settings.intersection, options_.precision.value_or(Precision::single_precision));
        RenderSettings chosen = settings;
        chosen.effects = effects_to_simulate(scene, settings, cpu::variants::supported, "cpu");
#ifdef TANDEM_PLANTED_BUGS
        cpu::planted_fault = options_.planted_bug;
#endif
        return cpu::make_render_job(
            {device_.get(), scene, chosen, options_.threads}, options_.precision.value_or(Precision::single_precision));
    }

    BackendOptions options_;
    cpu::embree::Device device_;
};

}  // namespace

Backend cpu_backend() {
    return {"cpu", "path tracer on the processor, with Embree",
        [](const BackendOptions& options) -> std::unique_ptr<Renderer> {
            return std::make_unique<EmbreeRenderer>(options);
        }};
}

}  // namespace tandem
