#include "common/render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/text.h"

namespace tandem {

RenderSettings default_settings(const Scene& scene) {
    RenderSettings settings;
    settings.width = scene.film.width;
    settings.height = scene.film.height;
    settings.integrator = scene.defaults.integrator;
    settings.bounces = scene.defaults.bounces;
    settings.roulette_start = scene.defaults.roulette_start;
    settings.ray_min = scene.defaults.ray_min;
    settings.ray_max = scene.defaults.ray_max;
    return settings;
}

std::optional<Scene> changed_by(const RenderSettings& settings, const Scene& scene) {
    if (!settings.fresnel) return std::nullopt;
    Scene changed = scene;
    for (Material& material : changed.materials) material.fresnel = *settings.fresnel;
    return changed;
}

RenderSettings with_longer_side(RenderSettings settings, std::uint32_t longer_side) {
    const double scale = static_cast<double>(longer_side) / std::max(settings.width, settings.height);
    const auto scaled = [&](std::uint32_t length) {
        return static_cast<std::uint32_t>(std::max(1.0, std::round(length * scale)));
    };
    settings.width = scaled(settings.width);
    settings.height = scaled(settings.height);
    return settings;
}

std::string integrator_name(Integrator integrator) {
    return std::string(integrator_names.at(static_cast<std::size_t>(integrator)));
}

std::unique_ptr<RayIntersector> Renderer::intersector(const Scene& /*scene*/, const RenderSettings& /*settings*/) {
    throw UnsupportedError("the " + info().backend + " backend takes no rays of its caller; it renders images alone");
}

std::uint64_t samples_begun(const RenderControl& control, SampleRange block) {
    const std::uint64_t begun = control.begun != nullptr ? control.begun->ragged_count(block.begin) : 0;
    return begun < block.count() ? begun : 0;
}

RenderResult RenderJob::render_pixels(
    SampleRange /*range*/, std::span<const std::uint32_t> /*pixels*/, const RenderControl& /*control*/) {
    throw UnsupportedError("this renderer gives every pixel as many samples; use --sampling uniform");
}

std::vector<PathTrace> RenderJob::trace(std::uint32_t /*x*/, std::uint32_t /*y*/, SampleRange /*samples*/) {
    throw UnsupportedError("this renderer cannot follow a single path");
}

std::vector<PathTrace> RenderJob::trace_with(
    ChangedNumber /*changed*/, std::uint32_t /*x*/, std::uint32_t /*y*/, SampleRange /*samples*/) {
    throw UnsupportedError("this renderer cannot follow a path with a random number changed");
}

void check_one_block(SampleRange samples) {
    if (samples.end <= samples.begin || samples.begin / samples_per_block != (samples.end - 1) / samples_per_block)
        throw Error(fmt::format("first vertices: samples {} to {} are not of one block of {}", samples.begin,
            samples.end, samples_per_block));
}

bool RenderJob::first_vertices(
    FilmSize film, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) {
    check_one_block(samples);
    std::vector<TracedVertex> vertices;
    for (std::uint32_t pixel = 0; pixel < film.pixel_count(); ++pixel) {
        if (control.stop.stop_requested()) return false;
        vertices.clear();
        for (PathTrace& path : trace(pixel % film.width, pixel / film.width, samples))
            vertices.push_back(path.vertices.front());
        visit(pixel, vertices);
        if (control.progress)
            control.progress(
                static_cast<double>((pixel + 1) * samples.count()) / static_cast<double>(film.pixel_count()));
    }
    return true;
}

const Backend& find_backend(const BackendList& backends, const std::string& name) {
    const auto found = std::ranges::find(backends, name, &Backend::name);
    if (found != backends.end()) return *found;
    if (name.starts_with("exec:"))
        throw InputError(
            "exec: only verify takes a command, as --reference or --candidate; other commands need a backend of their "
            "own");
    std::vector<std::string> names;
    for (const Backend& backend : backends) names.push_back(backend.name);
    const std::string meant = name == "gpu" ? "did you mean vulkan? " : did_you_mean(name, names);
    throw InputError(fmt::format("no backend '{}'; {}choose one of {}", name, meant, fmt::join(names, ", ")));
}

}  // namespace tandem
