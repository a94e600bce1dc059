// The interface that every backend implements. The validation suite knows nothing else of a backend.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/render/effects.h"
#include "common/render/estimate.h"
#include "common/render/intersection_settings.h"
#include "common/render/planted_bugs.h"
#include "common/render/random.h"
#include "common/render/ray_batch.h"
#include "common/scene/scene.h"
#include "common/self_test/arithmetic_probe.h"

namespace tandem {

struct ChangedNumber;  // path_trace.h
struct PathTrace;      // common/render/path_trace.h
struct TracedVertex;   // there, too

// - single: every operation is rounded by itself.
// - double: all arithmetic is in double precision.
// - contracted: single, but the driver may fuse products and sums (Vulkan).
// - mixed: single, but intersections and the points that follow from them are in double.
// - half_storage: single, but what a path carries between kernels is kept in half (Vulkan's stages, MODEL.md 5.3).
enum class Precision : std::uint32_t {
    single_precision = 0,
    double_precision = 1,
    contracted = 2,
    mixed = 3,
    half_storage = 4
};
inline constexpr std::array<std::string_view, 5> precision_names{
    "single", "double", "contracted", "mixed", "half-storage"};

// How a pixel's sums are kept over its samples (MODEL.md section 11.2).
// - plain: in single precision, over all samples that a job renders in a row.
// - compensated: over a block, as unevaluated sums of two singles.
// - in_double: over a block, in double precision.
enum class Accumulation : std::uint32_t { plain = 0, compensated = 1, in_double = 2 };
inline constexpr std::array<std::string_view, 3> accumulation_names{"plain", "compensated", "double"};

// How samples are shared out over pixels (MODEL.md section 11.3). uniform: each has as many. adaptive: noisy ones have
// more, which adaptive_sampling.h sees to.
enum class Sampling : std::uint32_t { uniform = 0, adaptive = 1 };
inline constexpr std::array<std::string_view, 2> sampling_names{"uniform", "adaptive"};

// How next-event estimation chooses the light (MODEL.md section 9.2).
// - power: in proportion to its power.
// - uniform: all alike.
// - tree: by a tree of the lights, from the place of the receiver and the direction that it faces.
enum class LightSampling : std::uint32_t { power = 0, uniform = 1, tree = 2 };
inline constexpr std::array<std::string_view, 3> light_sampling_names{"power", "uniform", "tree"};

// How long a backend looks for a good hierarchy over primitives (MODEL.md section 5.3). The image is the same. A better
// hierarchy takes longer to build, and is faster to traverse. high: the default, the best that the backend can build.
enum class HierarchyQuality : std::uint32_t { high = 0, medium = 1, low = 2 };
inline constexpr std::array<std::string_view, 3> hierarchy_quality_names{"high", "medium", "low"};

// The pixel filter (MODEL.md section 4.1). A pixel is the mean of the film over its square, or a weighted mean over a
// wider square.
enum class PixelFilter : std::uint32_t { box = 0, tent = 1, gaussian = 2 };
inline constexpr std::array<std::string_view, 3> pixel_filter_names{"box", "tent", "gaussian"};

// Whether triangles that several entities place are kept once (instancing.h). automatic: where that saves much.
enum class Instancing : std::uint32_t { automatic = 0, never = 1, always = 2 };

// What the estimator is to do (MODEL.md sections 9 and 11).
struct RenderSettings {
    std::uint32_t width = 512, height = 512;  // pixels, each in [1, 65536], their product below 2^32
    std::uint64_t seed = 0;
    Integrator integrator = Integrator::path;
    bool mis = true;  // of next_event; false: next events alone find the lights that they sample (9.2)
    LightSampling light_sampling = LightSampling::power;  // of next_event and whitted
    std::uint32_t bounces = 12;                           // scattering events at most: bounces + 1 segments
    std::uint32_t roulette_start = no_roulette;           // scattering events before roulette may end a path
    double ray_min = 0.0;                                 // inclusive interval of ray parameters, scene units
    double ray_max = std::numeric_limits<double>::infinity();
    std::optional<EffectSet> effects;  // what to simulate; empty: what the scene calls for and no more
    IntersectionSettings intersection;
    PixelFilter filter = PixelFilter::box;
    Generator generator = Generator::philox;                 // MODEL.md section 3
    double clamp = std::numeric_limits<double>::infinity();  // > 0: what a sample's channel may bring at most (11.1)
    std::optional<Fresnel> fresnel;                          // in place of every material's own
    std::optional<Accumulation> accumulation;                // empty: the backend's own (RendererInfo)
    Sampling sampling = Sampling::uniform;                   // adaptive: jobs also render lists of pixels
    Instancing instancing = Instancing::automatic;
    HierarchyQuality hierarchy = HierarchyQuality::high;
};

// The scene with what the settings say of its materials; nothing if it stays as it is.
[[nodiscard]] std::optional<Scene> changed_by(const RenderSettings& settings, const Scene& scene);

// The settings that the scene's file asks for.
[[nodiscard]] RenderSettings default_settings(const Scene& scene);

// The same settings for a film of the same shape whose longer side is `longer_side` pixels; no side falls below 1.
[[nodiscard]] RenderSettings with_longer_side(RenderSettings settings, std::uint32_t longer_side);

// "path", "next-event", "whitted", "bidirectional": the names of scene files and options, in the order of Integrator.
inline constexpr std::array<std::string_view, 4> integrator_names{"path", "next-event", "whitted", "bidirectional"};
[[nodiscard]] std::string integrator_name(Integrator integrator);

// Whether it chooses among lights as the settings say (RenderSettings::light_sampling).
[[nodiscard]] constexpr bool chooses_lights(Integrator integrator) {
    return integrator == Integrator::next_event || integrator == Integrator::whitted;
}

// How a caller follows and stops a render. `progress` is called from one thread at a time with the samples a pixel
// done so far of this call (it may be fractional). A stop request ends the render early: the samples finished for
// every pixel by then are returned.
struct RenderControl {
    std::stop_token stop;
    std::function<void(double samples_done)> progress;
    // The samples that this job has rendered of the range's first block, which end within it, or nothing. The sums are
    // the same with them. A job that goes on from them takes them out into its result, and `progress` counts them.
    Estimate* begun = nullptr;
};

// How many samples of a block there are in RenderControl::begun. 0 where there are as many as are asked for, or more.
[[nodiscard]] std::uint64_t samples_begun(const RenderControl& control, SampleRange block);

// Takes what RenderJob::first_vertices finds of one pixel, y * width + x: a vertex a sample, in ascending order.
using FirstVertexVisitor = std::function<void(std::uint32_t pixel, std::span<TracedVertex> vertices)>;

struct RenderResult {
    Estimate estimate;
    double seconds = 0.0;                  // wall clock inside render()
    std::optional<double> device_seconds;  // the device's own clock, where there is one
};

// What a job consists of, for `tandem effects`. Empty or 0: the renderer does not tell.
struct JobFacts {
    EffectSet effects;                      // simulated
    EffectSet compiled = EffectSet::all();  // that its code could simulate: there is none of the others'
    std::string variant;                    // of code that was compiled with the program; empty: code made for the job
    struct Part {
        std::string name;          // "scatter", "interiors"
        std::uint64_t amount = 0;  // a kernel's instructions or bindings, a buffer's bytes, dispatches
    };
    std::vector<Part> kernels, buffers;
    std::vector<Part> bindings;        // to buffers, that a kernel's code uses
    std::vector<Part> dispatches;      // of a kernel, for the first sample of every pixel
    std::uint64_t bytes_per_path = 0;  // of state between two vertices
    double kernel_seconds = 0.0;       // spent on making the kernels, as far as drivers did so when asked to
    double hierarchy_seconds = 0.0;    // spent on building hierarchies over primitives; 0: there is none
};

// Throws Error unless the samples are of one block, as RenderJob::first_vertices wants them.
void check_one_block(SampleRange samples);

// A scene made ready for one renderer and one set of settings.
class RenderJob {
public:
    virtual ~RenderJob() = default;
    [[nodiscard]] virtual JobFacts facts() const { return {}; }
    // Whether render() goes on from RenderControl::begun. Else it renders them anew.
    [[nodiscard]] virtual bool goes_on_in_blocks() const { return false; }
    // Renders samples `range` of every pixel; range.begin must be a multiple of samples_per_block (else Error). The
    // estimate of a range does not depend on what was rendered before, on threads or on their order: same bits. But
    // with Accumulation::plain the sums go on from those of the call before, where that ended at range.begin.
    [[nodiscard]] virtual RenderResult render(SampleRange range, const RenderControl& control = {}) = 0;
    // Renders some pixels alone, `pixels` being ascending indices y * width + x, at least one. The estimate is
    // pixels.size() wide and 1 high, its values, in this order, being bit for bit those that render() gives those
    // pixels. A stop leaves the samples finished for all of them. Throws UnsupportedError in a job that was not
    // prepared with Sampling::adaptive.
    [[nodiscard]] virtual RenderResult render_pixels(
        SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control = {});
    // The paths of samples of pixel (x, y), vertex by vertex: the very ones that render() follows. Throws
    // UnsupportedError, with the reason, where this job cannot.
    [[nodiscard]] virtual std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples);
    // The same with a number changed. Throws UnsupportedError where this job cannot.
    [[nodiscard]] virtual std::vector<PathTrace> trace_with(
        ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples);
    // Finds the first vertices of the paths of all pixels of the job's film. They are bit for bit those that trace()
    // gives. `samples` are of one block. `visit` is called once for each pixel, by several threads at once. False after
    // a stop: pixels are left out. Throws as trace() does, and Error for samples of two blocks.
    [[nodiscard]] virtual bool first_vertices(
        FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit);
};

