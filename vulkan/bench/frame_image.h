// How the sums of a frame become an image that is shown: what the families `images` and `presentation` vary. All ways
// give the same pixels.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "vulkan/framework/pipeline.h"
#include "vulkan/renderer/job/job.h"
#include "vulkan/resources/image.h"

namespace tandem {

enum class ImageWriter : std::uint32_t {
    kernel,      // stores pixels in an image
    packer,      // a kernel stores pixels in a buffer
    pass,        // the fragments of a full-screen pass
    sub_passes,  // one draws means of floats, the next reads them as input attachment
    two_passes,  // the same as passes of their own
};
// From an image or buffer of one's own to the image that is shown.
enum class ImageMove : std::uint32_t { none, copy, blit };

struct ImagePattern {
    ImageWriter writer = ImageWriter::kernel;
    ImageMove move = ImageMove::blit;                    // none for passes, copy for the packer
    vk::ImageTiling tiling = vk::ImageTiling::eOptimal;  // of one's own image
    bool transition_first = false;                       // one's own image changes its layout before all samples
    vk::AttachmentLoadOp load = vk::AttachmentLoadOp::eDontCare;     // of the image that is shown
    vk::AttachmentStoreOp store = vk::AttachmentStoreOp::eDontCare;  // of means between sub-passes
};
// That an image needs to be shown so, and at which stage it is touched first.
[[nodiscard]] vk::ImageUsageFlags shown_usage(const ImagePattern& pattern);
[[nodiscard]] vk::PipelineStageFlags shown_stage(const ImagePattern& pattern);

// Images that are shown in turn, as swapchains have them.
struct ShownImages {
    struct One {
        vk::Image image;
        vk::ImageView view;
    };
    std::vector<One> images;
    vk::Format format = vk::Format::eR8G8B8A8Unorm;  // or its twin with blue first
    vk::Extent2D size;
    ImageUse left;  // how a frame leaves them
};

class FrameImage {
public:
    // `sums`: the two places of VulkanJob::sums(), of so many samples a pixel. Throws UnsupportedError where the device
    // cannot.
    FrameImage(const Device& device, const ImagePattern& pattern, const ShownImages& shown,
        const std::array<vk::DescriptorBufferInfo, 2>& sums, std::uint32_t samples);

    // Before all samples of a frame: what the pattern has there.
    void record_first(const vk::raii::CommandBuffer& commands) const;
    // After them. The frame before by the same FrameImage has been waited for.
    void record_last(const vk::raii::CommandBuffer& commands, std::uint32_t sums_place, std::size_t image) const;

private:
    struct Words {  // shaders/shown/shown.glsl
        std::uint32_t width, pixels;
        float share;
    };

    void make_sets(const std::array<vk::DescriptorBufferInfo, 2>& sums);
    void make_passes();
    void make_framebuffers();
    void make_pipelines();
    void bind(const vk::raii::CommandBuffer& commands, vk::PipelineBindPoint point, std::size_t set) const;
    void record_kernel(const vk::raii::CommandBuffer& commands, std::size_t set) const;
    void record_move(const vk::raii::CommandBuffer& commands, vk::Image target) const;
    void record_passes(const vk::raii::CommandBuffer& commands, std::size_t set, std::size_t image) const;
    [[nodiscard]] bool draws() const;
    [[nodiscard]] bool draws_means() const;
    [[nodiscard]] bool stores_directly() const;

    const Device& device_;
    ImagePattern pattern_;
    ShownImages shown_;
    Words words_;
    BufferGroup steps_;
    std::optional<BufferGroup> packed_;
    std::optional<DeviceImage> own_;  // that a kernel writes, or that holds means between sub-passes
    vk::raii::DescriptorSetLayout set_layout_ = nullptr;
    vk::raii::PipelineLayout layout_ = nullptr;
    vk::raii::DescriptorPool pool_ = nullptr;
    std::vector<vk::DescriptorSet> sets_;  // [place], or [place * images + image] of kernels that store directly
    std::vector<vk::raii::RenderPass> passes_;
    std::vector<std::vector<vk::raii::Framebuffer>> framebuffers_;  // [pass][image]
    std::vector<vk::raii::Pipeline> pipelines_;                     // in the order in which they run
};

// The pixels of an image on their way to the host.
class FetchedImage {
public:
    FetchedImage(const Device& device, const ShownImages& shown);

    // After record_last().
    void record(const vk::raii::CommandBuffer& commands, std::size_t image) const;
    // Red, green, blue, 255 a pixel, once the commands were waited for.
    [[nodiscard]] std::vector<std::uint8_t> pixels() const;

private:
    ShownImages shown_;
    BufferGroup buffer_;
};

// The kind of its recordings (Submission::Key).
inline constexpr std::uint32_t shown_recording = 1000;
// Settings of jobs whose sums a FrameImage reads: of two floats a sum.
inline void summed_in_pairs(RenderSettings& settings) { settings.accumulation = Accumulation::compensated; }

// The same pixels by the host.
[[nodiscard]] std::vector<std::uint8_t> shown_pixels(const Estimate& estimate);
[[nodiscard]] std::uint64_t digest_of(const std::vector<std::uint8_t>& pixels);

}  // namespace tandem
