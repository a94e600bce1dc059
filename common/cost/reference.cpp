#include "common/cost/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "common/deadline.h"
#include "common/files/read_file.h"
#include "common/text.h"

namespace tandem {

namespace {

constexpr double chunk_seconds = 0.3;                          // so long at most (about) does a stop wait
constexpr std::uint64_t second_half = std::uint64_t{1} << 62;  // first sample of the second half
constexpr std::uint64_t reference_seed = 0x7265666572656e63u;  // "referenc": unlike any that a user gives

// Sums of one half of the reference.
struct Half {
    PixelValues sum, squares;
    std::uint64_t samples = 0, first = 0;

    void add(const Estimate& estimate) {
        const Estimate::Plane totals = estimate.totals();
        sum.resize(totals.size(), 0.0);
        squares.resize(totals.size(), 0.0);
        for (std::size_t i = 0; i < totals.size(); ++i) {
            sum[i] += totals[i].sum;
            squares[i] += totals[i].sum_of_squares;
        }
        samples += estimate.count();
    }
};

void restore(const CostReference& earlier, std::array<Half, 2>& halves) {
    for (std::size_t h = 0; h < 2; ++h) {
        Half& half = halves[h];
        half.samples = earlier.samples / 2;
        const auto n = static_cast<double>(half.samples);
        half.sum.resize(earlier.mean.size());
        half.squares.resize(earlier.mean.size());
        for (std::size_t i = 0; i < half.sum.size(); ++i) {
            const double mean = earlier.mean[i] + (h == 0 ? 1.0 : -1.0) * earlier.half_difference[i];
            half.sum[i] = n * mean;
            half.squares[i] = earlier.half_variance[i] * n * (n - 1.0) + n * mean * mean;
        }
    }
}

void conclude(const std::array<Half, 2>& halves, CostReference& reference) {
    const auto n = static_cast<double>(halves[0].samples);
    const std::size_t size = halves[0].sum.size();
    reference.samples = 2 * halves[0].samples;
    reference.mean.resize(size);
    reference.half_difference.resize(size);
    reference.half_variance.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
        const double first = halves[0].sum[i] / n, second = halves[1].sum[i] / n;
        reference.mean[i] = 0.5 * (first + second);
        reference.half_difference[i] = 0.5 * (first - second);
        const double deviations = halves[0].squares[i] + halves[1].squares[i] - n * (first * first + second * second);
        reference.half_variance[i] = std::max(0.0, deviations / (2.0 * (n - 1.0)) / n);
    }
}

// What the reference's bits depend on: the files, the settings, the machine and the program.
std::string key_of(const CostRequest& request, const ArmSettings& settings, const RendererInfo& info) {
    return hash_of(fmt::format("{}\n{}\n{}", request.scene_bytes, text_of(settings, info), request.program));
}

// Nothing for the box, so that references from before there were others keep their keys.
std::string filter_of(const RenderSettings& render, const std::string& before = " filter ") {
    if (render.filter == PixelFilter::box) return "";
    return before + std::string(pixel_filter_names[static_cast<std::size_t>(render.filter)]);
}

// Scene, size, range of rays and pixel filter: what an image is of, whatever renders it.
std::string image_of(const CostRequest& request) {
    const RenderSettings& render = request.baseline.render;
    return hash_of(fmt::format("{}\n{}x{} rays {} {}{}", request.scene_bytes, render.width, render.height,
        render.ray_min, render.ray_max, filter_of(render)));
}

std::optional<CostReference> cached(const std::filesystem::path& file, const std::string& key, std::size_t size) {
    if (!std::filesystem::exists(file)) return std::nullopt;
    CostReference reference = reference_from_bytes(read_file(file), file.string());
    if (reference.key != key || reference.mean.size() != size)
        throw input_error(file.string(), "", "is a reference of another scene, size, device or program",
            "delete it, or name another");
    return reference;
}

struct Preparation {
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<RenderJob> job;
    std::string key, options, made_by;
};

// Next events do not find all lights behind glass (MODEL.md section 8.3). Paths from both ends do, at greater cost.
std::unique_ptr<RenderJob> job_of(const Scene& scene, Renderer& renderer, RenderSettings& settings) {
    std::string reason;
    for (const Integrator integrator : {settings.integrator, Integrator::bidirectional}) {
        settings.integrator = integrator;
        try {
            return renderer.prepare(scene, settings);
        } catch (const UnsupportedError& refusal) {
            reason += fmt::format("; {}: {}", integrator_name(integrator), refusal.what());
        }
    }
    throw UnsupportedError("no long reference can be rendered, so that errors cannot be measured" + reason);
}

Preparation prepare(const Scene& scene, const CostRequest& request) {
    ArmSettings settings = reference_settings(request.baseline, request.reference_backend);
    settings.render.seed = reference_seed;
    Preparation made;
    made.renderer = request.make_reference(settings.backend);
    made.job = job_of(scene, *made.renderer, settings.render);
    const RendererInfo info = made.renderer->info();
    made.key = key_of(request, settings, info);
    made.options = fmt::format("--integrator {} --bounces {} --roulette {} --generator {}{}{}",
        integrator_name(settings.render.integrator), settings.render.bounces, settings.render.roulette_start,
        generator_names[static_cast<std::size_t>(settings.render.generator)],
        settings.backend.precision
            ? " --precision " + std::string(precision_names[static_cast<std::size_t>(*settings.backend.precision)])
            : "",
        filter_of(settings.render, " --filter "));
    made.made_by = fmt::format("{}, {}, {}", info.backend, info.device, info.driver);
    return made;
}

void check_not_black(const CostReference& reference) {
    if (!(reference.image_mean() > 0.0))
        throw InputError("the image is black, so that no error is relative to anything");
}

// Goes on with what `file` holds, or begins; written where there is more than before.
CostReference continued(const CostRequest& request, const Preparation& made, const std::filesystem::path& file,
    double seconds, bool more, const CostControl& control) {
    const RenderSettings& render = request.baseline.render;
    const std::size_t size = std::size_t{render.width} * render.height * channel_count;
    const auto at_any_rate = [&](const auto& access) {
        try {
            access();
        } catch (const InputError& error) {
            if (!request.cache_fault) throw;
            request.cache_fault(error);
        }
    };
    std::optional<CostReference> earlier;
    if (!file.empty()) at_any_rate([&] { earlier = cached(file, made.key, size); });
    if (request.earlier && request.earlier->reference.key == made.key &&
        (!earlier || earlier->seconds < request.earlier->reference.seconds))
        earlier = request.earlier->reference;
    const double before = earlier ? earlier->seconds : 0.0;
    CostReference reference = render_reference(*made.job, std::move(earlier), (more ? before : 0.0) + seconds, control);
    if (reference.samples == 0)
        throw StoppedError(fmt::format(
            "stopped before there was a reference, of {} samples a pixel at least; a smaller --size has one sooner",
            2 * samples_per_block));
    reference.key = made.key;
    reference.options = made.options;
    reference.image = image_of(request);
    reference.made_by = made.made_by;
    reference.program = request.program;
    if (!file.empty() && reference.seconds > before)
        at_any_rate([&] {
            std::error_code error;  // writing tells
            if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
            write_text_file(file, to_bytes(reference), request.read == nullptr ? FilesRead{} : *request.read);
        });
    check_not_black(reference);
    return reference;
}

// One that was rendered before, maybe elsewhere.
CostReference given(const CostRequest& request) {
    const std::string name = request.reference_file.string();
    CostReference reference = reference_from_bytes(read_file(name), name);
    const RenderSettings& render = request.baseline.render;
    if (reference.image != image_of(request) ||
        reference.mean.size() != std::size_t{render.width} * render.height * channel_count)
        throw input_error(
            name, "", "is a reference of another scene, size, range of rays or pixel filter", "name another");
    check_not_black(reference);
    return reference;
}

}  // namespace

