// The thesis's frame [Ferreira 2019]: a recording of pre-processing, one for each sample, and one of post-processing,
// which writes the means to an image. Each stage covers the whole image, and paths add to their pixels' sums as they
// end.
#pragma once

#include <map>

#include "vulkan/renderer/recorders/image_stages_recorder.h"

namespace tandem {

class ThesisRecorder : public ImageStagesRecorder {
public:
    explicit ThesisRecorder(const RecorderInput& input);

    void begin(const Tile& tile, SampleRange block, bool keeps_sums) override;
    // As long as the scene stays, frames go on with the next samples, and the image is of all so far. Pre-recorded
    // commands render the same samples each time, so that each frame begins anew.
    void add_frame(const Tile& tile, std::uint64_t samples) override;
    // Until then frames end in an image of the recorder's own.
    void set_target(const FrameTarget& target) override { target_ = target; }
    [[nodiscard]] bool cuts_frames() const override { return false; }
    [[nodiscard]] bool drops_parts() const override { return false; }

private:
    [[nodiscard]] bool accumulates() const override { return false; }
    void add_post_processing(const Tile& tile);
    void record_preparation(const vk::raii::CommandBuffer& commands) const override;
    [[nodiscard]] std::uint64_t preparation_key() const override;
    [[nodiscard]] vk::DescriptorSet descriptors();

    const Device& device_;
    bool pre_recorded_;
    std::uint64_t pixels_;  // of the whole image
    DeviceImage image_;
    FrameTarget target_;
    bool in_frame_ = false;    // recordings are a frame's; else a render's, which fetches sums
    std::uint64_t shown_ = 0;  // samples that the sums on the device have, if all are of frames
    vk::DescriptorSetLayout set_layout_;
    std::uint32_t set_index_;
    vk::raii::DescriptorPool pool_;
    std::map<vk::ImageView, vk::DescriptorSet> sets_;  // of the images that frames end in; or one, written anew
};

}  // namespace tandem
