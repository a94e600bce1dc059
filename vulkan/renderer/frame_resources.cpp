#include "vulkan/renderer/frame_resources.h"

#include <algorithm>
#include <cstring>

#include "common/error.h"
#include "vulkan/command/barrier.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

using Usage = vk::BufferUsageFlagBits;
constexpr std::uint64_t element = sizeof(gpu::Vec4);  // of every ray and image buffer
constexpr std::uint64_t sums_per_pixel = 3;
constexpr std::size_t ping_ponged =
    5;  // ray buffers with two halves: origin, direction, throughput, radiance, contribution

template <class T>
vk::DeviceSize bytes_of(const std::vector<T>& data) {
    return data.size() * sizeof(T);
}

constexpr std::uint32_t bvh_nodes = 10;  // among the scene's buffers, the last

std::vector<BufferSpec> scene_specs(const SceneData& scene) {
    const vk::BufferUsageFlags filled = Usage::eStorageBuffer | Usage::eTransferDst;
    const auto world = [](vk::DeviceSize bytes) {
        return BufferSpec{
            std::max<vk::DeviceSize>(bytes, uniform_block_bytes), Usage::eStorageBuffer | Usage::eUniformBuffer};
    };
    return {{sizeof scene.header, Usage::eUniformBuffer | Usage::eTransferDst}, {bytes_of(scene.vertices), filled},
        {bytes_of(scene.sources), filled}, {bytes_of(scene.transforms), filled}, {bytes_of(scene.placed), filled},
        {bytes_of(scene.materials), filled}, {bytes_of(scene.lights), filled},
        world(scene.triangle_count * sizeof(gpu::Triangle)), world(scene.sphere_count * sizeof(gpu::Convex)),
        world(scene.cuboid_count * sizeof(gpu::Convex)), {bytes_of(scene.trees.nodes), filled}};
}

// Which ray buffers hold anything: the five ping-ponged ones, hits, shadow rays, samples.
std::array<bool, 8> ray_buffers_used(PathState path) {
    return {true, true, true, path.radiance, path.next_events, true, path.next_events, true};
}

// Buffers 0 … 4 and 5 … 9 are the two halves, 10 … 12 hits, shadow rays and samples; ray_queues follows.
std::vector<BufferSpec> ray_specs(PathState path, std::uint64_t pixels) {
    const auto used = ray_buffers_used(path);
    std::vector<BufferSpec> specs;
    for (std::size_t i = 0; i < 2 * ping_ponged + 3; ++i) {
        const bool needed = used[i < ping_ponged ? i : i - ping_ponged];
        specs.push_back({needed ? pixels * element : 0, Usage::eStorageBuffer});
    }
    return specs;
}

constexpr std::size_t ray_queues = 2 * ping_ponged + 3;

// One queue a segment and an empty one after the last.
std::vector<BufferSpec> all_ray_specs(PathState path, std::uint64_t pixels, std::uint32_t bounces) {
    std::vector<BufferSpec> specs = ray_specs(path, pixels);
    specs.push_back({(std::uint64_t{bounces} + 2) * ray_queue_bytes, Usage::eStorageBuffer | Usage::eIndirectBuffer});
    return specs;
}

std::vector<BufferSpec> image_specs(std::uint64_t pixels) {
    const BufferSpec sums{pixels * sums_per_pixel * element, Usage::eStorageBuffer | Usage::eTransferSrc};
    return {sums, sums, {element, Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst}};
}

std::vector<BufferSpec> upload_specs(const SceneData& scene) {
    std::vector<BufferSpec> specs;
    for (const BufferSpec& spec : scene_specs(scene))
        if (spec.usage & Usage::eTransferDst) specs.push_back({spec.bytes, Usage::eTransferSrc});
    specs.push_back({sizeof scene.camera, Usage::eTransferSrc});
    return specs;
}

std::vector<BufferSpec> readback_specs(std::uint64_t pixels) {
    return {{pixels * sums_per_pixel * element, Usage::eTransferDst}, {element, Usage::eTransferDst}};
}

std::vector<vk::DescriptorBufferInfo> all_of(const BufferGroup& group) {
    std::vector<vk::DescriptorBufferInfo> buffers;
    for (std::size_t i = 0; i < group.size(); ++i) buffers.push_back(group.info(i));
    return buffers;
}

// The header and the tables of the scene, the world primitives (as storage buffers and once more as uniform blocks) and
// the nodes of trees.
std::vector<vk::DescriptorBufferInfo> scene_buffers(const BufferGroup& scene) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(scene);
    const vk::DescriptorBufferInfo nodes = buffers.back();
    buffers.pop_back();
    for (std::size_t i = buffers.size() - uniform_views; i < bvh_nodes; ++i)
        buffers.push_back(scene.info(i, uniform_block_bytes));
    buffers.push_back(nodes);
    return buffers;
}

// The Rays set of one parity: bindings 0 … 4 are the half that is read, 5 … 9 the one that is written.
std::vector<vk::DescriptorBufferInfo> ray_buffers(const BufferGroup& rays, bool odd) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(rays);
    if (odd) std::rotate(buffers.begin(), buffers.begin() + ping_ponged, buffers.begin() + 2 * ping_ponged);
    return buffers;
}

std::vector<vk::DescriptorBufferInfo> image_buffers(const BufferGroup& image, bool odd) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(image);
    if (odd) std::swap(buffers[0], buffers[1]);
    return buffers;
}

