#include "vulkan/renderer/job/path_tracing.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <future>
#include <utility>

#include "common/error.h"
#include "common/processors.h"
#include "vulkan/command/barrier.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

// shaders/kernels/trace.comp: a head, then so many words of four for each vertex.
constexpr std::uint32_t words_per_vertex = 14;
constexpr std::uint32_t words_per_pixel = 3;  // of the sums that records take the place of
constexpr std::uint32_t most_words = 1u << 20;
constexpr std::uint32_t most_threads = 16;  // that read records: a batch is a few thousand pixels
constexpr std::uint32_t most_bounces = most_words / words_per_vertex - 2;
static_assert((1 + words_per_vertex) * samples_per_block <= most_words / 2);

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
double last_of(const gpu::Vec4& word) { return word.w; }
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
    vertex.found_weight = last_of(words[6]);
    vertex.survival = last_of(words[7]);
    vertex.shading_normal = vector_of(words[10]);
    vertex.light = vector_of(words[9]);
    vertex.next_event.direction = vector_of(words[8]);
    if (vertex.light != glm::dvec3(0.0))
        vertex.next_event = {vertex.next_event.direction, vector_of(words[11]), last_of(words[8]), vector_of(words[12]),
            vector_of(words[13]), last_of(words[9])};
    if (vertex.end != PathEnd::left_scene) {
        vertex.t = last_of(words[0]);
        vertex.position = vector_of(words[2]);
        vertex.normal = vector_of(words[3]);
    }
    if (vertex.end == PathEnd::goes_on) {
        vertex.pdf = last_of(words[5]);
        vertex.next_direction = vector_of(words[6]);
        vertex.next_throughput = vector_of(words[7]);
    }
    return vertex;
}

// body(begin, end) for pieces of [0, count), each by a thread.
void in_parallel(std::uint32_t count, const std::function<void(std::uint32_t, std::uint32_t)>& body) {
    const std::uint32_t pieces = std::min(count, std::clamp(usable_processors(), 1u, most_threads));
    const auto from = [&](std::uint32_t piece) {
        return static_cast<std::uint32_t>(std::uint64_t{count} * piece / pieces);
    };
    std::vector<std::future<void>> others;
    for (std::uint32_t i = 1; i < pieces; ++i)
        others.push_back(std::async(std::launch::async, [&, i] { body(from(i), from(i + 1)); }));
    body(0, from(1));
    for (std::future<void>& other : others) other.get();
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

// In place of a tile's sums, records of its pixels' paths up to settings.segment.
void PathTracing::follow(const gpu::Settings& settings) {
    const bool first = !std::exchange(scene_uploaded_, true);
    if (first) resources_.write_scene();
    const std::uint32_t paths = settings.pixel_count * settings.sample_count;
    const std::uint32_t words = paths * words_of_path(settings.segment);
    submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
        if (first) {
            resources_.record_upload(commands);
            resources_.record_clear_counters(commands);
            barrier(commands, transfer_write, compute_access);
            record(commands, pipelines_->vertex, settings, primitives_);
            barrier(commands, compute_write, compute_access);
        }
        record(commands, pipelines_->trace, settings, paths);
        resources_.record_download(commands, 1, words / words_per_pixel + 1);
    });
    (void)submission_.run();
}

std::vector<PathTrace> PathTracing::follow_whole(const gpu::Settings& settings) {
    follow(settings);
    std::vector<PathTrace> traces;
    for (std::uint32_t i = 0; i < settings.sample_count; ++i)
        traces.push_back(read(resources_.downloaded_sums() + std::size_t{i} * words_));
    return traces;
}

std::vector<PathTrace> PathTracing::trace(std::uint32_t pixel, SampleRange samples, gpu::Settings settings) {
    std::vector<PathTrace> traces;
    settings.first_pixel = pixel;
    settings.pixel_count = 1;
    settings.segment = settings.bounces;
    for (std::uint64_t begin = samples.begin; begin < samples.end;) {
        // Within a run the low word of the sample must not overflow.
        const std::uint64_t rest = (std::uint64_t{1} << 32) - (begin & 0xFFFFFFFFu);
        const std::uint64_t count = std::min({samples.end - begin, std::uint64_t{most_samples_}, rest});
        settings.sample_index = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(begin >> 32)};
        settings.sample_count = static_cast<std::uint32_t>(count);
        std::vector<PathTrace> run = follow_whole(settings);
        // A path that scattered and ended all the same was ended by roulette if it goes on without.
        gpu::Settings without = settings;
        without.roulette_start = no_roulette;
        const std::vector<PathTrace> endless =
            settings.roulette_start == no_roulette ? std::vector<PathTrace>() : follow_whole(without);
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

bool PathTracing::first_vertices(
    SampleRange samples, gpu::Settings settings, const RenderControl& control, const FirstVertexVisitor& visit) {
    check_one_block(samples);
    const auto count = static_cast<std::uint32_t>(samples.count());
    const std::uint32_t pixels = settings.width * settings.height;
    const std::uint32_t words = words_of_path(0);
    // There is room for half of most_words at least, and a pixel's samples are of one block.
    const std::uint32_t pixels_at_once = most_samples_ * words_ / (words * count);
    settings.sample_index = {
        static_cast<std::uint32_t>(samples.begin), static_cast<std::uint32_t>(samples.begin >> 32)};
    settings.sample_count = count;
    settings.segment = 0;
    for (std::uint32_t done = 0; done < pixels; done += settings.pixel_count) {
        if (control.stop.stop_requested()) return false;
        settings.first_pixel = done;
        settings.pixel_count = std::min(pixels_at_once, pixels - done);
        follow(settings);
        const gpu::Vec4* const records = resources_.downloaded_sums();
        in_parallel(settings.pixel_count, [&](std::uint32_t begin, std::uint32_t end) {
            std::vector<TracedVertex> vertices(count);
            for (std::uint32_t pixel = begin; pixel < end; ++pixel) {
                for (std::uint32_t i = 0; i < count; ++i)
                    vertices[i] = vertex_of(records + (std::size_t{pixel} * count + i) * words + 1);
                visit(done + pixel, vertices);
            }
        });
        if (control.progress) control.progress(static_cast<double>(count) * (done + settings.pixel_count) / pixels);
    }
    return true;
}

}  // namespace tandem
