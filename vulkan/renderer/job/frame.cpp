// Frames of a job: what a window would show next, in one submission or several, tile after tile, beside other jobs.
#include <algorithm>

#include "common/error.h"
#include "vulkan/renderer/job/job.h"

namespace tandem {

Tile VulkanJob::part() const {
    const std::uint64_t pixels = std::uint64_t{settings_.width} * settings_.height;
    const auto begin =
        static_cast<std::uint32_t>(pixels * patterns_.tracer.part / std::max(1u, patterns_.tracer.parts));
    const auto end =
        static_cast<std::uint32_t>(pixels * (patterns_.tracer.part + 1) / std::max(1u, patterns_.tracer.parts));
    return {begin, end - begin};
}

// What was handed out for earlier submissions is free again.
void VulkanJob::begin_submission() { kernels_.begin_submission(); }

SubmissionTimes VulkanJob::submit() {
    begin_submission();
    return submission_.run();
}

void VulkanJob::begin_frame(bool fresh) {
    if (patterns_.tracer.tile_pixels == 0 && part().pixel_count > tile_pixels_)
        throw UnsupportedError("the image does not fit on the device at once; ask for a smaller one");
    running_sums_.forget();
    if (!fresh) return;
    kernels_.forget_scene();
    invalid_before_ = 0;
}

std::vector<Tile> VulkanJob::tiles() const {
    const Tile all = part();
    std::vector<Tile> list;
    for (std::uint32_t done = 0; done < all.pixel_count; done += list.back().pixel_count)
        list.push_back({all.first_pixel + done, std::min(tile_pixels_, all.pixel_count - done), 0, done > 0});
    return list;
}

SubmissionTimes VulkanJob::frame(std::uint64_t samples, bool fresh) {
    if (!recorder_->cuts_frames()) {
        start_frame(samples, fresh);
        return finish_frame();
    }
    begin_frame(fresh);
    if (tiles().size() > 1) throw UnsupportedError("tiles are for frames in one submission");
    SubmissionTimes times;
    recorder_->begin(part(), {0, samples}, false);
    while (recorder_->done() < samples) {
        recorder_->add_portion();
        times.add(submit());
    }
    instance_.log().raise();
    return times;
}

void VulkanJob::add_frame(std::uint64_t samples, bool fresh) {
    begin_frame(fresh);
    for (const Tile& tile : tiles()) recorder_->add_frame(tile, samples);
}

void VulkanJob::submit_frame() {
    begin_submission();
    submission_.start();
}

void VulkanJob::start_frame(std::uint64_t samples, bool fresh) {
    add_frame(samples, fresh);
    submit_frame();
}

vk::DescriptorBufferInfo VulkanJob::sums(std::uint32_t place) const {
    return resources_.buffers(SetIndex::image, place).front();
}

SubmissionTimes VulkanJob::finish_frame() {
    const SubmissionTimes times = submission_.finish();
    instance_.log().raise();
    return times;
}

}  // namespace tandem