std::vector<DescriptorSets::Request> set_requests(const PipelineLayout& layout, const BufferGroup& scene,
    const BufferGroup& camera, const BufferGroup& rays, const BufferGroup& image) {
    const auto request = [&](SetIndex index, std::vector<vk::DescriptorBufferInfo> buffers) {
        const auto i = static_cast<std::size_t>(index);
        return DescriptorSets::Request{layout.set(i), set_bindings()[i], std::move(buffers)};
    };
    return {request(SetIndex::scene, scene_buffers(scene)), request(SetIndex::camera, all_of(camera)),
        request(SetIndex::rays, ray_buffers(rays, false)), request(SetIndex::rays, ray_buffers(rays, true)),
        request(SetIndex::image, image_buffers(image, false)), request(SetIndex::image, image_buffers(image, true))};
}

}  // namespace

FrameResources::FrameResources(const Device& device, const PipelineLayout& layout, const SceneData& scene,
    PathState path, std::uint32_t bounces, std::uint32_t tile_pixels)
    : scene_(device, MemoryDomain::device, scene_specs(scene)),
      camera_(device, MemoryDomain::device,
          std::array{BufferSpec{sizeof scene.camera, Usage::eUniformBuffer | Usage::eTransferDst}}),
      rays_(device, MemoryDomain::device, all_ray_specs(path, tile_pixels, bounces)),
      image_(device, MemoryDomain::device, image_specs(tile_pixels)),
      upload_(device, MemoryDomain::upload, upload_specs(scene)),
      readback_(device, MemoryDomain::readback, readback_specs(tile_pixels)),
      sets_(device, set_requests(layout, scene_, camera_, rays_, image_)) {
    const auto stage = [&](const void* data, vk::DeviceSize bytes, std::uint32_t binding) {
        if (bytes > 0) std::memcpy(upload_.mapped(uploads_.size()), data, bytes);
        uploads_.emplace_back(bytes, binding);
    };
    stage(&scene.header, sizeof scene.header, 0);
    stage(scene.vertices.data(), bytes_of(scene.vertices), 1);
    stage(scene.sources.data(), bytes_of(scene.sources), 2);
    stage(scene.transforms.data(), bytes_of(scene.transforms), 3);
    stage(scene.placed.data(), bytes_of(scene.placed), 4);
    stage(scene.materials.data(), bytes_of(scene.materials), 5);
    stage(scene.lights.data(), bytes_of(scene.lights), 6);
    stage(scene.trees.nodes.data(), bytes_of(scene.trees.nodes), bvh_nodes);
    stage(&scene.camera, sizeof scene.camera, 0);
}

std::array<vk::DescriptorSet, 4> FrameResources::sets(std::uint32_t ray_parity, std::uint32_t sum_parity) const {
    return {sets_[0], sets_[1], sets_[2 + ray_parity], sets_[4 + sum_parity]};
}

vk::Buffer FrameResources::queues() const { return rays_[ray_queues]; }

void FrameResources::record_upload(const vk::raii::CommandBuffer& commands) const {
    for (std::size_t i = 0; i < uploads_.size(); ++i) {
        const auto& [bytes, binding] = uploads_[i];
        const bool is_camera = i + 1 == uploads_.size();
        if (bytes > 0)
            commands.copyBuffer(upload_[i], is_camera ? camera_[0] : scene_[binding], vk::BufferCopy(0, 0, bytes));
    }
}

void FrameResources::record_clear_counters(const vk::raii::CommandBuffer& commands) const {
    commands.fillBuffer(image_[2], 0, VK_WHOLE_SIZE, 0);
}

void FrameResources::record_download(
    const vk::raii::CommandBuffer& commands, std::uint32_t sum_parity, std::uint32_t tile_pixels) const {
    barrier(commands, compute_write, transfer_read);
    commands.copyBuffer(image_[sum_parity], readback_[0], vk::BufferCopy(0, 0, tile_pixels * sums_per_pixel * element));
    commands.copyBuffer(image_[2], readback_[1], vk::BufferCopy(0, 0, element));
    barrier(commands, transfer_write, host_read);
}

const gpu::Vec4* FrameResources::downloaded_sums() const {
    return reinterpret_cast<const gpu::Vec4*>(readback_.mapped(0));
}

std::uint32_t FrameResources::downloaded_invalid() const {
    std::uint32_t count = 0;
    std::memcpy(&count, readback_.mapped(1), sizeof count);
    return count;
}

std::uint64_t bytes_per_pixel(PathState path) {
    std::uint64_t bytes = 2 * sums_per_pixel * element;
    for (const BufferSpec& spec : ray_specs(path, 1)) bytes += spec.bytes;
    return bytes;
}

std::uint32_t tile_size(const Device& device, std::uint64_t image_pixels, PathState path) {
    const DeviceAbilities& has = device.description().abilities;
    const std::uint64_t by_range = has.storage_buffer_bytes / (sums_per_pixel * element);
    const std::uint64_t by_groups = std::uint64_t{device.limits().maxComputeWorkGroupCount[0]} * workgroup_size;
    // One allocation holds the rays; all of it may take half of the device's memory, the rest being others'.
    const std::uint64_t memory = std::min(has.allocation_bytes, has.device_memory_bytes / 2);
    const std::uint64_t by_memory = memory / bytes_per_pixel(path);
    const std::uint64_t tile = std::min({image_pixels, by_range, by_groups, by_memory});
    if (tile == 0) throw UnsupportedError(device.description().name + " has too little memory for a single pixel");
    return static_cast<std::uint32_t>(tile);
}

}  // namespace tandem
