#include "vulkan/renderer/job/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <limits>
#include <utility>

#include "common/error.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/framework/spirv_optimizer.h"
#include "vulkan/renderer/job/job_settings.h"
#include "vulkan/renderer/kernels/kernel_shape.h"

namespace tandem {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// The acceleration structure's: in place of the set of settings, which the ray-tracing pipeline has pushed.
constexpr auto traced_set = static_cast<std::uint32_t>(SetIndex::settings);

}  // namespace

struct VulkanJob::Progress {
    const RenderControl& control;
    double samples_before = 0.0;  // of whole blocks, and of earlier tiles of this one as fractions
    double tile_share = 1.0;
    double device_seconds = 0.0;
    bool has_device_clock = true;

    void report(double samples_of_tile) const {
        if (control.progress) control.progress(samples_before + tile_share * samples_of_tile);
    }
};

VulkanJob::VulkanJob(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
    const RenderSettings& settings, Acceleration acceleration, PlantedFault planted_bug, const Patterns& patterns,
    GeometryPrecision precision)
    : instance_(instance),
      device_(device),
      patterns_(patterns),
      precision_(precision),
      settings_(mutated_settings(checked_settings(device, scene, settings, precision), planted_bug)),
      // A ray-tracing pipeline brings its own trees.
      scene_(flatten_for(scene, settings_,
          patterns.kernel == KernelShape::ray_tracing ? Acceleration::loops : acceleration, precision)),
      specialisation_(with_parameters(specialise(device, scene, scene_, settings_, planted_bug))),
      segments_(most_segments(specialisation_.effects, settings_)),
      kept_(traces_whole_paths(patterns.kernel) ? std::nullopt : std::optional(specialisation_.path)),
      accumulation_(*settings_.accumulation),
      stages_(stages),
      layout_(stages.layout(form())),
      pipelines_(stages.pipelines(specialisation_, form())),
      tile_pixels_(std::min(tile_size(device, part().pixel_count, kept_),
          patterns.tile_pixels > 0 ? patterns.tile_pixels : std::numeric_limits<std::uint32_t>::max())),
      resources_(device, scene_, kept_, settings_.bounces, tile_pixels_, patterns.memory, specialisation_.lists_pixels),
      bindings_(device, layout_, resources_, patterns),
      ordering_(device, patterns, resources_.written_by_dispatches()),
      submission_(device, patterns),
      plan_(device.description()) {
    if (patterns_.parts == 0 || patterns_.part >= patterns_.parts || part().pixel_count == 0)
        throw UnsupportedError("the image has too few pixels for so many parts");
    if (accumulation_ == Accumulation::plain && tile_pixels_ < part().pixel_count)
        throw UnsupportedError(
            "plain sums go on from block to block on the device, where this image does not fit at once; choose a "
            "smaller --size or --accumulation compensated");
    if (specialisation_.lists_pixels && patterns_.recording == RecordingPattern::pre_recorded)
        throw UnsupportedError("passes of adaptive sampling differ, so that their commands cannot be pre-recorded");
    if (patterns_.pixels == PixelPattern::claimed && patterns_.kernel != KernelShape::megakernel)
        throw UnsupportedError("pixels are claimed by the invocations of a megakernel alone");
    if (patterns_.pixels == PixelPattern::claimed && patterns_.claimants == 0 &&
        device.description().abilities.resident_invocations == 0)
        throw UnsupportedError("the driver does not tell how many invocations the device holds at once");
    if (patterns_.kernel == KernelShape::fragment) prepare_fragments(stages);
    if (patterns_.kernel == KernelShape::ray_tracing) prepare_rays(scene);
    if (patterns_.segments_per_submission > 0) batch_ = patterns_.segments_per_submission;
    instance_.log().raise();
}

void VulkanJob::prepare_fragments(Stages& stages) {
    if (patterns_.recording == RecordingPattern::secondary || patterns_.queue.kind != QueueKind::rendering)
        throw UnsupportedError("render passes begin in primary command buffers, on queues with graphics");
    if (specialisation_.lists_pixels)
        throw UnsupportedError(
            "fragments cover runs of pixels, no lists of them; use another --kernel or --sampling uniform");
    pass_ = &stages.fullscreen_pass();
    framebuffer_ = pass_->make_framebuffer(settings_.width, settings_.height);
}

