// The buffers of one job by descriptor set: Scene, Camera, Rays and Image, each one allocation unless patterns say
// otherwise.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "vulkan/renderer/kernels/stages.h"
#include "vulkan/renderer/scene/scene_data.h"
#include "vulkan/resources/buffer_group.h"
#include "vulkan/resources/merged_buffers.h"

namespace tandem {

inline constexpr vk::DeviceSize ray_queue_bytes = 16;
inline constexpr std::size_t sums_per_pixel = 3;  // one for each channel

struct BufferPlacements {
    BufferPlacement scene = BufferPlacement::device_local;  // and the camera
    BufferPlacement rays = BufferPlacement::device_local;   // and the sums
};

// Ray state and sums are ping-ponged. Rays: parity p reads half p and writes half 1 - p. Image: likewise for sums.
class FrameResources {
public:
    // `tile_pixels`: pixels that are in flight at a time. `path`: what is kept of them in buffers; none: nothing.
    // `lists_pixels`: there is room for a list of them. `scene` must outlive it.
    FrameResources(const Device& device, const SceneData& scene, const std::optional<PathState>& path,
        std::uint32_t bounces, std::uint32_t tile_pixels, MemoryLayout memory, bool lists_pixels = false,
        BufferPlacements places = {});

    // What the bindings of a set point to; the halves of Rays and Image by their parity, or, of Rays, both as arrays.
    static constexpr std::uint32_t both_parities = 2;
    [[nodiscard]] std::vector<vk::DescriptorBufferInfo> buffers(SetIndex set, std::uint32_t parity = 0) const;

    // The queues of rays (shaders/kernels/ray_state.glsl): at k * ray_queue_bytes the dispatch arguments of segment k.
    [[nodiscard]] vk::Buffer queues() const { return rays_[ray_queues]; }
    [[nodiscard]] vk::DeviceSize queue_offset(std::uint32_t segment) const {
        return rays_.offset(ray_queues) + segment * ray_queue_bytes;
    }
    // What dispatches write and others read: the Rays and Image sets, as descriptors see them.
    [[nodiscard]] std::vector<vk::DescriptorBufferInfo> written_by_dispatches() const;
    // The buffer of a binding of the Rays set of parity 0.
    [[nodiscard]] vk::DescriptorBufferInfo ray_buffer(std::size_t binding) const { return rays_.info(binding); }

    // The host writes scene and camera: to their place, or to where record_upload copies them from. No device reads
    // them meanwhile.
    void write_scene() const;
    // Copies scene and camera to the device, where the host cannot write them there itself.
    void record_upload(const vk::raii::CommandBuffer& commands) const;
    // Sets the counters to 0.
    void record_clear_counters(const vk::raii::CommandBuffer& commands) const;
    // The pixels of a tile, for record_pixel_list to copy to the device (shaders/kernels/pixel_list.glsl).
    void set_pixel_list(std::span<const std::uint32_t> pixels);
    void record_pixel_list(const vk::raii::CommandBuffer& commands, std::uint32_t pixels) const;
    // Copies the sums that parity `sum_parity` reads, and the counters, to the host.
    void record_download(
        const vk::raii::CommandBuffer& commands, std::uint32_t sum_parity, std::uint32_t tile_pixels) const;
    // The counters alone.
    void record_counters(const vk::raii::CommandBuffer& commands) const;
    // The reverse: sums that are written there, in place of what was downloaded last, are copied to the device.
    [[nodiscard]] gpu::Vec4* sums_to_copy();
    void record_sums(
        const vk::raii::CommandBuffer& commands, std::uint32_t sum_parity, std::uint32_t tile_pixels) const;
    // What was downloaded: [channel * tile_pixels + i], see shaders/kernels/moments.glsl.
    [[nodiscard]] const gpu::Vec4* downloaded_sums() const;
    struct Counters {
        std::uint32_t invalid = 0;     // samples
        std::uint32_t unfinished = 0;  // pixels whose loops the driver left
    };
    [[nodiscard]] Counters downloaded_counters() const;
    // Copies the queue of a segment to the host; how many rays it holds.
    void record_queue_download(const vk::raii::CommandBuffer& commands, std::uint32_t segment) const;
    [[nodiscard]] std::uint32_t downloaded_queue_count() const;

private:
    static constexpr std::size_t ray_queues = 13;  // among the buffers of the Rays set

    // What the host has of scene or camera.
    struct Upload {
        const void* data;
        vk::DeviceSize bytes;
        std::size_t buffer;  // of the Scene set; the last upload is the camera's
    };
    [[nodiscard]] const BufferGroup& target_of(std::size_t upload) const {
        return upload + 1 == uploads_.size() ? camera_ : scene_;
    }

    [[nodiscard]] std::vector<vk::DescriptorBufferInfo> separate_buffers(SetIndex set, std::uint32_t parity) const;
    [[nodiscard]] const BufferGroup& group_of(SetIndex set) const;
    void write_places(const Device& device);

    MemoryLayout memory_;
    bool staged_;  // the host writes to upload_
    SharedMemory shared_;
    BufferGroup scene_, camera_, rays_, image_, upload_, readback_;
    // Where the parts of merged buffers begin, if a set's are (resources/merged_buffers.h): for each set and parity.
    std::optional<BufferGroup> places_;
    std::vector<Upload> uploads_;
};

// What the buffers hold, by name, in bytes, the tables of a scene part by part; buffers that hold nothing are left out.
[[nodiscard]] std::vector<JobFacts::Part> buffer_parts(const SceneData& scene, const std::optional<PathState>& path,
    std::uint32_t bounces, std::uint32_t tile_pixels, bool lists_pixels);
// Bytes that a path keeps from one vertex to the next: ray, throughput and what else PathState says.
[[nodiscard]] std::uint64_t bytes_per_path(const std::optional<PathState>& path);
// Bytes of device memory for each pixel in flight.
[[nodiscard]] std::uint64_t bytes_per_pixel(const std::optional<PathState>& path);
// As many pixels of an image as the device's limits allow in flight at once.
[[nodiscard]] std::uint32_t tile_size(
    const Device& device, std::uint64_t image_pixels, const std::optional<PathState>& path);

}  // namespace tandem
