#include "vulkan/renderer/recorders/stage_recorder.h"

namespace tandem {

StageRecorder::StageRecorder(const RecorderInput& input)
    : kernels_(input.kernels),
      submission_(input.submission),
      fixed_batch_(input.patterns.vulkan.segments_per_submission > 0),
      plan_(input.device.description(), input.segments, input.patterns.vulkan.segments_per_submission) {}

void StageRecorder::begin(const Tile& tile, SampleRange block, bool keeps_sums) {
    tile_ = tile;
    block_ = block;
    plan_.begin(tile.pixel_count, block.count());
    if (!keeps_sums) add_clearing();
}

void StageRecorder::add_portion() {
    add_shares(plan_.next());
    if (counts_rays() && plan_.doubtful_segment() > 0) add_question();
}

void StageRecorder::took(double seconds) {
    plan_.took(seconds);
    if (!counts_rays() || plan_.doubtful_segment() == 0 || kernels_.answered_rays() > 0) return;
    const std::uint64_t sample = block_.begin + plan_.done();
    if (plan_.leave_out_rest_of_run()) add_accumulating(sample);  // with what is submitted next
}

void StageRecorder::add_frame(const Tile& tile, std::uint64_t samples) {
    begin(tile, {0, samples}, false);
    add_rest();
}

void StageRecorder::add_shares(const std::vector<StageShare>& shares) {
    for (const StageShare& share : shares) {
        add_sampling(share);
        if (share.completes && accumulates()) add_accumulating(block_.begin + share.sample);
    }
}

// The clearing stage, of the half of the sums that is not read, at each block. No barrier: nothing reads what was
// written here before the one that ray_gen needs.
void StageRecorder::add_clearing() {
    const bool first = kernels_.scene_is_due();
    const Tile tile = tile_;
    const Dispatch clearing{Stage::pre_process, kernels_.settings(tile, 0), 0, kernels_.turn_sums()};
    submission_.add(recording_key(first ? RecordingKind::first_clearing : RecordingKind::clearing, clearing.sum_parity,
                        tile.first_pixel, preparation_key()),
        [=, this](const vk::raii::CommandBuffer& commands) {
            record_preparation(commands);
            if (first) kernels_.place_scene(commands, clearing.settings, clearing.sum_parity);
            if (tile.follows || kernels_.ordering().orders_all())
                kernels_.ordering().after_dispatches(commands, compute_access);
            kernels_.dispatch(commands, clearing, tile.pixel_count);
        });
}

void StageRecorder::add_sampling(const StageShare& share) {
    const std::uint64_t sample = block_.begin + share.sample;
    gpu::Settings settings = kernels_.settings(tile_, sample);
    settings.first_invocation = share.first_place;
    settings.invocations = share.places;
    const std::uint32_t parity = kernels_.sum_parity();
    submission_.add(recording_key(RecordingKind::sampling, parity + 2 * std::uint64_t{tile_.first_pixel}, sample,
                        share.first_segment + (std::uint64_t{share.end_segment} << 32),
                        share.first_place + (std::uint64_t{share.places} << 32)),
        [=, this](const vk::raii::CommandBuffer& commands) { record_sampling(commands, settings, parity, share); });
}

// Segment k reads half k mod 2 of the ray state and writes the other; ray_gen writes half 0, as if it were segment -1.
void StageRecorder::record_sampling(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings,
    std::uint32_t sum_parity, const StageShare& share) const {
    const bool intersects = kernels_.has(Stage::intersect);
    if (share.first_segment == 0) {
        // The run before may still be read; and the sample before, where no stage comes between.
        if (share.first_place > 0 || !accumulates() || kernels_.ordering().orders_all())
            kernels_.ordering().after_dispatches(commands, compute_access);
        kernels_.dispatch(commands, {Stage::ray_gen, settings, 1, sum_parity}, share.places);
    }
    Dispatch dispatch{Stage::intersect, settings, 0, sum_parity};
    for (std::uint32_t segment = share.first_segment; segment < share.end_segment; ++segment) {
        dispatch.settings.segment = segment;
        dispatch.ray_parity = segment % 2;
        order_segment(commands);
        if (intersects) {
            dispatch.stage = Stage::intersect;
            record_segment(commands, dispatch, share.places);
            kernels_.ordering().after_dispatches(commands, compute_access);
        }
        dispatch.stage = Stage::scatter;
        record_segment(commands, dispatch, share.places);
    }
}

// How many rays are left for the run's next segment.
void StageRecorder::add_question() {
    const std::uint32_t segment = plan_.doubtful_segment();
    submission_.add(recording_key(RecordingKind::asking, segment),
        [=, this](const vk::raii::CommandBuffer& commands) { kernels_.ask_for_rays(commands, segment); });
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