std::string text_of(const ArmSettings& settings, const RendererInfo& info) {
    const RenderSettings& render = settings.render;
    const IntersectionSettings& meeting = render.intersection;
    std::string more = settings.denoise ? " denoised" : "";
    if (render.hierarchy != HierarchyQuality::high)
        more += fmt::format(" hierarchy {}", name_of(render.hierarchy, hierarchy_quality_names));
    if (render.effects) more += fmt::format(" effects {:x}", render.effects->bits());
    return fmt::format(
        "{}x{} seed {} {} bounces {} roulette {} rays {} {} kernels {} {} {} {} on {} {} {} precision {} {} generator "
        "{} clamp {} fresnel {} mis {} light {} accumulation {} sampling {}{}{}",
        render.width, render.height, render.seed, integrator_name(render.integrator), render.bounces,
        render.roulette_start, render.ray_min, render.ray_max, static_cast<int>(meeting.triangles),
        static_cast<int>(meeting.convex), static_cast<int>(meeting.guard), meeting.epsilon, info.backend, info.device,
        info.driver, settings.backend.precision ? static_cast<int>(*settings.backend.precision) : -1,
        settings.backend.kernel, static_cast<int>(render.generator), render.clamp,
        render.fresnel ? static_cast<int>(*render.fresnel) : -1, render.mis,
        light_sampling_names[static_cast<std::size_t>(render.light_sampling)],
        static_cast<int>(render.accumulation.value_or(info.accumulation)),
        sampling_names[static_cast<std::size_t>(render.sampling)], filter_of(render), more);
}

