#include "vulkan/renderer/recorders/stage_recorder.h"

#include <algorithm>
#include <limits>

#include "vulkan/renderer/kernels/megakernel_plan.h"

namespace tandem {

StageRecorder::StageRecorder(const RecorderInput& input)
    : kernels_(input.kernels),
      submission_(input.submission),
      segments_(input.segments),
      fixed_batch_(input.patterns.vulkan.segments_per_submission > 0),
      batch_(std::max(1u, input.patterns.vulkan.segments_per_submission)) {}

void StageRecorder::begin(const Tile& tile, SampleRange block, bool keeps_sums) {
    tile_ = tile;
    block_ = block;
    done_ = 0;
    segment_ = 0;
    if (!keeps_sums) add_clearing();
}

void StageRecorder::add_portion() { last_ = add_segments(batch_); }

void StageRecorder::took(double seconds) {
    if (fixed_batch_) return;
    const std::uint64_t most = samples_per_block * std::uint64_t{segments_};
    if (seconds < shortest_submission) batch_ = std::clamp<std::uint64_t>(2 * last_, batch_, most);
    if (seconds > longest_submission)
        batch_ = std::max<std::uint64_t>(
            1, static_cast<std::uint64_t>(static_cast<double>(last_) * shortest_submission / seconds));
}

void StageRecorder::add_frame(const Tile& tile, std::uint64_t samples) {
    begin(tile, {0, samples}, false);
    (void)add_segments(std::numeric_limits<std::uint64_t>::max());
}

// Returns how many of them it added.
std::uint64_t StageRecorder::add_segments(std::uint64_t most) {
    std::uint64_t added = 0;
    while (added < most && done_ < block_.count()) {
        const auto end = static_cast<std::uint32_t>(std::min<std::uint64_t>(segments_, segment_ + (most - added)));
        add_sampling(block_.begin + done_, segment_, end);
        added += end - segment_;
        segment_ = end;
        if (segment_ < segments_) break;
        add_accumulating(block_.begin + done_);
        segment_ = 0;
        ++done_;
    }
    return added;
}

// The clearing stage, of the half of the sums that is not read, at each block. No barrier: nothing reads what was
// written here before the one that ray_gen needs.
void StageRecorder::add_clearing() {
    const bool first = kernels_.scene_is_due();
    const Tile tile = tile_;
    const Dispatch clearing{Stage::pre_process, kernels_.settings(tile, 0), 0, kernels_.turn_sums()};
    submission_.add(recording_key(first ? RecordingKind::first_clearing : RecordingKind::clearing, clearing.sum_parity,
                        tile.first_pixel),
        [=, this](const vk::raii::CommandBuffer& commands) {
            if (first) kernels_.place_scene(commands, clearing.settings, clearing.sum_parity);
            if (tile.follows) kernels_.ordering().after_dispatches(commands, compute_access);
            kernels_.dispatch(commands, clearing, tile.pixel_count);
        });
}

void StageRecorder::add_sampling(std::uint64_t sample, std::uint32_t first_segment, std::uint32_t end_segment) {
    const gpu::Settings settings = kernels_.settings(tile_, sample);
    const std::uint32_t parity = kernels_.sum_parity();
    submission_.add(recording_key(RecordingKind::sampling, parity + 2 * std::uint64_t{tile_.first_pixel}, sample,
                        first_segment + (std::uint64_t{end_segment} << 32)),
        [=, this](const vk::raii::CommandBuffer& commands) {
            record_sampling(commands, settings, parity, first_segment, end_segment);
        });
}

// Segment k reads half k mod 2 of the ray state and writes the other; ray_gen writes half 0, as if it were segment -1.
void StageRecorder::record_sampling(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings,
    std::uint32_t sum_parity, std::uint32_t first_segment, std::uint32_t end_segment) const {
    const std::uint32_t places = settings.pixel_count;
    const bool intersects = kernels_.has(Stage::intersect);
    if (first_segment == 0) kernels_.dispatch(commands, {Stage::ray_gen, settings, 1, sum_parity}, places);
    Dispatch dispatch{Stage::intersect, settings, 0, sum_parity};
    for (std::uint32_t segment = first_segment; segment < end_segment; ++segment) {
        dispatch.settings.segment = segment;
        dispatch.ray_parity = segment % 2;
        order_segment(commands);
        if (intersects) {
            dispatch.stage = Stage::intersect;
            record_segment(commands, dispatch, places);
            kernels_.ordering().after_dispatches(commands, compute_access);
        }
        dispatch.stage = Stage::scatter;
        record_segment(commands, dispatch, places);
    }
}

void StageRecorder::add_accumulating(std::uint64_t sample) {
    const Dispatch dispatch{Stage::post_process, kernels_.settings(tile_, 0), 0, kernels_.turn_sums()};
    // With the sample in its key, no command buffer is twice in one submission.
    submission_.add(recording_key(RecordingKind::accumulating, dispatch.sum_parity, tile_.first_pixel, sample),
        [=, this](const vk::raii::CommandBuffer& commands) {
            kernels_.ordering().after_dispatches(commands, compute_access);
            kernels_.dispatch(commands, dispatch, dispatch.settings.pixel_count);
        });
}

}  // namespace tandem
