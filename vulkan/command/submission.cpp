#include "vulkan/command/submission.h"

#include "common/error.h"

namespace tandem {

namespace {

vk::raii::QueryPool make_stamps(const Device& device) {
    if (device.description().abilities.timestamp_bits == 0) return nullptr;
    return vk::raii::QueryPool(device.handle(), vk::QueryPoolCreateInfo({}, vk::QueryType::eTimestamp, 2));
}

}  // namespace

Submission::Submission(const Device& device)
    : device_(device),
      pool_(
          device.handle(), vk::CommandPoolCreateInfo(vk::CommandPoolCreateFlagBits::eTransient, device.queue_family())),
      fence_(device.handle(), vk::FenceCreateInfo()),
      stamps_(make_stamps(device)) {}

void Submission::begin() {
    pool_.reset();
    used_ = 0;
}

const vk::raii::CommandBuffer& Submission::next_command_buffer() {
    if (used_ > 0) buffers_[used_ - 1].end();
    if (used_ == buffers_.size()) {
        vk::raii::CommandBuffers more(
            device_.handle(), vk::CommandBufferAllocateInfo(*pool_, vk::CommandBufferLevel::ePrimary, 16));
        for (vk::raii::CommandBuffer& buffer : more) buffers_.push_back(std::move(buffer));
    }
    const vk::raii::CommandBuffer& commands = buffers_[used_++];
    commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    if (used_ == 1 && *stamps_) {
        commands.resetQueryPool(*stamps_, 0, 2);
        commands.writeTimestamp(vk::PipelineStageFlagBits::eTopOfPipe, *stamps_, 0);
    }
    return commands;
}

std::optional<double> Submission::run() {
    if (used_ == 0) return std::nullopt;
    if (*stamps_) buffers_[used_ - 1].writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *stamps_, 1);
    buffers_[used_ - 1].end();
    std::vector<vk::CommandBuffer> handles;
    for (std::size_t i = 0; i < used_; ++i) handles.push_back(*buffers_[i]);
    device_.queue().submit(vk::SubmitInfo({}, {}, handles), *fence_);
    while (device_.handle().waitForFences(*fence_, true, UINT64_MAX) == vk::Result::eTimeout) {
    }
    device_.handle().resetFences(*fence_);
    if (!*stamps_) return std::nullopt;
    const auto [result, stamps] = stamps_.getResults<std::uint64_t>(0, 2, 2 * sizeof(std::uint64_t),
        sizeof(std::uint64_t), vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
    if (result != vk::Result::eSuccess) return std::nullopt;
    const std::uint32_t bits = device_.description().abilities.timestamp_bits;
    const std::uint64_t mask = bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    const std::uint64_t ticks = (stamps[1] - stamps[0]) & mask;  // right across one wrap of the counter
    return static_cast<double>(ticks) * static_cast<double>(device_.limits().timestampPeriod) * 1e-9;
}

}  // namespace tandem
