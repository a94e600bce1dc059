// Frames of a job: what a window would show next, in one submission or several, tile after tile, beside other jobs.
#include <algorithm>
#include <limits>

#include "common/error.h"
#include "vulkan/renderer/job/job.h"
#include "vulkan/renderer/kernels/kernel_shape.h"

namespace tandem {

VulkanJob::Tile VulkanJob::part() const {
    const std::uint64_t pixels = std::uint64_t{settings_.width} * settings_.height;
    const auto begin = static_cast<std::uint32_t>(pixels * patterns_.part / std::max(1u, patterns_.parts));
    const auto end = static_cast<std::uint32_t>(pixels * (patterns_.part + 1) / std::max(1u, patterns_.parts));
    return {begin, end - begin};
}

// What was handed out for earlier submissions is free again.
void VulkanJob::begin_submission() {
    bindings_.begin_submission();
    ordering_.begin_submission();
}

SubmissionTimes VulkanJob::submit() {
    begin_submission();
    return submission_.run();
}

void VulkanJob::begin_frame(bool fresh) {
    if (patterns_.tile_pixels == 0 && part().pixel_count > tile_pixels_)
        throw UnsupportedError("the image does not fit on the device at once; ask for a smaller one");
    listed_ = {};
    keeps_sums_ = false;
    summed_to_ = nowhere;
    if (!fresh) return;
    scene_uploaded_ = false;
    invalid_before_ = 0;
}

void VulkanJob::add_whole_paths(Tile tile, std::uint64_t samples) {
    for (SampleRange block{0, 0}; block.begin < samples; block.begin = block.end) {
        block.end = std::min(block.begin + samples_per_block, samples);
        add_megakernel(tile, block.begin, {0, block.count(), 0, tile.pixel_count, true});
    }
}

// Tile after tile, in the same buffers.
std::vector<VulkanJob::Tile> VulkanJob::tiles() const {
    const Tile all = part();
    std::vector<Tile> list;
    for (std::uint32_t done = 0; done < all.pixel_count; done += list.back().pixel_count)
        list.push_back({all.first_pixel + done, std::min(tile_pixels_, all.pixel_count - done)});
    return list;
}

SubmissionTimes VulkanJob::frame(std::uint64_t samples, bool fresh) {
    if (patterns_.segments_per_submission == 0 || traces_whole_paths(patterns_.kernel)) {
        start_frame(samples, fresh);
        return finish_frame();
    }
    begin_frame(fresh);
    if (tiles().size() > 1) throw UnsupportedError("tiles are for frames in one submission");
    SubmissionTimes times;
    std::uint64_t done = 0;
    std::uint32_t segment = 0;
    add_pre_processing(part());
    while (done < samples) {
        (void)add_batch(part(), {0, samples}, patterns_.segments_per_submission, done, segment);
        times.add(submit());
    }
    instance_.log().raise();
    return times;
}

void VulkanJob::start_frame(std::uint64_t samples, bool fresh) {
    begin_frame(fresh);
    for (const Tile tile : tiles()) {
        if (traces_whole_paths(patterns_.kernel)) {
            add_whole_paths(tile, samples);
            continue;
        }
        std::uint64_t done = 0;
        std::uint32_t segment = 0;
        add_pre_processing(tile);
        (void)add_batch(tile, {0, samples}, std::numeric_limits<std::uint64_t>::max(), done, segment);
    }
    begin_submission();
    submission_.start();
}

SubmissionTimes VulkanJob::finish_frame() {
    const SubmissionTimes times = submission_.finish();
    instance_.log().raise();
    return times;
}

}  // namespace tandem
