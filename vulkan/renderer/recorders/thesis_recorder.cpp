#include "vulkan/renderer/recorders/thesis_recorder.h"

#include "common/error.h"

namespace tandem {

namespace {

// Images that frames end in, where each has a descriptor set of its own.
constexpr std::uint32_t most_targets = 16;

DeviceImage make_image(const RecorderInput& input) {
    return {input.device, {.size = {input.settings.width, input.settings.height},
                              .usage = vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eTransferSrc}};
}

vk::raii::DescriptorPool make_pool(const Device& device) {
    const vk::DescriptorPoolSize size(vk::DescriptorType::eStorageImage, most_targets);
    return {device.handle(), vk::DescriptorPoolCreateInfo({}, most_targets, size)};
}

std::uint32_t image_set(const RecorderInput& input) {
    return KernelForm(input.patterns.vulkan, KernelShape::thesis).image_target_set();
}

// No commands before that are still under way use the recorder's own image: a frame is waited for.
constexpr ImageUse own_before{vk::PipelineStageFlagBits::eTopOfPipe, {}, vk::ImageLayout::eUndefined};

}  // namespace

ThesisRecorder::ThesisRecorder(const RecorderInput& input)
    : ImageStagesRecorder(input),
      device_(input.device),
      pre_recorded_(input.patterns.vulkan.recording == RecordingPattern::pre_recorded),
      pixels_(std::uint64_t{input.settings.width} * input.settings.height),
      image_(make_image(input)),
      target_{image_.handle(), image_.view(), own_before, copied_from, {}, {}},
      set_layout_(input.kernels.layout().set(image_set(input))),
      set_index_(image_set(input)),
      pool_(make_pool(input.device)) {}

// Commands that were recorded before refer to their set as it was: with those each image has its own.
vk::DescriptorSet ThesisRecorder::descriptors() {
    const vk::ImageView key = pre_recorded_ ? target_.view : vk::ImageView();
    const auto [place, made] = sets_.try_emplace(key);
    if (made) {
        if (sets_.size() > most_targets) throw Error("frames end in more images than there are descriptor sets for");
        const vk::Device device = *device_.handle();
        place->second = device
                            .allocateDescriptorSets(
                                vk::DescriptorSetAllocateInfo(*pool_, set_layout_), *device_.handle().getDispatcher())
                            .front();
    }
    if (made || !pre_recorded_) {
        const vk::DescriptorImageInfo image({}, target_.view, vk::ImageLayout::eGeneral);
        device_.handle().updateDescriptorSets(
            vk::WriteDescriptorSet(place->second, 0, 0, vk::DescriptorType::eStorageImage, image), {});
    }
    return place->second;
}

std::uint64_t ThesisRecorder::preparation_key() const {
    return in_frame_ ? reinterpret_cast<std::uintptr_t>(static_cast<VkImageView>(target_.view)) : 0;
}

void ThesisRecorder::record_preparation(const vk::raii::CommandBuffer& commands) const {
    if (in_frame_) transition(commands, target_.image, target_.before, written_by_compute);
}

void ThesisRecorder::begin(const Tile& tile, SampleRange block, bool keeps_sums) {
    in_frame_ = false;
    shown_ = 0;
    ImageStagesRecorder::begin(tile, block, keeps_sums);
}

void ThesisRecorder::add_frame(const Tile& tile, std::uint64_t samples) {
    if (tile.follows || tile.pixel_count != pixels_)
        throw UnsupportedError("the thesis's frame is the whole image at once, neither a part nor tiles of it");
    if (pre_recorded_ || !kernels().scene_placed()) shown_ = 0;
    in_frame_ = true;
    const bool goes_on = shown_ > 0;
    if (goes_on)  // with nothing but the transition
        submission().add(recording_key(RecordingKind::showing, 0, 0, preparation_key()),
            [this](const vk::raii::CommandBuffer& commands) { record_preparation(commands); });
    ImageStagesRecorder::begin(tile, {shown_, shown_ + samples}, goes_on);
    add_rest();
    shown_ += samples;
    add_post_processing(tile);
    if (target_.acquired) submission().wait_for(target_.acquired, target_.before.stage);
    if (target_.rendered) submission().signal(target_.rendered);
}

void ThesisRecorder::add_post_processing(const Tile& tile) {
    Dispatch dispatch{Stage::post_process, kernels().settings(tile, 0), 0, kernels().sum_parity()};
    dispatch.settings.sample_count = static_cast<std::uint32_t>(shown_);
    const vk::DescriptorSet set = descriptors();
    submission().add(recording_key(RecordingKind::showing, dispatch.sum_parity, shown_, preparation_key()),
        [=, this, target = target_](const vk::raii::CommandBuffer& commands) {
            kernels().ordering().after_dispatches(commands, compute_access);
            commands.bindDescriptorSets(
                vk::PipelineBindPoint::eCompute, kernels().layout().handle(), set_index_, set, {});
            kernels().dispatch(commands, dispatch, tile.pixel_count);
            transition(commands, target.image, written_by_compute, target.after);
        });
}

}  // namespace tandem