void VulkanJob::prepare_rays(const Scene& scene) {
    if (const std::string reason = untraceable(scene, settings_); !reason.empty()) throw UnsupportedError(reason);
    if (patterns_.queue.kind != QueueKind::rendering)
        throw UnsupportedError("acceleration structures belong to the queues that build them, which render");
    traced_world_.emplace(device_, traced_boxes(scene, scene_), layout_.set(traced_set));
}

void VulkanJob::choose_candidates(Specialisation& specialisation) const {
    const CandidatePattern wanted = patterns_.candidates;
    if (wanted == CandidatePattern::automatic) return;
    const bool picks = wanted == CandidatePattern::edges || wanted == CandidatePattern::boxes;
    const bool can_pick = specialisation.unrolled && specialisation.triangles > 0 &&
                          specialisation.intersection.triangles == TriangleKernel::watertight;
    if (picks && !can_pick)
        throw UnsupportedError(
            "candidates are picked of a few triangles, by kernels made for the scene that loop over them, with the "
            "watertight test in single precision");
    specialisation.picks_candidates = picks;
    if (!picks) return;
    std::vector<TriangleBox>& boxes = specialisation.unrolled->boxes;
    boxes.clear();
    if (wanted == CandidatePattern::edges) return;
    boxes = find_triangle_boxes(scene_, specialisation.unrolled->corners);
    if (boxes.empty()) throw UnsupportedError("the scene has no box that is made of triangles");
}

Specialisation VulkanJob::with_parameters(Specialisation specialisation) const {
    const vk::PhysicalDeviceLimits& limits = device_.limits();
    specialisation.workgroup = patterns_.workgroup;
    if (patterns_.workgroup == 0 || patterns_.workgroup > limits.maxComputeWorkGroupInvocations ||
        patterns_.workgroup > limits.maxComputeWorkGroupSize[0])
        throw UnsupportedError(
            fmt::format("{} has no workgroups of {} invocations", device_.description().name, patterns_.workgroup));
    if (patterns_.kernel == KernelShape::ray_tracing) {
        specialisation.unrolled.reset();  // nor are there loops
        specialisation.few_primitives = false;
    }
    const bool on_cpu = device_.description().type == DeviceType::cpu;
    if (patterns_.hit_data == HitDataPattern::shared &&
        (patterns_.kernel != KernelShape::megakernel || specialisation.shared_materials == 0))
        throw UnsupportedError(
            "workgroups of a megakernel alone copy what hits need, of small scenes, in single precision");
    if (patterns_.hit_data == HitDataPattern::buffers || (patterns_.hit_data == HitDataPattern::automatic && on_cpu))
        specialisation.shared_materials = 0;
    choose_candidates(specialisation);
    if (patterns_.parameters == ParameterPattern::specialisation)
        specialisation.parameters = fixed_parameters(stage_settings({}, 0));
    return specialisation;
}

gpu::Settings VulkanJob::stage_settings(Tile tile, std::uint64_t sample) const {
    gpu::Settings result;
    result.seed = {static_cast<std::uint32_t>(settings_.seed), static_cast<std::uint32_t>(settings_.seed >> 32)};
    result.sample_index = {static_cast<std::uint32_t>(sample), static_cast<std::uint32_t>(sample >> 32)};
    result.width = settings_.width;
    result.height = settings_.height;
    result.first_pixel = tile.first_pixel;
    result.pixel_count = tile.pixel_count;
    result.bounces = settings_.bounces;
    result.roulette_start = settings_.roulette_start;
    result.light_count = static_cast<std::uint32_t>(scene_.lights.size());
    result.triangle_count = scene_.triangle_count;
    result.sphere_count = scene_.sphere_count;
    result.cuboid_count = scene_.cuboid_count;
    result.ray_min = to_distance(settings_.ray_min);
    result.ray_max = to_distance(settings_.ray_max);
    result.listed = listed_.empty() ? 0 : tile_listed_;
    result.direct_only = settings_.integrator == Integrator::whitted;
    return result;
}

