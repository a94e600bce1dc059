// Triangles that cover a viewport, for fragment shaders that do a kernel's work; and a render pass without attachments,
// whose fragments write to buffers.
#pragma once

#include "vulkan/framework/pipeline.h"

namespace tandem {

// Where a triangle is drawn that covers the viewport: in a sub-pass with so many colour attachments.
struct FullscreenPlace {
    vk::RenderPass pass;
    std::uint32_t subpass = 0, colours = 0;
};
// The shaders' entry points are `main`; `constants` go to the fragment shader. Attachments are overwritten.
[[nodiscard]] vk::raii::Pipeline make_fullscreen_pipeline(const Device& device, vk::PipelineLayout layout,
    const FullscreenPlace& place, std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> fragment,
    std::span<const SpecialisationConstant> constants);

class FullscreenPass {
public:
    // Throws UnsupportedError where fragments cannot write to buffers or the renderer's queue has no graphics.
    explicit FullscreenPass(const Device& device);

    [[nodiscard]] vk::raii::Pipeline make_pipeline(vk::PipelineLayout layout, std::span<const std::uint32_t> vertex,
        std::span<const std::uint32_t> fragment, std::span<const SpecialisationConstant> constants) const {
        return make_fullscreen_pipeline(device_, layout, {*pass_}, vertex, fragment, constants);
    }
    [[nodiscard]] vk::raii::Framebuffer make_framebuffer(std::uint32_t width, std::uint32_t height) const;
    // A fragment for each pixel of rows [first_row, end_row). Pipeline and descriptors are bound.
    void draw(const vk::raii::CommandBuffer& commands, vk::Framebuffer framebuffer, std::uint32_t width,
        std::uint32_t first_row, std::uint32_t end_row) const;

private:
    const Device& device_;
    vk::raii::RenderPass pass_;
};

}  // namespace tandem
