#include "vulkan/framework/fullscreen.h"

#include "common/error.h"

namespace tandem {

namespace {

vk::raii::RenderPass make_pass(const Device& device) {
    const std::string& name = device.description().name;
    if (!device.features().fragment_stores)
        throw UnsupportedError(name + " lets no fragments write to buffers (fragmentStoresAndAtomics)");
    const auto families = device.physical().getQueueFamilyProperties();
    if (!(families[device.queue_family()].queueFlags & vk::QueueFlagBits::eGraphics))
        throw UnsupportedError(name + " has no graphics on the queue that renders");
    const vk::SubpassDescription subpass({}, vk::PipelineBindPoint::eGraphics);
    return vk::raii::RenderPass(device.handle(), vk::RenderPassCreateInfo({}, {}, subpass));
}

vk::raii::ShaderModule make_module(const Device& device, std::span<const std::uint32_t> code) {
    return vk::raii::ShaderModule(device.handle(), vk::ShaderModuleCreateInfo({}, code.size_bytes(), code.data()));
}

}  // namespace

FullscreenPass::FullscreenPass(const Device& device) : device_(device), pass_(make_pass(device)) {}

vk::raii::Pipeline make_fullscreen_pipeline(const Device& device, vk::PipelineLayout layout,
    const FullscreenPlace& place, std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> fragment,
    std::span<const SpecialisationConstant> constants) {
    const vk::raii::ShaderModule vertex_module = make_module(device, vertex);
    const vk::raii::ShaderModule fragment_module = make_module(device, fragment);
    const std::vector<vk::SpecializationMapEntry> entries = map_entries(constants);
    const vk::SpecializationInfo specialisation(
        static_cast<std::uint32_t>(entries.size()), entries.data(), constants.size_bytes(), constants.data());
    using ShaderStage = vk::ShaderStageFlagBits;
    const std::array stages{vk::PipelineShaderStageCreateInfo({}, ShaderStage::eVertex, *vertex_module, "main"),
        vk::PipelineShaderStageCreateInfo({}, ShaderStage::eFragment, *fragment_module, "main", &specialisation)};
    const vk::PipelineVertexInputStateCreateInfo no_input;
    const vk::PipelineInputAssemblyStateCreateInfo triangles({}, vk::PrimitiveTopology::eTriangleList);
    const vk::PipelineViewportStateCreateInfo viewport({}, 1, nullptr, 1, nullptr);
    vk::PipelineRasterizationStateCreateInfo rasterisation;
    rasterisation.setLineWidth(1.0f);
    const vk::PipelineMultisampleStateCreateInfo one_sample;
    using Channel = vk::ColorComponentFlagBits;
    vk::PipelineColorBlendAttachmentState overwritten;
    overwritten.setColorWriteMask(Channel::eR | Channel::eG | Channel::eB | Channel::eA);
    const std::vector<vk::PipelineColorBlendAttachmentState> attachments(place.colours, overwritten);
    const vk::PipelineColorBlendStateCreateInfo colours({}, false, vk::LogicOp::eCopy, attachments);
    const std::array dynamic{vk::DynamicState::eViewport, vk::DynamicState::eScissor};
    const vk::PipelineDynamicStateCreateInfo dynamic_states({}, dynamic);
    return vk::raii::Pipeline(device.handle(), nullptr,
        vk::GraphicsPipelineCreateInfo({}, stages, &no_input, &triangles, nullptr, &viewport, &rasterisation,
            &one_sample, nullptr, &colours, &dynamic_states, layout, place.pass, place.subpass));
}

vk::raii::Framebuffer FullscreenPass::make_framebuffer(std::uint32_t width, std::uint32_t height) const {
    const vk::PhysicalDeviceLimits& limits = device_.limits();
    if (width > limits.maxFramebufferWidth || height > limits.maxFramebufferHeight)
        throw UnsupportedError(device_.description().name + " has no framebuffers as large as the image");
    return vk::raii::Framebuffer(device_.handle(), vk::FramebufferCreateInfo({}, *pass_, 0, nullptr, width, height, 1));
}

void FullscreenPass::draw(const vk::raii::CommandBuffer& commands, vk::Framebuffer framebuffer, std::uint32_t width,
    std::uint32_t first_row, std::uint32_t end_row) const {
    const vk::Rect2D area({0, static_cast<std::int32_t>(first_row)}, {width, end_row - first_row});
    commands.setViewport(0, vk::Viewport(0.0f, static_cast<float>(first_row), static_cast<float>(width),
                                static_cast<float>(end_row - first_row), 0.0f, 1.0f));
    commands.setScissor(0, area);
    commands.beginRenderPass(vk::RenderPassBeginInfo(*pass_, framebuffer, area), vk::SubpassContents::eInline);
    commands.draw(3, 1, 0, 0);
    commands.endRenderPass();
}

}  // namespace tandem
