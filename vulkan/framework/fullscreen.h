// A render pass without attachments, whose fragment shader does a kernel's work and writes to buffers.
#pragma once

#include "vulkan/framework/pipeline.h"

namespace tandem {

class FullscreenPass {
public:
    // Throws UnsupportedError where fragments cannot write to buffers or the renderer's queue has no graphics.
    explicit FullscreenPass(const Device& device);

    // The shaders' entry points are `main`; `constants` go to the fragment shader.
    [[nodiscard]] vk::raii::Pipeline make_pipeline(vk::PipelineLayout layout, std::span<const std::uint32_t> vertex,
        std::span<const std::uint32_t> fragment, std::span<const SpecialisationConstant> constants) const;
    [[nodiscard]] vk::raii::Framebuffer make_framebuffer(std::uint32_t width, std::uint32_t height) const;
    // A fragment for each pixel of rows [first_row, end_row). Pipeline and descriptors are bound.
    void draw(const vk::raii::CommandBuffer& commands, vk::Framebuffer framebuffer, std::uint32_t width,
        std::uint32_t first_row, std::uint32_t end_row) const;

private:
    const Device& device_;
    vk::raii::RenderPass pass_;
};

}  // namespace tandem
