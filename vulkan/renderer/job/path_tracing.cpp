#include "vulkan/renderer/job/path_tracing.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/error.h"
#include "vulkan/command/barrier.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

// shaders/kernels/trace.comp: a head, then so many words of four for each vertex.
constexpr std::uint32_t words_per_vertex = 10;
constexpr std::uint32_t words_per_pixel = 3;  // of the sums that records take the place of
constexpr std::uint32_t most_words = 1u << 20;
constexpr std::uint32_t most_bounces = most_words / words_per_vertex - 2;

std::uint32_t words_of_path(std::uint32_t bounces) {
    if (bounces > most_bounces)
        throw UnsupportedError("a path of more than " + std::to_string(most_bounces) +
                               " bounces is too long to be traced whole; ask for fewer --bounces");
    return 1 + words_per_vertex * (bounces + 1);
}

ShaderVariant variant_of(GeometryPrecision precision) {
    KernelForm form;
    form.precision = precision;
    return form.variant();
}

glm::dvec3 vector_of(const gpu::Vec4& word) { return {word.x, word.y, word.z}; }
std::uint32_t bits_of(const gpu::Vec4& word) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &word.w, sizeof bits);
    return bits;
}

TracedVertex vertex_of(const gpu::Vec4* words) {
    TracedVertex vertex;
    vertex.origin = vector_of(words[0]);
    vertex.direction = vector_of(words[1]);
    vertex.primitive = bits_of(words[1]);
    vertex.material = bits_of(words[2]);
    vertex.end = static_cast<PathEnd>(bits_of(words[3]));
    vertex.throughput = vector_of(words[4]);
    vertex.in_medium = bits_of(words[4]) != 0;
    vertex.radiance = vector_of(words[5]);
    vertex.light_direction = vector_of(words[8]);
    vertex.light = vector_of(words[9]);
    if (vertex.end != PathEnd::left_scene) {
        vertex.t = double{words[0].w};
        vertex.position = vector_of(words[2]);
        vertex.normal = vector_of(words[3]);
    }
    if (vertex.end == PathEnd::goes_on) {
        vertex.pdf = double{words[5].w};
        vertex.next_direction = vector_of(words[6]);
        vertex.next_throughput = vector_of(words[7]);
    }
    return vertex;
}

}  // namespace

PathTracing::PathTracing(const Device& device, Stages& stages, const SceneData& scene,
    const Specialisation& specialisation, std::uint32_t bounces, GeometryPrecision precision)
    : primitives_(scene.in_double ? 0 : scene.triangle_count + scene.sphere_count + scene.cuboid_count),
      words_(words_of_path(bounces)),
      most_samples_(std::max(1u, most_words / words_)),
      pipelines_(stages.path_pipelines(specialisation, variant_of(precision), primitives_ > 0)),
      resources_(device, scene, {}, 0, most_samples_ * words_ / words_per_pixel + 1, MemoryLayout::per_set),
      bindings_(device, stages.layout(), resources_),
      submission_(device, {}) {}

void PathTracing::record(const vk::raii::CommandBuffer& commands, const vk::raii::Pipeline& pipeline,
    const gpu::Settings& settings, std::uint32_t invocations) const {
    if (invocations == 0) return;
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
    bindings_.bind(commands, settings, 0, 0);
    commands.dispatch((invocations + workgroup_size - 1) / workgroup_size, 1, 1);
}

PathTrace PathTracing::read(const gpu::Vec4* words) const {
    PathTrace trace;
    trace.radiance = vector_of(words[0]);
    for (std::uint32_t k = 0; k < bits_of(words[0]); ++k)
        trace.vertices.push_back(vertex_of(words + 1 + k * words_per_vertex));
    return trace;
}

// In place of the pixels of a tile, samples of the first of them.
std::vector<PathTrace> PathTracing::follow(const gpu::Settings& settings) {
    const bool first = !std::exchange(scene_uploaded_, true);
    if (first) resources_.write_scene();
    submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
        if (first) {
            resources_.record_upload(commands);
            resources_.record_clear_counters(commands);
            barrier(commands, transfer_write, compute_access);
            record(commands, pipelines_->vertex, settings, primitives_);
            barrier(commands, compute_write, compute_access);
        }
        record(commands, pipelines_->trace, settings, settings.pixel_count);
        resources_.record_download(commands, 1, settings.pixel_count * words_ / words_per_pixel + 1);
    });
    (void)submission_.run();
    std::vector<PathTrace> traces;
    for (std::uint32_t i = 0; i < settings.pixel_count; ++i)
        traces.push_back(read(resources_.downloaded_sums() + std::size_t{i} * words_));
    return traces;
}

std::vector<PathTrace> PathTracing::trace(std::uint32_t pixel, SampleRange samples, gpu::Settings settings) {
    std::vector<PathTrace> traces;
    settings.first_pixel = pixel;
    for (std::uint64_t begin = samples.begin; begin < samples.end;) {
        // Within a run the low word of the sample must not overflow.
        const std::uint64_t rest = (std::uint64_t{1} << 32) - (begin & 0xFFFFFFFFu);
        const std::uint64_t count = std::min({samples.end - begin, std::uint64_t{most_samples_}, rest});
        settings.sample_index = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(begin >> 32)};
        settings.pixel_count = static_cast<std::uint32_t>(count);
        std::vector<PathTrace> run = follow(settings);
        // A path that scattered and ended all the same was ended by roulette if it goes on without.
        gpu::Settings without = settings;
        without.roulette_start = no_roulette;
        const std::vector<PathTrace> endless =
            settings.roulette_start == no_roulette ? std::vector<PathTrace>() : follow(without);
        for (std::size_t i = 0; i < endless.size(); ++i) {
            const std::size_t last = run[i].vertices.size() - 1;
            PathEnd& end = run[i].vertices[last].end;
            if (end == PathEnd::absorbed && endless[i].vertices.at(last).end == PathEnd::goes_on)
                end = PathEnd::roulette;
        }
        std::ranges::move(run, std::back_inserter(traces));
        begin += count;
    }
    return traces;
}

}  // namespace tandem
