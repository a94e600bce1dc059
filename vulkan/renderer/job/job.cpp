#include "vulkan/renderer/job/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "common/error.h"
#include "common/stopwatch.h"
#include "vulkan/framework/spirv_optimizer.h"
#include "vulkan/renderer/job/job_settings.h"
#include "vulkan/renderer/kernels/kernel_shape.h"
#include "vulkan/renderer/kernels/megakernel_plan.h"

namespace tandem {

namespace {

// Whether kernels find hits by loops and trees; beside the device's traversal those of rays that begin far off in fog.
bool walks_itself(KernelShape shape, const Scene& scene, const RenderSettings& settings) {
    return !brings_trees(shape) || needed_effects(scene, settings).has(Effect::medium_scattering);
}

}  // namespace

struct VulkanJob::Progress {
    const RenderControl& control;
    double samples_before = 0.0;  // of whole blocks, and of earlier tiles of this one as fractions
    double tile_share = 1.0;
    double device_seconds = 0.0;
    bool has_device_clock = true;
    bool keeps_sums = false;                 // the block goes on with the sums of the one before
    std::uint64_t begun = 0;                 // samples of the block, in control.begun
    std::uint64_t invalid = 0;               // samples that the estimate does not count yet
    std::function<void()> uncollected = {};  // takes in what was downloaded last