struct RendererInfo {
    std::string backend;  // "cpu", "vulkan", "oracle"
    std::string device;   // "Intel Xeon …, 2 threads", "NVIDIA H200"
    std::string driver;   // "Embree 3.13.5", "Mesa llvmpipe 22.3.6"
    std::string api;      // "Embree 3.13.5", "Vulkan 1.3.224", "C++"
    // Its paths are what MODEL.md section 3's numbers make of them, so that two such renderers take the same ones.
    bool follows_numbers = false;
    // Integrator::next_event samples lights; otherwise it is taken for Integrator::path, which has the same mean.
    bool samples_lights = true;
    Accumulation accumulation = Accumulation::in_double;  // where settings leave it open
};

// Whether two renderers draw from one distribution, so that also their variances are to agree.
[[nodiscard]] inline bool same_estimator(const RendererInfo& a, const RendererInfo& b, Integrator integrator) {
    return integrator != Integrator::next_event || a.samples_lights == b.samples_lights;
}

class Renderer {
public:
    virtual ~Renderer() = default;
    [[nodiscard]] virtual RendererInfo info() const = 0;
    // Throws UnsupportedError for what check_settings refuses and for what this renderer cannot do with this scene or
    // these settings. The job owns all it needs of the scene; it must not outlive the renderer.
    [[nodiscard]] virtual std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) = 0;
    // The same scene for rays that are given; of the settings, `intersection` counts. It must not outlive the
    // renderer. Throws UnsupportedError where this renderer takes no such rays.
    [[nodiscard]] virtual std::unique_ptr<RayIntersector> intersector(
        const Scene& scene, const RenderSettings& settings);
    // Where the device's arithmetic is not this program's own: its operations one by one, for the self-test
    // (common/self_test). Must not outlive the renderer.
    [[nodiscard]] virtual std::unique_ptr<ArithmeticProbe> arithmetic() { return nullptr; }
};

// How to make a renderer. A backend refuses what it has no use for (UnsupportedError), never ignores it.
struct BackendOptions {
    std::string device;                  // Vulkan: index or part of the name; empty: the best one
    std::optional<Precision> precision;  // empty: single, the oracle double
    std::string kernel;                  // Vulkan: its shape ("stages", "megakernel", ...); empty: the fastest
    unsigned threads = 0;                // CPU: 0 is all
    bool validation = false;             // Vulkan: layers on, any message is an Error
    PlantedFault planted_bug{};          // test builds only
};

struct Backend {
    std::string name;
    std::string description;
    std::function<std::unique_ptr<Renderer>(const BackendOptions&)> create;
};
using BackendList = std::vector<Backend>;

// The backend of that name, or InputError naming those there are.
[[nodiscard]] const Backend& find_backend(const BackendList& backends, const std::string& name);

}  // namespace tandem
