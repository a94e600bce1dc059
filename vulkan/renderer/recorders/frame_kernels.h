// The kernels of a job as recorders dispatch them: pipelines with descriptors and settings, and the barriers between
// them. They share the scene and the sums.
#pragma once

#include <utility>

#include "vulkan/command/ordering.h"
#include "vulkan/renderer/kernels/bindings.h"

namespace tandem {

// Pixels that are in flight together: a run of the image, or of places in a list of pixels.
struct Tile {
    std::uint32_t first_pixel = 0, pixel_count = 0;
    std::uint32_t listed = 0;  // pixels of the list, which the tile holds once for each block; 0: a run of the image
    bool follows = false;      // it takes the buffers of another tile
};

// A kernel and what it is to be told, as it stands when it is recorded.
struct Dispatch {
    Stage stage;
    gpu::Settings settings;
    std::uint32_t ray_parity, sum_parity;
};

class FrameKernels {
public:
    // `told`: to every dispatch of the job. What is referred to must outlive it.
    FrameKernels(const Device& device, const PipelineLayout& layout, const Stages::Pipelines& pipelines,
        const FrameResources& resources, const SceneData& scene, const gpu::Settings& told, std::uint32_t workgroup,
        const VulkanPatterns& patterns);

    [[nodiscard]] const Stages::Pipelines& pipelines() const { return pipelines_; }
    [[nodiscard]] const PipelineLayout& layout() const { return layout_; }
    [[nodiscard]] const Ordering& ordering() const { return ordering_; }
    [[nodiscard]] std::uint32_t workgroup() const { return workgroup_; }
    [[nodiscard]] bool has(Stage stage) const;
    // What dispatches over a tile are told.
    [[nodiscard]] gpu::Settings settings(const Tile& tile, std::uint64_t sample) const;

    // These record, from any thread. So many invocations; with none nothing is recorded.
    void dispatch(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t invocations) const;
    // Over the rays of the segment's queue, of which only the device knows how many there are.
    void dispatch_queue(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const;
    // Has the device tell how many rays a segment's queue holds; and what it told, once that has run.
    void ask_for_rays(const vk::raii::CommandBuffer& commands, std::uint32_t segment) const {
        resources_.record_queue_download(commands, segment);
    }
    [[nodiscard]] std::uint32_t answered_rays() const { return resources_.downloaded_queue_count(); }
    // The pipeline of the stage and what it needs; and the latter alone.
    void bind(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch,
        vk::PipelineBindPoint point = vk::PipelineBindPoint::eCompute) const;
    void bind_data(
        const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, vk::PipelineBindPoint point) const;
    // Scene upload and vertex stage, which a job needs but once. What reads the world primitives is for the caller to
    // order.
    void place_scene(
        const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t sum_parity) const;

    // These follow what was added to submissions so far. Whether the scene is still to be placed: the host writes it,
    // and it counts as placed from now on.
    [[nodiscard]] bool scene_is_due() {
        if (std::exchange(scene_placed_, true)) return false;
        resources_.write_scene();
        return true;
    }
    void forget_scene() { scene_placed_ = false; }
    [[nodiscard]] bool scene_placed() const { return scene_placed_; }
    // The half of the sums that holds the current ones.
    [[nodiscard]] std::uint32_t sum_parity() const { return sum_parity_; }
    // The other half will hold them. Returns the half that did.
    std::uint32_t turn_sums() { return std::exchange(sum_parity_, 1 - sum_parity_); }
    // Whatever was recorded before has run.
    void begin_submission();

private:
    const PipelineLayout& layout_;
    const Stages::Pipelines& pipelines_;
    const FrameResources& resources_;
    std::uint32_t primitives_;  // that the vertex stage places
    bool placed_by_host_;       // what is held in double
    gpu::Settings told_;
    std::uint32_t workgroup_;
    Bindings bindings_;
    Ordering ordering_;
    bool scene_placed_ = false;
    std::uint32_t sum_parity_ = 0;
};

}  // namespace tandem
