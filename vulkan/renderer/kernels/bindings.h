// Binds the descriptor sets and parameters of a dispatch, as VulkanPatterns choose.
#pragma once

#include <atomic>

#include "vulkan/renderer/kernels/frame_resources.h"

namespace tandem {

class Bindings {
public:
    // What is referred to must outlive it. Throws UnsupportedError where patterns exclude each other.
    Bindings(const Device& device, const PipelineLayout& layout, const FrameResources& resources,
        const VulkanPatterns& patterns = {});

    // For the next dispatch. `plain`: its kernel is told by push constants whatever the pattern. From any thread.
    void bind(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t ray_parity,
        std::uint32_t sum_parity, bool plain = false,
        vk::PipelineBindPoint point = vk::PipelineBindPoint::eCompute) const;
    // Whatever was recorded before has run.
    void begin_submission() { used_ = 0; }

private:
    [[nodiscard]] bool hands_out() const;
    [[nodiscard]] std::uint32_t take() const;
    void make_rays_and_images();
    void make_parameters();
    void bind_sets(const vk::raii::CommandBuffer& commands, std::uint32_t ray_parity, std::uint32_t sum_parity,
        std::uint32_t slot, vk::PipelineBindPoint point) const;
    void rewrite(std::uint32_t slot, std::uint32_t ray_parity, std::uint32_t sum_parity) const;
    void push_rays(const vk::raii::CommandBuffer& commands, std::uint32_t ray_parity) const;
    void tell(const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t slot) const;

    const Device& device_;
    const PipelineLayout& layout_;
    VulkanPatterns patterns_;
    std::array<std::vector<vk::DescriptorBufferInfo>, 2> rays_, images_;  // by parity
    std::optional<DescriptorSets> fixed_;                                 // Scene, Camera
    std::optional<DescriptorSets> moving_;  // Rays and Image: of both parities, or one of each for each dispatch
    std::vector<vk::raii::DescriptorUpdateTemplate> templates_;  // of Rays and Image
    std::optional<BufferGroup> parameters_;
    vk::DeviceSize stride_ = 0;  // of parameters
    vk::DeviceAddress address_ = 0;
    std::optional<DescriptorSets> parameter_sets_;  // a set for each slot, or one
    mutable std::atomic<std::uint32_t> used_ = 0;   // slots that dispatches of this submission have
};

// Specialisation constants for what no dispatch of a job changes (shaders/kernels/specialised_settings.glsl).
[[nodiscard]] std::vector<SpecialisationConstant> fixed_parameters(const gpu::Settings& settings);

}  // namespace tandem
