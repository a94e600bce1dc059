#include "vulkan/renderer/recorders/whole_path_recorder.h"

#include <algorithm>

namespace tandem {

WholePathRecorder::WholePathRecorder(const RecorderInput& input, Stage stage)
    : kernels_(input.kernels),
      submission_(input.submission),
      stage_(stage),
      plan_(input.device.description(), input.segments) {}

void WholePathRecorder::begin(const Tile& tile, SampleRange block, bool keeps_sums) {
    tile_ = tile;
    block_begin_ = block.begin;
    keeps_sums_ = keeps_sums;
    plan_.begin(tile.pixel_count, block.count());
}

void WholePathRecorder::add_portion() { add_share(tile_, block_begin_, plan_.next(), keeps_sums_); }

void WholePathRecorder::add_frame(const Tile& tile, std::uint64_t samples) {
    for (SampleRange block{0, 0}; block.begin < samples; block.begin = block.end) {
        block.end = std::min(block.begin + samples_per_block, samples);
        add_share(tile, block.begin, {0, block.count(), 0, tile.pixel_count, true}, false);
    }
}

// A block's first share finds no sums and begins them.
void WholePathRecorder::add_share(
    const Tile& tile, std::uint64_t block_begin, const MegakernelShare& share, bool keeps_sums) {
    const bool first = kernels_.scene_is_due();
    const std::uint64_t sample = block_begin + share.first_sample;
    Dispatch dispatch{stage_, kernels_.settings(tile, sample), 0, kernels_.sum_parity()};
    dispatch.settings.sample_count = static_cast<std::uint32_t>(share.samples);
    dispatch.settings.first_invocation = share.first_invocation;
    dispatch.settings.invocations = share.invocations;
    dispatch.settings.keeps_sums = keeps_sums;
    if (share.completes) kernels_.turn_sums();
    submission_.add(recording_key(first ? RecordingKind::first_whole_paths : RecordingKind::whole_paths,
                        dispatch.sum_parity + (keeps_sums ? 2 : 0) + 4 * std::uint64_t{tile.first_pixel}, sample,
                        share.first_invocation + (std::uint64_t{share.samples} << 32), share.invocations),
        [=, this](const vk::raii::CommandBuffer& commands) {
            if (first) kernels_.place_scene(commands, dispatch.settings, dispatch.sum_parity);
            // After the vertex stage, or the share before, whose sums this one may read.
            kernels_.ordering().after_dispatches(commands, compute_access);
            record_paths(commands, dispatch);
        });
}

}  // namespace tandem