void VulkanJob::bind(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    commands.bindPipeline(
        vk::PipelineBindPoint::eCompute, *pipelines_->stages[static_cast<std::size_t>(dispatch.stage)]);
    bindings_.bind(commands, dispatch.settings, dispatch.ray_parity, dispatch.sum_parity,
        pipelines_->plain[static_cast<std::size_t>(dispatch.stage)]);
}

void VulkanJob::record(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t invocations) const {
    if (invocations == 0) return;
    bind(commands, dispatch);
    commands.dispatch((invocations + specialisation_.workgroup - 1) / specialisation_.workgroup, 1, 1);
}

// Over the rays of the segment's queue, of which only the device knows how many there are; or over all places.
void VulkanJob::record_queue(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const {
    if (patterns_.kernel == KernelShape::image_stages) {
        record(commands, dispatch, places);
        return;
    }
    bind(commands, dispatch);
    commands.dispatchIndirect(resources_.queues(), resources_.queue_offset(dispatch.settings.segment));
}

namespace {

enum RecordingKind : std::uint32_t {
    pre_processing,
    first_pre_processing,
    sampling,
    post_processing,
    whole_paths,
    first_whole_paths,
    listing,
    downloading
};

}  // namespace

// Scene upload and vertex stage, which a job needs but once. What reads the world primitives is for the caller to
// order.
void VulkanJob::record_scene(
    const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t sum_parity) const {
    resources_.record_upload(commands);
    resources_.record_clear_counters(commands);
    barrier(commands, transfer_write, compute_access);
    if (scene_.in_double) return;
    record(commands, {Stage::vertex, settings, 0, sum_parity},
        scene_.triangle_count + scene_.sphere_count + scene_.cuboid_count);
    // Later barriers order all that was written before; those of single buffers leave out what is written but once.
    if (ordering_.leaves_out_others()) barrier(commands, compute_write, compute_access);
}

void VulkanJob::add_pixel_list(Tile tile) {
    const auto left = static_cast<std::uint32_t>(listed_.size()) - tile.first_pixel;
    const std::uint32_t count = tile_listed_ = std::min(tile.pixel_count, left);
    resources_.set_pixel_list(listed_.subspan(tile.first_pixel, count));
    submission_.add({listing, tile.first_pixel, count},
        [=, this](const vk::raii::CommandBuffer& commands) { resources_.record_pixel_list(commands, count); });
}

// The clearing stage, of the half of the sums that is not read, at each block. No barrier: nothing reads what was
// written here before the one that ray_gen needs.
void VulkanJob::add_pre_processing(Tile tile) {
    const Dispatch clearing{Stage::pre_process, stage_settings(tile, 0), 0, sum_parity_};
    const bool first = !std::exchange(scene_uploaded_, true);
    const bool after_tile = patterns_.tile_pixels > 0 && tile.first_pixel > part().first_pixel;
    sum_parity_ = 1 - sum_parity_;
    submission_.add({first ? first_pre_processing : pre_processing, clearing.sum_parity, tile.first_pixel},
        [=, this](const vk::raii::CommandBuffer& commands) {
            if (first) record_scene(commands, clearing.settings, clearing.sum_parity);
            if (after_tile) ordering_.after_dispatches(commands, compute_access);
            record(commands, clearing, tile.pixel_count);
        });
}

// Segment k reads half k mod 2 of the ray state and writes the other; ray_gen writes half 0, as if it were segment -1.
void VulkanJob::add_sampling(Tile tile, std::uint64_t sample, std::uint32_t first_segment, std::uint32_t end_segment) {
    const gpu::Settings settings = stage_settings(tile, sample);
    const std::uint32_t parity = sum_parity_;
    const Submission::Key key{sampling, parity + 2 * std::uint64_t{tile.first_pixel}, sample,
        first_segment + (std::uint64_t{end_segment} << 32)};
    const bool in_queues = patterns_.kernel != KernelShape::image_stages;
    const bool intersects = *pipelines_->stages[static_cast<std::size_t>(Stage::intersect)] != vk::Pipeline();
    submission_.add(key, [=, this](const vk::raii::CommandBuffer& commands) {
        if (first_segment == 0) record(commands, {Stage::ray_gen, settings, 1, parity}, tile.pixel_count);
        Dispatch dispatch{Stage::intersect, settings, 0, parity};
        for (std::uint32_t segment = first_segment; segment < end_segment; ++segment) {
            dispatch.settings.segment = segment;
            dispatch.ray_parity = segment % 2;
            // With the queue's arguments, for scatter too.
            ordering_.after_dispatches(commands, in_queues ? dispatch_access : compute_access);
            if (intersects) {
                dispatch.stage = Stage::intersect;
                record_queue(commands, dispatch, tile.pixel_count);
                ordering_.after_dispatches(commands, compute_access);
            }
            dispatch.stage = Stage::scatter;
            record_queue(commands, dispatch, tile.pixel_count);
        }
    });
}

void VulkanJob::add_post_processing(Tile tile, std::uint64_t sample) {
    const Dispatch dispatch{Stage::post_process, stage_settings(tile, 0), 0, sum_parity_};
    sum_parity_ = 1 - sum_parity_;
    // With the sample in its key, no command buffer is twice in one submission.
    submission_.add({post_processing, dispatch.sum_parity, tile.first_pixel, sample},
        [=, this](const vk::raii::CommandBuffer& commands) {
            ordering_.after_dispatches(commands, compute_access);
            record(commands, dispatch, tile.pixel_count);
        });
}

// So many invocations share out the places of a megakernel's dispatch. Neighbours in a subgroup soon have pixels far
// apart: trees, which their camera rays go down together otherwise, take up to 12 % longer on an H200, loops 8 % less.
std::uint32_t VulkanJob::claimants(std::uint32_t places) const {
    const std::uint32_t held =
        patterns_.claimants > 0 ? patterns_.claimants : device_.description().abilities.resident_invocations;
    const bool has_trees = specialisation_.triangle_root || specialisation_.sphere_root || specialisation_.cuboid_root;
    const bool claimed = patterns_.pixels == PixelPattern::claimed ||
                         (patterns_.pixels == PixelPattern::automatic && held > 0 && !has_trees);
    const std::uint32_t whole_groups = std::max(1u, held / specialisation_.workgroup) * specialisation_.workgroup;
    return claimed ? std::min(places, whole_groups) : places;
}

// A block's first share finds no sums and begins them.
void VulkanJob::add_megakernel(Tile tile, std::uint64_t first_sample, const MegakernelShare& share) {
    const bool first = !std::exchange(scene_uploaded_, true);
    const KernelShape shape = patterns_.kernel;
    const Stage stage = shape == KernelShape::fragment      ? Stage::fragment
                        : shape == KernelShape::ray_tracing ? Stage::rt_paths
                                                            : Stage::megakernel;
    Dispatch dispatch{stage, stage_settings(tile, first_sample + share.first_sample), 0, sum_parity_};
    dispatch.settings.sample_count = static_cast<std::uint32_t>(share.samples);
    dispatch.settings.first_invocation = share.first_invocation;
    dispatch.settings.invocations = share.invocations;
    dispatch.settings.keeps_sums = keeps_sums_;
    if (share.completes) sum_parity_ = 1 - sum_parity_;
    const Submission::Key key{first ? first_whole_paths : whole_paths,
        dispatch.sum_parity + (keeps_sums_ ? 2 : 0) + 4 * std::uint64_t{tile.first_pixel},
        first_sample + share.first_sample, share.first_invocation + (std::uint64_t{share.samples} << 32)};
    submission_.add(key, [=, this](const vk::raii::CommandBuffer& commands) {
        if (first) record_scene(commands, dispatch.settings, dispatch.sum_parity);
        ordering_.after_dispatches(
            commands, compute_access);  // after the vertex stage, or the share before, whose sums this one may read
        if (stage == Stage::fragment)
            record_fragments(commands, dispatch);
        else if (stage == Stage::rt_paths)
            record_rays(commands, dispatch);
        else
            record(commands, dispatch, claimants(share.invocations));
    });
}

// Fragments come after and before compute, to which all other barriers speak.
void VulkanJob::record_fragments(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    barrier(commands, compute_write, fragment_access);
    commands.bindPipeline(
        vk::PipelineBindPoint::eGraphics, *pipelines_->stages[static_cast<std::size_t>(dispatch.stage)]);
    bindings_.bind(
        commands, dispatch.settings, dispatch.ray_parity, dispatch.sum_parity, true, vk::PipelineBindPoint::eGraphics);
    const std::uint32_t first = dispatch.settings.first_pixel + dispatch.settings.first_invocation;
    const std::uint32_t last = first + dispatch.settings.invocations - 1;
    pass_->draw(commands, *framebuffer_, settings_.width, first / settings_.width, last / settings_.width + 1);
    barrier(commands, fragment_write, compute_access);
}

// Likewise.
void VulkanJob::record_rays(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    constexpr vk::PipelineBindPoint point = vk::PipelineBindPoint::eRayTracingKHR;
    barrier(commands, compute_write, tracing_access);
    commands.bindPipeline(point, pipelines_->rays->handle());
    bindings_.bind(commands, dispatch.settings, dispatch.ray_parity, dispatch.sum_parity, true, point);
    commands.bindDescriptorSets(point, layout_.handle(), traced_set, traced_world_->descriptors(), {});
    pipelines_->rays->trace(commands, dispatch.settings.invocations);
    barrier(commands, tracing_write, compute_access);
}

JobFacts VulkanJob::facts() const {
    JobFacts facts;
    facts.effects = specialisation_.effects;
    const std::vector<SpecialisationConstant> constants = specialisation_.constants();
    facts.compiled = facts.effects;
    for (const Stage stage : kernels_of(patterns_.kernel, facts.effects)) {
        if (stage == Stage::vertex && scene_.in_double) continue;
        const std::string name = stage_names[static_cast<std::size_t>(stage)];
        const std::vector<std::uint32_t> code = optimised_spirv(kernel_code(stage, form()).words, constants);
        facts.kernels.push_back({name, count_instructions(code)});
        facts.bindings.push_back({name, count_bindings(code)});
        if (is_called(stage)) continue;
        const bool every_segment = stage == Stage::intersect || stage == Stage::scatter;
        const bool places_nothing =
            stage == Stage::vertex && scene_.triangle_count + scene_.sphere_count + scene_.cuboid_count == 0;
        facts.dispatches.push_back({name, every_segment ? segments_ : places_nothing ? 0u : 1u});
    }
    facts.buffers = buffer_parts(scene_, kept_, settings_.bounces, tile_pixels_, specialisation_.lists_pixels);
    facts.bytes_per_path = bytes_per_path(kept_);
    facts.kernel_seconds = pipelines_->seconds;
    return facts;
}

void VulkanJob::adapt_batch(double seconds, std::uint64_t segments) {
    if (patterns_.segments_per_submission > 0) return;
    const std::uint64_t most = samples_per_block * std::uint64_t{segments_};
    if (seconds < shortest_submission) batch_ = std::clamp<std::uint64_t>(2 * segments, batch_, most);
    if (seconds > longest_submission)
        batch_ = std::max<std::uint64_t>(
            1, static_cast<std::uint64_t>(static_cast<double>(segments) * shortest_submission / seconds));
}

// Adds up to `most` segments from sample `done` of the block, segment `segment`, and moves both on; returns how many.
std::uint64_t VulkanJob::add_batch(
    Tile tile, SampleRange block, std::uint64_t most, std::uint64_t& done, std::uint32_t& segment) {
    std::uint64_t added = 0;
    while (added < most && done < block.count()) {
        const auto end = static_cast<std::uint32_t>(std::min<std::uint64_t>(segments_, segment + (most - added)));
        add_sampling(tile, block.begin + done, segment, end);
        added += end - segment;
        segment = end;
        if (segment < segments_) break;
        add_post_processing(tile, block.begin + done);
        segment = 0;
        ++done;
    }
    return added;
}

// Apart from the stages, so that the device's clock counts those alone.
void VulkanJob::download(Tile tile) {
    const std::uint32_t parity = sum_parity_;
    submission_.add({downloading, parity, tile.pixel_count}, [=, this](const vk::raii::CommandBuffer& commands) {
        resources_.record_download(commands, parity, tile.pixel_count);
    });
    (void)submit();
    instance_.log().raise();
    if (resources_.downloaded_counters().unfinished > 0)
        throw UnsupportedError(
            "the driver left the megakernel's loops before its paths had ended; use --kernel stages or fewer bounces");
}

double VulkanJob::run(Progress& progress) {
    const auto start = Clock::now();
    const std::optional<double> device_seconds = submit().device;
    progress.device_seconds += device_seconds.value_or(0.0);
    progress.has_device_clock = progress.has_device_clock && device_seconds.has_value();
    instance_.log().raise();
    return seconds_since(start);
}

std::uint64_t VulkanJob::render_by_stages(Tile tile, SampleRange block, Progress& progress) {
    std::uint64_t done = 0;
    std::uint32_t segment = 0;  // of sample `done`, which a slow device begins in one submission and ends in another
    if (!keeps_sums_) add_pre_processing(tile);
    while (done < block.count()) {
        if (done > 0 && segment == 0 && progress.control.stop.stop_requested()) break;
        const std::uint64_t recorded = add_batch(tile, block, batch_, done, segment);
        adapt_batch(run(progress), recorded);
        progress.report(static_cast<double>(done) + static_cast<double>(segment) / segments_);
    }
    return done;
}

std::uint64_t VulkanJob::render_by_megakernel(Tile tile, SampleRange block, Progress& progress) {
    plan_.begin(tile.pixel_count, block.count());
    while (plan_.done() < block.count()) {
        if (plan_.done() > 0 && plan_.done_of_next() == 0.0 && progress.control.stop.stop_requested()) break;
        add_megakernel(tile, block.begin, plan_.next());
        plan_.took(run(progress));
        progress.report(static_cast<double>(plan_.done()) + plan_.done_of_next());
    }
    return plan_.done();
}

// Renders samples of one block for one tile and leaves the sums downloaded; returns how many it did before a stop.
std::uint64_t VulkanJob::render_tile_block(Tile tile, SampleRange block, Progress& progress) {
    const std::uint64_t done = traces_whole_paths(patterns_.kernel) ? render_by_megakernel(tile, block, progress)
                                                                    : render_by_stages(tile, block, progress);
    download(tile);
    return done;
}

std::vector<PathTrace> VulkanJob::trace(std::uint32_t x, std::uint32_t y, SampleRange samples) {
    if (x >= settings_.width || y >= settings_.height) throw Error("the pixel to trace lies outside of the image");
    Specialisation usual = specialisation_;
    usual.workgroup = workgroup_size;
    usual.parameters.clear();
    if (!tracing_)
        tracing_ = std::make_unique<PathTracing>(device_, stages_, scene_, usual, settings_.bounces, precision_);
    std::vector<PathTrace> traces = tracing_->trace(y * settings_.width + x, samples, stage_settings({}, 0));
    instance_.log().raise();
    return traces;
}

Moments VulkanJob::moments_of(const gpu::Vec4& sums) const {
    if (accumulation_ == Accumulation::in_double) {
        const auto pair = std::bit_cast<std::array<double, 2>>(sums);
        return {pair[0], pair[1]};
    }
    return {double{sums.x} + double{sums.y}, double{sums.z} + double{sums.w}};
}

// A tile holds its pixels once for each plane.
void VulkanJob::collect(Tile tile, std::vector<Estimate::Plane>& planes) {
    const gpu::Vec4* sums = resources_.downloaded_sums();
    const std::size_t pixels = tile.pixel_count / planes.size();
    for (std::size_t channel = 0; channel < channel_count; ++channel)
        for (Estimate::Plane& plane : planes) {
            Moments* target = &plane[std::size_t{tile.first_pixel} * channel_count + channel];
            for (std::size_t i = 0; i < pixels; ++i) target[i * channel_count] = moments_of(*sums++);
        }
    if (accumulation_ != Accumulation::plain) return;
    Estimate::Plane& plane = planes.front();
    Estimate::Plane now = plane;
    for (std::size_t i = 0; keeps_sums_ && i < plane.size(); ++i) {
        plane[i].sum -= running_[i].sum;
        plane[i].sum_of_squares -= running_[i].sum_of_squares;
    }
    running_ = std::move(now);
}

RenderResult VulkanJob::render(SampleRange range, const RenderControl& control) {
    listed_ = {};
    return render_film(range, part(), settings_.width, settings_.height, control);
}

RenderResult VulkanJob::render_pixels(
    SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) {
    if (!specialisation_.lists_pixels) return RenderJob::render_pixels(range, pixels, control);
    listed_ = pixels;
    const auto count = static_cast<std::uint32_t>(pixels.size());
    return render_film(range, {0, count}, count, 1, control);
}

// Whole blocks that one tile holds side by side, so that a short list of pixels fills the device: as many as a
// submission may have samples of. Sample numbers differ in their low word alone.
std::uint64_t VulkanJob::blocks_at_once(SampleRange left, std::uint64_t pixels) const {
    if (listed_.empty() || !traces_whole_paths(patterns_.kernel) || accumulation_ == Accumulation::plain) return 1;
    constexpr std::uint64_t low_words = std::uint64_t{1} << 32;
    const std::uint64_t end = std::min(left.end, (left.begin / low_words + 1) * low_words);
    const std::uint64_t room = std::min<std::uint64_t>(tile_pixels_, plan_.batch() / samples_per_block) / pixels;
    return std::max<std::uint64_t>(1, std::min(room, (end - left.begin) / samples_per_block));
}

RenderResult VulkanJob::render_film(
    SampleRange range, Tile all, std::uint32_t width, std::uint32_t height, const RenderControl& control) {
    if (range.begin % samples_per_block != 0 || range.end < range.begin)
        throw Error(fmt::format(
            "a sample range must begin at a multiple of {} and not end before it begins", samples_per_block));
    const auto start = Clock::now();
    RenderResult result{Estimate(width, height), 0.0, std::nullopt};
    Progress progress{control};
    std::uint64_t invalid = 0;
    for (SampleRange block{range.begin, 0}; block.begin < range.end && !control.stop.stop_requested();
         block.begin = block.end) {
        const std::uint64_t blocks = blocks_at_once({block.begin, range.end}, all.pixel_count);
        block.end = std::min(block.begin + samples_per_block, range.end);
        const std::uint32_t end = all.first_pixel + static_cast<std::uint32_t>(blocks) * all.pixel_count;
        keeps_sums_ = std::exchange(summed_to_, nowhere) == block.begin && accumulation_ == Accumulation::plain;
        std::vector<Estimate::Plane> planes(blocks, Estimate::Plane(result.estimate.pixel_count() * channel_count));
        std::uint64_t done = block.count();
        for (std::uint32_t first = all.first_pixel; first < end && done > 0; first += tile_pixels_) {
            const Tile tile{first, std::min(tile_pixels_, end - first)};
            progress.tile_share = static_cast<double>(tile.pixel_count) / all.pixel_count;
            if (!listed_.empty()) add_pixel_list(tile);
            const std::uint64_t done_here = render_tile_block(tile, block, progress);
            progress.samples_before += progress.tile_share * static_cast<double>(done_here);
            const std::uint32_t invalid_now = resources_.downloaded_counters().invalid;
            invalid += invalid_now - std::exchange(invalid_before_, invalid_now);
            collect(tile, planes);
            // With several tiles, only whole blocks exist for every pixel: a stop drops the current one.
            const bool only_tile = tile.pixel_count >= all.pixel_count;
            done = only_tile || done_here == block.count() ? done_here : 0;
        }
        if (done == 0) break;
        summed_to_ = block.begin + done;
        result.estimate.add_block({block.begin, block.begin + done}, std::move(planes.front()));
        result.estimate.add_invalid(std::exchange(invalid, 0));
        if (done < block.count()) break;  // of blocks side by side the first alone goes on from what there was
        for (std::size_t k = 1; k < blocks; ++k, block.end += samples_per_block)
            result.estimate.add_block({block.end, block.end + samples_per_block}, std::move(planes[k]));
    }
    if (progress.has_device_clock) result.device_seconds = progress.device_seconds;
    result.seconds = seconds_since(start);
    return result;
}

}  // namespace tandem