    void collect() {
        if (uncollected) std::exchange(uncollected, nullptr)();
    }
    void report(double samples_of_tile) const {
        if (control.progress) control.progress(samples_before + tile_share * samples_of_tile);
    }
};

VulkanJob::VulkanJob(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
    const RenderSettings& settings, Acceleration acceleration, PlantedFault planted_bug, const JobPatterns& patterns,
    GeometryPrecision precision)
    : instance_(instance),
      device_(device),
      patterns_(patterns),
      precision_(precision),
      settings_(checked_settings(device, scene, settings, precision, patterns.tracer.kernel)),
      scene_(flatten_for(scene, settings_,
          walks_itself(patterns.tracer.kernel, scene, settings_) ? acceleration : Acceleration::loops, precision)),
      specialisation_(with_patterns(specialise(device, scene, scene_, settings_, planted_bug), device, patterns,
          told_settings(settings_, scene_))),
      segments_(most_segments(specialisation_.effects, settings_)),
      kept_(traces_whole_paths(patterns.tracer.kernel) ? std::nullopt : std::optional(specialisation_.path)),
      accumulation_(*settings_.accumulation),
      stages_(stages),
      pipelines_(stages.pipelines(specialisation_, form())),
      tile_pixels_(std::min(tile_size(device, part().pixel_count, kept_),
          patterns.tracer.tile_pixels > 0 ? patterns.tracer.tile_pixels : std::numeric_limits<std::uint32_t>::max())),
      resources_(device, scene_, kept_, settings_.bounces, tile_pixels_, patterns.vulkan.memory,
          specialisation_.lists_pixels, {patterns.vulkan.scene, patterns.vulkan.rays}),
      kernels_(device, stages.layout(form()), *pipelines_, resources_, scene_, told_settings(settings_, scene_),
          specialisation_.workgroup, patterns.vulkan),
      submission_(device, patterns.vulkan),
      recorder_(make_recorder(
          {device, stages, scene, scene_, settings_, specialisation_, patterns_, segments_, kernels_, submission_})) {
    if (patterns_.tracer.parts == 0 || patterns_.tracer.part >= patterns_.tracer.parts || part().pixel_count == 0)
        throw UnsupportedError("the image has too few pixels for so many parts");
    if (traces_whole_paths(patterns_.tracer.kernel) && !fits_whole_paths(settings_))
        throw UnsupportedError(fmt::format(
            "kernels that follow whole paths cannot stop within one: {} bounces may take longer than 2 s; use {} "
            "or at most {} bounces",
            settings_.bounces,
            precision_ == GeometryPrecision::single_precision ? "--kernel stages" : "--precision single",
            most_whole_path_segments - 1));
    if (accumulation_ == Accumulation::plain && tile_pixels_ < part().pixel_count)
        throw UnsupportedError(
            "plain sums go on from block to block on the device, where this image does not fit at once. Choose a "
            "smaller --size or --accumulation compensated");
    if (specialisation_.lists_pixels && patterns_.vulkan.recording == RecordingPattern::pre_recorded)
        throw UnsupportedError("passes of adaptive sampling differ, so that their commands cannot be pre-recorded");
    instance_.log().raise();
}

// A tile holds them once for each block.
void VulkanJob::add_pixel_list(Tile& tile, std::span<const std::uint32_t> listed) {
    const auto left = static_cast<std::uint32_t>(listed.size()) - tile.first_pixel;
    const std::uint32_t count = tile.listed = std::min(tile.pixel_count, left);
    resources_.set_pixel_list(listed.subspan(tile.first_pixel, count));
    submission_.add(recording_key(RecordingKind::listing, tile.first_pixel, count),
        [=, this](const vk::raii::CommandBuffer& commands) { resources_.record_pixel_list(commands, count); });
}

JobFacts VulkanJob::facts() const {
    JobFacts facts;
    facts.effects = specialisation_.effects;
    const std::vector<SpecialisationConstant> constants = specialisation_.constants();
    facts.compiled = facts.effects;
    for (const Stage stage : kernels_of(patterns_.tracer.kernel, facts.effects)) {
        if (stage == Stage::vertex && scene_.in_double) continue;
        const std::string name = stage_names[static_cast<std::size_t>(stage)];
        const std::vector<std::uint32_t> code =
            optimised_spirv(stages_.prepared(kernel_code(stage, form()).words), constants);
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
    facts.hierarchy_seconds = scene_.trees.seconds;
    return facts;
}

// Apart from the kernels, so that the device's clock counts those alone.
void VulkanJob::download(const Tile& tile) {
    const std::uint32_t parity = kernels_.sum_parity(), pixels = tile.pixel_count;
    submission_.add(recording_key(RecordingKind::downloading, parity, pixels),
        [=, this](const vk::raii::CommandBuffer& commands) { resources_.record_download(commands, parity, pixels); });
    (void)submit();
    instance_.log().raise();
    if (resources_.downloaded_counters().unfinished > 0)
        throw UnsupportedError(
            "the driver left the megakernel's loops before its paths had ended; use --kernel stages or fewer bounces");
}

// The host takes in the block before while the device renders, which may take the longer of the two. So the device's
// clock tells how long it rendered. Without one the host is done before.
double VulkanJob::run(Progress& progress) {
    if (!progress.has_device_clock) progress.collect();
    const Stopwatch watch;
    const bool collects = progress.uncollected != nullptr;
    submit_frame();
    try {
        progress.collect();
    } catch (...) {
        (void)submission_.finish();
        throw;
    }
    const std::optional<double> device_seconds = submission_.finish().device;
    progress.device_seconds += device_seconds.value_or(0.0);
    progress.has_device_clock = progress.has_device_clock && device_seconds.has_value();
    instance_.log().raise();
    return collects && device_seconds ? *device_seconds : watch.seconds();
}

// The device's running count of invalid samples.
std::uint32_t VulkanJob::count_invalid() {
    submission_.add(recording_key(RecordingKind::counting, 0),
        [this](const vk::raii::CommandBuffer& commands) { resources_.record_counters(commands); });
    (void)submit();
    instance_.log().raise();
    return resources_.downloaded_counters().invalid;
}

// Renders samples of one block for one tile and leaves the sums downloaded; returns how many it did before a stop.
// After a stop nothing is added: pre-recorded commands may be in one submission once alone.
std::uint64_t VulkanJob::render_tile_block(const Tile& tile, SampleRange block, Progress& progress, Sums sums) {
    if (progress.control.stop.stop_requested()) return 0;
    if (sums == Sums::restored) add_sums(tile);
    recorder_->begin(tile, block, sums != Sums::cleared);
    std::optional<std::uint32_t> before_parts;  // invalid samples, while parts of a sample are counted
    for (bool begun = false; recorder_->done() < block.count(); begun = true) {
        const bool between_samples = recorder_->drops_parts() || recorder_->done_of_next() == 0.0;
        // What was begun of a sample is dropped.
        if (begun && between_samples && progress.control.stop.stop_requested()) break;
        if (recorder_->counts_part_of_next()) before_parts = begun ? count_invalid() : invalid_before_;
        recorder_->add_portion();
        recorder_->took(run(progress));
        if (recorder_->done_of_next() == 0.0) before_parts.reset();
        progress.report(static_cast<double>(recorder_->done()) + recorder_->done_of_next());
    }
    const std::uint64_t done = recorder_->done();
    if (done > 0)
        download(tile);
    else if (before_parts)
        (void)count_invalid();
    else
        return 0;  // nothing to fetch
    const std::uint32_t invalid = resources_.downloaded_counters().invalid;
    progress.invalid += before_parts.value_or(invalid) - std::exchange(invalid_before_, invalid);
    return done;
}

// What FrameResources::sums_to_copy() holds, in the half that is read next.
void VulkanJob::add_sums(const Tile& tile) {
    const std::uint32_t parity = kernels_.sum_parity(), pixels = tile.pixel_count;
    submission_.add(recording_key(RecordingKind::restoring, parity, pixels),
        [=, this](const vk::raii::CommandBuffer& commands) { resources_.record_sums(commands, parity, pixels); });
}

std::vector<PathTrace> VulkanJob::trace(std::uint32_t x, std::uint32_t y, SampleRange samples) {
    return trace_with({}, x, y, samples);
}

std::vector<PathTrace> VulkanJob::trace_with(
    ChangedNumber changed, std::uint32_t x, std::uint32_t y, SampleRange samples) {
    if (x >= settings_.width || y >= settings_.height) throw Error("the pixel to trace lies outside of the image");
    gpu::Settings settings = told_settings(settings_, scene_);
    settings.changed_block = changed.block;
    settings.changed_number = changed.number | changed.bit << 2;
    std::vector<PathTrace> traces = tracing().trace(y * settings_.width + x, samples, settings);
    instance_.log().raise();
    return traces;
}

bool VulkanJob::first_vertices(
    FilmSize, SampleRange samples, const RenderControl& control, const FirstVertexVisitor& visit) {
    const bool complete = tracing().first_vertices(samples, told_settings(settings_, scene_), control, visit);
    instance_.log().raise();
    return complete;
}

PathTracing& VulkanJob::tracing() {
    Specialisation usual = specialisation_;
    usual.workgroup = workgroup_size;
    usual.parameters.clear();
    if (!tracing_)
        tracing_ = std::make_unique<PathTracing>(device_, stages_, scene_, usual, settings_.bounces, precision_);
    return *tracing_;
}

Moments VulkanJob::moments_of(const gpu::Vec4& sums) const {
    if (accumulation_ == Accumulation::in_double) {
        const auto pair = std::bit_cast<std::array<double, 2>>(sums);
        return {pair[0], pair[1]};
    }
    return {double{sums.x} + double{sums.y}, double{sums.z} + double{sums.w}};
}

// Adds what was downloaded to `planes`. A tile holds its pixels once for each of them.
void VulkanJob::collect(const Tile& tile, std::vector<Estimate::Plane>& planes) const {
    const gpu::Vec4* sums = resources_.downloaded_sums();
    const std::size_t pixels = tile.pixel_count / planes.size();
    for (Estimate::Plane& plane : planes) {
        Moments* target = &plane[std::size_t{tile.first_pixel} * channel_count];
        for (std::size_t i = 0; i < pixels; ++i, ++sums)
            for (std::size_t channel = 0; channel < channel_count; ++channel)
                *target++ = moments_of(sums[channel * tile.pixel_count]);
    }
}

// The reverse for sums in double, which `plane` holds exactly.
void VulkanJob::copy_sums(const Tile& tile, const Estimate::Plane& plane, gpu::Vec4* sums) const {
    const Moments* source = &plane[std::size_t{tile.first_pixel} * channel_count];
    for (std::size_t i = 0; i < tile.pixel_count; ++i, ++sums)
        for (std::size_t channel = 0; channel < channel_count; ++channel, ++source)
            sums[channel * tile.pixel_count] =
                std::bit_cast<gpu::Vec4>(std::array{source->sum, source->sum_of_squares});
}

RenderResult VulkanJob::render(SampleRange range, const RenderControl& control) {
    return render_film(range, {part(), settings_.width, settings_.height}, control);
}

RenderResult VulkanJob::render_pixels(
    SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) {
    if (!specialisation_.lists_pixels) return RenderJob::render_pixels(range, pixels, control);
    const auto count = static_cast<std::uint32_t>(pixels.size());
    return render_film(range, {{0, count}, count, 1, pixels}, control);
}

// Whole blocks that one tile holds side by side, so that a short list of pixels fills the device. They are as many as a
// submission may have samples of. Sample numbers differ in their low word alone.
std::uint64_t VulkanJob::blocks_at_once(SampleRange left, const Film& film) const {
    if (film.listed.empty() || accumulation_ == Accumulation::plain) return 1;
    constexpr std::uint64_t low_words = std::uint64_t{1} << 32;
    const std::uint64_t end = std::min(left.end, (left.begin / low_words + 1) * low_words);
    const std::uint64_t most = recorder_->side_by_side() / samples_per_block;
    const std::uint64_t room = std::min<std::uint64_t>(tile_pixels_, most) / film.all.pixel_count;
    return std::max<std::uint64_t>(1, std::min(room, (end - left.begin) / samples_per_block));
}

// The pixels of a film from `first` to `end`, as many as fit.
Tile VulkanJob::begin_tile(const Film& film, std::uint32_t first, std::uint32_t end, Progress& progress) {
    Tile tile{first, std::min(tile_pixels_, end - first), 0, first > film.all.first_pixel};
    progress.tile_share = static_cast<double>(tile.pixel_count) / film.all.pixel_count;
    if (!film.listed.empty()) add_pixel_list(tile, film.listed);
    return tile;
}

// Renders a block of a film that one tile holds, or `blocks` of them side by side. Returns how many samples of a block
// every pixel has; none where a stop came before there were more than those begun. Their sums stay in
// progress.uncollected.
std::uint64_t VulkanJob::render_at_once(
    SampleRange block, std::uint64_t blocks, const Film& film, Progress& progress, Estimate& estimate) {
    const auto places = static_cast<std::uint32_t>(blocks * film.all.pixel_count);
    const Tile tile = begin_tile(film, film.all.first_pixel, film.all.first_pixel + places, progress);
    const bool went_on = progress.keeps_sums;
    Estimate* const before = progress.control.begun;
    const std::uint64_t begun = std::exchange(progress.begun, 0);
    if (begun > 0) {
        copy_sums(tile, before->ragged_moments(block.begin), resources_.sums_to_copy());
        progress.samples_before += static_cast<double>(begun);
    }
    const Sums sums = begun > 0 ? Sums::restored : went_on ? Sums::kept : Sums::cleared;
    std::uint64_t done = render_tile_block(tile, {block.begin + begun, block.end}, progress, sums);
    progress.samples_before += progress.tile_share * static_cast<double>(done);
    if (done == 0) return 0;
    done += begun;
    // After a stop the first alone counts, so that no samples are missing before others.
    const std::uint64_t whole = done < block.count() ? 1 : blocks;
    progress.uncollected = [=, this, &estimate] {
        std::vector<Estimate::Plane> planes(blocks);
        if (begun > 0) planes.front() = before->take_ragged_moments(block.begin);  // room that need not be made anew
        for (Estimate::Plane& plane : planes) plane.resize(estimate.pixel_count() * channel_count);
        collect(tile, planes);
        if (accumulation_ == Accumulation::plain) running_sums_.leave_growth(planes.front(), went_on);
        for (std::uint64_t k = 0; k < whole; ++k) {
            const std::uint64_t begin = block.begin + k * samples_per_block;
            estimate.add_block({begin, begin + done}, std::move(planes[k]));
        }
    };
    return done;
}

// Renders samples for all tiles of a film, which go on from `sums` and leave theirs there; returns whether all did.
bool VulkanJob::render_tiles(SampleRange samples, const Film& film, Progress& progress,
    std::vector<Estimate::Plane>& planes, std::vector<gpu::Vec4>& sums) {
    const std::uint32_t end = film.all.first_pixel + film.all.pixel_count;
    for (std::uint32_t first = film.all.first_pixel; first < end; first += tile_pixels_) {
        const Tile tile = begin_tile(film, first, end, progress);
        gpu::Vec4* const own = sums.data() + sums_per_pixel * std::size_t{first - film.all.first_pixel};
        const bool goes_on = samples.begin % samples_per_block != 0;
        if (goes_on) std::copy_n(own, sums_per_pixel * tile.pixel_count, resources_.sums_to_copy());
        const std::uint64_t done = render_tile_block(tile, samples, progress, goes_on ? Sums::restored : Sums::cleared);
        progress.samples_before += progress.tile_share * static_cast<double>(done);
        if (done < samples.count()) return false;
        collect(tile, planes);
        std::copy_n(resources_.downloaded_sums(), sums_per_pixel * tile.pixel_count, own);
    }
    return true;
}

// Samples of a block that every pixel has. Tiles that share buffers take turns in passes, each as long as all before
// it: a stop costs half of the block's work at most.
std::uint64_t VulkanJob::render_in_passes(SampleRange block, const Film& film, Progress& progress, Estimate& estimate) {
    std::vector<gpu::Vec4> sums(sums_per_pixel * std::size_t{film.all.pixel_count});
    std::vector<Estimate::Plane> planes(1, Estimate::Plane(estimate.pixel_count() * channel_count));
    const std::uint64_t begun = std::exchange(progress.begun, 0);
    if (begun > 0) {
        planes.front() = progress.control.begun->ragged_moments(block.begin);
        for (const Tile& tile : tiles())
            copy_sums(tile, planes.front(),
                sums.data() + sums_per_pixel * std::size_t{tile.first_pixel - film.all.first_pixel});
        progress.samples_before += static_cast<double>(begun);
    }
    std::uint64_t done = begun;
    while (done < block.count()) {
        const std::uint64_t count = std::min(std::max<std::uint64_t>(1, done), block.count() - done);
        const SampleRange pass{block.begin + done, block.begin + done + count};
        std::vector<Estimate::Plane> next = planes;
        const std::uint64_t invalid = progress.invalid;
        if (!render_tiles(pass, film, progress, next, sums)) {
            progress.invalid = invalid;  // without those of the tiles that were done
            break;
        }
        planes = std::move(next);
        done += count;
    }
    if (done == begun) return 0;
    if (begun > 0) (void)progress.control.begun->take_ragged_moments(block.begin);
    estimate.add_block({block.begin, block.begin + done}, std::move(planes.front()));
    return done;
}

RenderResult VulkanJob::render_film(SampleRange range, const Film& film, const RenderControl& control) {
    if (range.begin % samples_per_block != 0 || range.end < range.begin)
        throw Error(fmt::format(
            "a sample range must begin at a multiple of {} and not end before it begins", samples_per_block));
    const Stopwatch watch;
    RenderResult result{Estimate(film.width, film.height), 0.0, std::nullopt};
    Progress progress{control};
    if (!std::exchange(knows_invalid_, false)) invalid_before_ = count_invalid();
    std::optional<std::uint64_t> reach;  // up to this sample go the sums on the device; none: they are not gone on with
    for (SampleRange block{range.begin, 0}; block.begin < range.end && !control.stop.stop_requested();
         block.begin = block.end) {
        const std::uint64_t blocks = blocks_at_once({block.begin, range.end}, film);
        block.end = std::min(block.begin + samples_per_block, range.end);
        if (block.begin == range.begin && running_sums_.take(block.begin)) reach = block.begin;
        // The commands that clear a block's sums are those that place the scene.
        if (block.begin == range.begin && film.listed.empty() && goes_on_in_blocks() && kernels_.scene_placed())
            progress.begun = samples_begun(control, block);
        progress.keeps_sums = std::exchange(reach, std::nullopt) && accumulation_ == Accumulation::plain;
        const std::uint64_t done = film.all.pixel_count <= tile_pixels_
                                       ? render_at_once(block, blocks, film, progress, result.estimate)
                                       : render_in_passes(block, film, progress, result.estimate);
        if (done == 0) break;
        reach = block.begin + done;
        result.estimate.add_invalid(std::exchange(progress.invalid, 0));
        if (done < block.count()) break;
        block.end += (blocks - 1) * samples_per_block;
    }
    progress.collect();
    if (reach) running_sums_.reached(*reach);
    knows_invalid_ = true;
    if (progress.has_device_clock) result.device_seconds = progress.device_seconds;
    result.seconds = watch.seconds();
    return result;
}

}  // namespace tandem
