// The Vulkan backend: a Renderer that owns instance, device and pipelines.
#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/processors.h"
#include "common/render/concurrent_renderer.h"
#include "common/render/floating_origin.h"
#include "common/render/tiled_renderer.h"
#include "vulkan/backend.h"
#include "vulkan/framework/device_arithmetic.h"
#include "vulkan/renderer/job/job.h"
#include "vulkan/renderer/job/job_settings.h"
#include "vulkan/renderer/job/memory.h"
#include "vulkan/renderer/job/ray_batch.h"
#include "vulkan/renderer/kernels/kernel_shape.h"

namespace tandem {

namespace {

const BackendOptions& checked(const BackendOptions& options) {
    if (options.threads != 0)
        throw UnsupportedError("the Vulkan renderer has no CPU threads to set; leave --threads out");
    if (options.planted_bug != PlantedFault() && !shaders_hold_planted_bugs())
        throw UnsupportedError("planted bugs exist in test builds only");
    return options;
}

GeometryPrecision geometry_of(const BackendOptions& options) {
    if (options.precision == Precision::double_precision) return GeometryPrecision::double_precision;
    return options.precision == Precision::mixed ? GeometryPrecision::mixed : GeometryPrecision::single_precision;
}

// Destroys the device while the messenger still listens, then lets the log speak. Called from a destructor, an error
// thus ends the program, with its text. Only with validation on.
void raise_leftovers(const Instance& instance) { instance.log().raise(); }

class VulkanRenderer : public Renderer, public TiledRenderer, public ForecastingRenderer, public ConcurrentRenderer {
public:
    VulkanRenderer(const BackendOptions& options, Acceleration acceleration)
        : acceleration_(acceleration),
          planted_bug_(checked(options).planted_bug),
          shape_(kernel_shape(options.kernel)),
          instance_(validation_wanted(options.validation)),
          device_(std::make_unique<Device>(instance_, options.device)),
          stages_(std::make_unique<Stages>(*device_, options.precision == Precision::contracted)),
          geometry_(geometry_of(options)),
          half_state_(options.precision == Precision::half_storage) {
        if (geometry_ != GeometryPrecision::single_precision && !device_->features().doubles)
            throw UnsupportedError(device_->description().name +
                                   " has no doubles in shaders (shaderFloat64); use --precision single, or the cpu or "
                                   "oracle backend in double");
        instance_.log().raise();
    }

    ~VulkanRenderer() override {
        stages_.reset();
        device_.reset();
        raise_leftovers(instance_);
    }

    [[nodiscard]] RendererInfo info() const override {
        const DeviceDescription& device = device_->description();
        RendererInfo info{"vulkan", device.name, device.driver_name + " " + device.driver_version,
            fmt::format("Vulkan {}.{}.{}", device.api_major, device.api_minor, device.api_patch), true};
        info.accumulation = own_accumulation(*device_);
        return info;
    }

    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& given, const RenderSettings& settings) override {
        return prepare_tiled(given, settings, 0);
    }

    [[nodiscard]] unsigned prepares_at_once() const override {
        if (shape_ && brings_trees(*shape_))
            return 1;                 // the device builds these, and a queue takes one submission at a time
        constexpr unsigned most = 8;  // as each compilation takes memory
        return std::min(usable_processors(), most);
    }

    [[nodiscard]] std::unique_ptr<RenderJob> prepare_tiled(
        const Scene& given, const RenderSettings& settings, std::uint32_t tile_pixels) override {
        const std::optional<Scene> changed = changed_by(settings, given);
        JobPatterns patterns;
        patterns.tracer.tile_pixels = tile_pixels;
        patterns.tracer.kernel = shape_for(settings);
        patterns.tracer.half_state = half_state_;
        return prepare_near_origin(changed ? *changed : given, settings, [&](const Scene& scene) {
            return std::make_unique<VulkanJob>(
                instance_, *device_, *stages_, scene, settings, acceleration_, planted_bug_, patterns, geometry_);
        });
    }

    [[nodiscard]] MemoryForecast forecast(
        const Scene& scene, const RenderSettings& settings, std::uint64_t pixels) const override {
        return memory_forecast(*device_, scene, settings, shape_for(settings), geometry_, pixels);
    }

    [[nodiscard]] std::unique_ptr<ArithmeticProbe> arithmetic() override {
        return std::make_unique<DeviceArithmetic>(*device_);
    }

    [[nodiscard]] std::unique_ptr<RayIntersector> intersector(
        const Scene& scene, const RenderSettings& settings) override {
        return std::make_unique<VulkanIntersector>(
            instance_, *device_, *stages_, scene, settings, acceleration_, geometry_);
    }

private:
    [[nodiscard]] bool in_double() const { return geometry_ != GeometryPrecision::single_precision; }
    [[nodiscard]] KernelShape shape_for(const RenderSettings& settings) const {
        if (shape_) return *shape_;
        if (in_double()) return KernelShape::megakernel;  // alone has it
        if (half_state_) return KernelShape::stages;      // alone keeps it
        return fits_whole_paths(settings) ? fastest_shape(device_->description().type) : KernelShape::stages;
    }

    Acceleration acceleration_;
    PlantedFault planted_bug_;
    std::optional<KernelShape> shape_;
    Instance instance_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<Stages> stages_;
    GeometryPrecision geometry_;
    bool half_state_;
};

}  // namespace

Backend vulkan_backend(Acceleration acceleration) {
    return {"vulkan", "Vulkan compute kernels, in float (or double where the device has it), on any Vulkan 1.2 device",
        [acceleration](const BackendOptions& options) -> std::unique_ptr<Renderer> {
            return std::make_unique<VulkanRenderer>(options, acceleration);
        }};
}

}  // namespace tandem