InputError other_measurement() {
    return InputError(
        "--resume: that measurement is of another scene, size, device or program, or of other settings or --knob; name "
        "another file to begin anew");
}

CostReference render_reference(
    RenderJob& job, std::optional<CostReference> earlier, double seconds, const CostControl& control) {
    CostReference reference;
    std::array<Half, 2> halves{};
    halves[1].first = second_half;
    if (earlier) {
        reference = std::move(*earlier);
        restore(reference, halves);
    }
    const double start = now_by(control), before = reference.seconds;
    std::uint64_t chunk = samples_per_block;
    for (double spent = 0.0; (before + spent < seconds || reference.samples == 0) && !control.stop.stop_requested();) {
        for (Half& half : halves) {
            const std::uint64_t from = half.first + half.samples;
            const RenderResult part = job.render({from, from + chunk}, {.stop = control.stop, .progress = {}});
            if (part.estimate.count() != chunk) return reference;
            if (part.estimate.invalid() > 0)
                throw Error("the long reference has samples that are not finite or negative (MODEL.md section 12)");
            half.add(part.estimate);
            if (part.seconds < 0.5 * chunk_seconds && chunk < (std::uint64_t{1} << 20) && &half == &halves[1])
                chunk *= 2;
        }
        conclude(halves, reference);
        spent = now_by(control) - start;
        reference.seconds = before + spent;
        if (control.progress) control.progress(std::min(1.0, reference.seconds / seconds), "the long reference");
    }
    return reference;
}

CostReference render_reference_file(
    const Scene& scene, const CostRequest& request, double seconds, const CostControl& control) {
    return continued(request, prepare(scene, request), request.reference_file, seconds, true, control);
}

CostReference long_reference(
    const Scene& scene, const CostRequest& request, double seconds, const CostControl& control) {
    if (!request.reference_file.empty()) {
        CostReference reference = given(request);
        if (request.earlier && (request.earlier->reference.key != reference.key ||
                                   request.earlier->reference.samples != reference.samples))
            throw InputError(
                "--resume: that measurement is against another reference than --reference; name another file to begin "
                "anew");
        return reference;
    }
    if (request.earlier && request.earlier->reference.image != image_of(request)) throw other_measurement();
    // Nothing is held against it yet, so it may go on: a stop may have come early.
    const bool in_use = request.earlier && std::ranges::any_of(request.earlier->arms,
                                               [](const ArmTrials& arm) { return !arm.replicates.empty(); });
    if (in_use) return request.earlier->reference;
    const Preparation made = prepare(scene, request);
    const std::filesystem::path file =
        request.references.empty() ? std::filesystem::path() : request.references / (made.key + ".cbor");
    return continued(request, made, file, seconds, false, control);
}

}  // namespace tandem
