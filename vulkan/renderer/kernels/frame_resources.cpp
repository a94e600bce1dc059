#include "vulkan/renderer/kernels/frame_resources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/error.h"
#include "vulkan/command/barrier.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

using Usage = vk::BufferUsageFlagBits;
constexpr std::uint64_t element = sizeof(gpu::Vec4);  // of every ray and image buffer
constexpr std::uint64_t interiors_bytes = 16;         // eight indices of 16 bits
constexpr std::size_t ping_ponged =
    5;  // ray buffers with two halves: origin, direction, throughput, radiance, contribution

// A buffer of the Scene set: what it is called, what fills it (null: the vertex stage), how much of it there is.
struct SceneBuffer {
    const char* name;
    const void* data;
    vk::DeviceSize bytes;
    vk::DeviceSize element;  // bytes of one
};

template <class T>
SceneBuffer filled(const char* name, const std::vector<T>& data) {
    return {name, data.data(), data.size() * sizeof(T), sizeof(T)};
}

constexpr std::size_t bvh_nodes = 10;  // among the scene's buffers, the first after the world primitives

// As it is in float or, where geometry is in double, in that.
template <class Single, class Doubled>
SceneBuffer either(const char* name, const std::vector<Single>& single, const SceneData& scene,
    std::vector<Doubled> DoubleGeometry::*doubled) {
    return scene.in_double ? filled(name, (*scene.in_double).*doubled) : filled(name, single);
}

template <class Single, class Doubled>
SceneBuffer either(const char* name, const std::vector<Single>& single, const SceneData& scene,
    std::vector<Doubled> DoubleGeometry::Shading::*doubled) {
    const bool in_double = scene.in_double && scene.in_double->shading;
    return in_double ? filled(name, (*scene.in_double->shading).*doubled) : filled(name, single);
}

SceneBuffer header_of(const SceneData& scene) {
    const bool in_double = scene.in_double && scene.in_double->shading;
    if (in_double)
        return {"scene-header", &scene.in_double->shading->header, sizeof(gpu::DoubleSceneHeader),
            sizeof(gpu::DoubleSceneHeader)};
    return {"scene-header", &scene.header, sizeof scene.header, sizeof scene.header};
}

// World primitives that the vertex stage fills, or the host in double.
template <class Single, class Doubled>
SceneBuffer world(
    const char* name, std::uint32_t count, const SceneData& scene, std::vector<Doubled> DoubleGeometry::*doubled) {
    if (scene.in_double) return filled(name, (*scene.in_double).*doubled);
    return {name, nullptr, count * sizeof(Single), sizeof(Single)};
}

// Bindings 0 … 9 and, after the uniform views of 7, 8 and 9, bindings 13 … 16.
std::array<SceneBuffer, 14> scene_list(const SceneData& scene) {
    return {{header_of(scene), filled("vertices", scene.vertices), filled("primitive-sources", scene.sources),
        either("transforms", scene.transforms, scene, &DoubleGeometry::transforms),
        filled("placed-primitives", scene.placed),
        either("materials", scene.materials, scene, &DoubleGeometry::Shading::materials),
        either("lights", scene.lights, scene, &DoubleGeometry::lights),
        world<gpu::Triangle>("world-triangles", scene.triangle_count, scene, &DoubleGeometry::triangles),
        world<gpu::Convex>("world-spheres", scene.sphere_count, scene, &DoubleGeometry::spheres),
        world<gpu::Convex>("world-cuboids", scene.cuboid_count, scene, &DoubleGeometry::cuboids),
        filled("tree-nodes", scene.trees.nodes),
        either("textures", scene.tables.textures, scene, &DoubleGeometry::Shading::textures),
        filled("tables", scene.tables.numbers), either("media", scene.tables.media, scene, &DoubleGeometry::media)}};
}

SceneBuffer camera_of(const SceneData& scene) {
    if (scene.in_double)
        return {"camera", &scene.in_double->camera, sizeof scene.in_double->camera, sizeof scene.in_double->camera};
    return {"camera", &scene.camera, sizeof scene.camera, sizeof scene.camera};
}

// The scene, unless shaders may not see one of its buffers whole, which reads as anything beyond that. write_places
// looks at merged sets.
const SceneData& seen_whole(const Device& device, const SceneData& scene) {
    const std::uint64_t range = device.limits().maxStorageBufferRange;
    for (const SceneBuffer& buffer : scene_list(scene))
        if (buffer.bytes > range)
            throw UnsupportedError(fmt::format(
                "{} lets shaders see {} KiB of a buffer, and the scene's {} take {}; use a smaller scene or smaller "
                "images, another --device, or --backend cpu",
                device.description().name, range >> 10, buffer.name, (buffer.bytes >> 10) + 1));
    return scene;
}

std::vector<BufferSpec> scene_specs(const SceneData& scene) {
    std::vector<BufferSpec> specs;
    for (const SceneBuffer& buffer : scene_list(scene)) {
        if (buffer.data == header_of(scene).data)
            specs.push_back({buffer.bytes, Usage::eUniformBuffer | Usage::eTransferDst});
        else if (specs.size() + uniform_views >= bvh_nodes && specs.size() < bvh_nodes)
            specs.push_back({std::max<vk::DeviceSize>(buffer.bytes, uniform_block_bytes),
                Usage::eStorageBuffer | Usage::eUniformBuffer | Usage::eTransferDst});
        else
            specs.push_back({buffer.bytes, Usage::eStorageBuffer | Usage::eTransferDst});
        specs.back().element = buffer.element;
    }
    return specs;
}

// A ray buffer: what it is called, its bytes a path, 0 if it holds nothing. The first five are ping-ponged, as are the
// last two.
struct RayBuffer {
    const char* name = "";
    std::uint64_t bytes = 0;
    bool carried = true;  // from one vertex to the next
};

constexpr std::size_t ray_buffer_count = 9;
std::array<RayBuffer, ray_buffer_count> ray_list(const std::optional<PathState>& kept) {
    if (!kept) return {};
    const PathState path = *kept;
    const auto if_used = [](bool used, std::uint64_t bytes) { return used ? bytes : 0; };
    // In half the radiance shares the throughput's element (shaders/kernels/half_state.glsl).
    return {{{"ray-origins", element}, {"ray-directions", element}, {"throughputs", element},
        {"gathered-radiances", if_used(path.radiance && !path.in_half, element)},
        {"next-event-contributions", if_used(path.next_events, path.in_half ? element / 2 : element)},
        {"hits", element, false}, {"shadow-rays", if_used(path.next_events, element)}, {"samples", element, false},
        {"interiors", if_used(path.interiors, interiors_bytes)}}};
}

constexpr bool is_ping_ponged(std::size_t i) { return i < ping_ponged || i + 1 == ray_buffer_count; }

// Buffers 0 … 4 and 5 … 9 are the two halves, 10 … 12 hits, shadow rays and samples. 13 has the queues, one a segment
// and an empty one after the last. 14 and 15 are the halves of the interiors.
std::vector<BufferSpec> ray_specs(const std::optional<PathState>& path, std::uint64_t pixels, std::uint32_t bounces) {
    const auto list = ray_list(path);
    std::vector<BufferSpec> specs;
    // Copied from and to by VulkanIntersector alone.
    const auto add = [&](std::size_t i) {
        specs.push_back({pixels * list[i].bytes, Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst});
    };
    for (std::size_t i = 0; i < 2 * ping_ponged; ++i) add(i % ping_ponged);
    for (std::size_t i = ping_ponged; i < ping_ponged + 3; ++i) add(i);
    specs.push_back({path ? (std::uint64_t{bounces} + 2) * ray_queue_bytes : 0,
        Usage::eStorageBuffer | Usage::eIndirectBuffer | Usage::eTransferSrc});
    for (int half = 0; half < 2; ++half) add(list.size() - 1);
    return specs;
}

constexpr std::uint64_t list_bytes = sizeof(std::uint32_t);  // a pixel, where lists are rendered

// The halves of the sums; the counters and, behind them, a list of pixels.
std::vector<BufferSpec> image_specs(std::uint64_t pixels, std::uint64_t listed) {
    const BufferSpec sums{
        pixels * sums_per_pixel * element, Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst};
    return {
        sums, sums, {element + listed * list_bytes, Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst}};
}

MemoryDomain domain_of(BufferPlacement placement) {
    switch (placement) {
        case BufferPlacement::host_visible:
            return MemoryDomain::upload;
        case BufferPlacement::mapped:
            return MemoryDomain::mapped;
        case BufferPlacement::device_local:
            break;
    }
    return MemoryDomain::device;
}

// The list of pixels is the last.
std::vector<BufferSpec> upload_specs(const SceneData& scene, std::uint64_t listed, BufferPlacement placement) {
    std::vector<BufferSpec> specs;
    if (placement == BufferPlacement::device_local) {
        for (const SceneBuffer& buffer : scene_list(scene))
            if (buffer.data != nullptr && buffer.bytes > 0) specs.push_back({buffer.bytes, Usage::eTransferSrc});
        specs.push_back({camera_of(scene).bytes, Usage::eTransferSrc});
    }
    specs.push_back({listed * list_bytes, Usage::eTransferSrc});
    return specs;
}

std::vector<BufferSpec> readback_specs(std::uint64_t pixels) {
    return {{pixels * sums_per_pixel * element, Usage::eTransferSrc | Usage::eTransferDst},
        {element, Usage::eTransferDst}, {ray_queue_bytes, Usage::eTransferDst}};
}

std::array<BufferSpec, 1> camera_specs(const SceneData& scene) {
    return {BufferSpec{camera_of(scene).bytes, Usage::eUniformBuffer | Usage::eTransferDst}};
}

SharedMemory shared_memory(const SceneData& scene, const std::optional<PathState>& path, std::uint32_t bounces,
    std::uint32_t pixels, MemoryLayout memory, std::uint32_t listed, BufferPlacements places) {
    SharedMemory shared;
    if (memory != MemoryLayout::one_block) return shared;
    shared.reserve(domain_of(places.scene), scene_specs(scene));
    shared.reserve(domain_of(places.scene), camera_specs(scene));
    shared.reserve(domain_of(places.rays), ray_specs(path, pixels, bounces));
    shared.reserve(domain_of(places.rays), image_specs(pixels, listed));
    shared.reserve(MemoryDomain::upload, upload_specs(scene, listed, places.scene));
    shared.reserve(MemoryDomain::readback, readback_specs(pixels));
    return shared;
}

// The layout that was asked for or, where the storage buffers of a set are parts of one, that.
MemoryLayout possible(const Device& device, MemoryLayout memory) {
    const DeviceAbilities& has = device.description().abilities;
    if (!merges_storage_buffers(has) || memory == MemoryLayout::one_buffer) return memory;
    if (memory != MemoryLayout::per_set)
        throw UnsupportedError(
            fmt::format("{} lets a shader stage see {} storage buffers; with fewer than {} those of "
                        "a descriptor set are one buffer, in one allocation",
                device.description().name, std::min(has.storage_buffers_per_stage, has.storage_buffers_per_set),
                separate_storage_buffers));
    return MemoryLayout::one_buffer;
}

// Layout of a group of buffers: the ray state and the sums, or another.
MemoryLayout layout_of(MemoryLayout memory, bool rays) {
    const bool mixed = memory == MemoryLayout::rays_per_set || memory == MemoryLayout::others_per_set;
    if (!mixed) return memory;
    return rays == (memory == MemoryLayout::rays_per_set) ? MemoryLayout::per_set : MemoryLayout::per_buffer;
}

std::vector<vk::DescriptorBufferInfo> all_of(const BufferGroup& group) {
    std::vector<vk::DescriptorBufferInfo> buffers;
    for (std::size_t i = 0; i < group.size(); ++i) buffers.push_back(group.info(i));
    return buffers;
}

// The header and the tables of the scene, and the world primitives (as storage buffers and once more as uniform
// blocks). Then the nodes of trees and what only some effects use.
std::vector<vk::DescriptorBufferInfo> scene_buffers(const BufferGroup& scene) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(scene);
    std::vector<vk::DescriptorBufferInfo> views;
    for (std::size_t i = bvh_nodes - uniform_views; i < bvh_nodes; ++i)
        views.push_back(scene.info(i, uniform_block_bytes));
    buffers.insert(buffers.begin() + bvh_nodes, views.begin(), views.end());
    return buffers;
}

// The Rays set of one parity. Bindings 0 … 4 and 14 are the half that is read, 5 … 9 and 15 the one that is written.
std::vector<vk::DescriptorBufferInfo> ray_buffers(const BufferGroup& rays, bool odd) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(rays);
    if (odd) {
        std::rotate(buffers.begin(), buffers.begin() + ping_ponged, buffers.begin() + 2 * ping_ponged);
        std::swap(buffers[14], buffers[15]);
    }
    return buffers;
}

std::vector<vk::DescriptorBufferInfo> image_buffers(const BufferGroup& image, bool odd) {
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(image);
    if (odd) std::swap(buffers[0], buffers[1]);
    return buffers;
}

// Both halves of every ping-ponged binding in place of the one that is read, the one of parity 0 first.
std::vector<vk::DescriptorBufferInfo> ray_arrays(const BufferGroup& rays) {
    const std::vector<vk::DescriptorBufferInfo> even = ray_buffers(rays, false), odd = ray_buffers(rays, true);
    std::vector<vk::DescriptorBufferInfo> buffers;
    for (std::uint32_t binding = 0; binding < even.size(); ++binding) {
        const auto is_read = [&](const auto& pair) { return pair.first == binding; };
        const auto is_written = [&](const auto& pair) { return pair.second == binding; };
        if (std::ranges::any_of(ping_ponged_bindings, is_written)) continue;
        buffers.push_back(even[binding]);
        if (std::ranges::any_of(ping_ponged_bindings, is_read)) buffers.push_back(odd[binding]);
    }
    return buffers;
}

}  // namespace

FrameResources::FrameResources(const Device& device, const SceneData& scene, const std::optional<PathState>& path,
    std::uint32_t bounces, std::uint32_t tile_pixels, MemoryLayout memory, bool lists_pixels, BufferPlacements places)
    : memory_(possible(device, memory)),
      staged_(places.scene == BufferPlacement::device_local),
      shared_(shared_memory(
          seen_whole(device, scene), path, bounces, tile_pixels, memory_, lists_pixels ? tile_pixels : 0, places)),
      scene_(device, domain_of(places.scene), scene_specs(scene), layout_of(memory_, false), &shared_),
      camera_(device, domain_of(places.scene), camera_specs(scene), layout_of(memory_, false), &shared_),
      rays_(device, domain_of(places.rays), ray_specs(path, tile_pixels, bounces), layout_of(memory_, true), &shared_),
      image_(device, domain_of(places.rays), image_specs(tile_pixels, lists_pixels ? tile_pixels : 0),
          layout_of(memory_, true), &shared_),
      upload_(device, MemoryDomain::upload, upload_specs(scene, lists_pixels ? tile_pixels : 0, places.scene),
          layout_of(memory_, false), &shared_),
      readback_(device, MemoryDomain::readback, readback_specs(tile_pixels), layout_of(memory_, false), &shared_) {
    if (merges_storage_buffers(device.description().abilities)) write_places(device);
    const auto list = scene_list(scene);
    for (std::size_t i = 0; i < list.size(); ++i)
        if (list[i].data != nullptr && list[i].bytes > 0) uploads_.push_back({list[i].data, list[i].bytes, i});
    uploads_.push_back({camera_of(scene).data, camera_of(scene).bytes, 0});
}

void FrameResources::write_scene() const {
    for (std::size_t i = 0; i < uploads_.size(); ++i)
        std::memcpy(
            staged_ ? upload_.mapped(i) : target_of(i).mapped(uploads_[i].buffer), uploads_[i].data, uploads_[i].bytes);
}

// For each set two blocks, of parity 0 and 1.
void FrameResources::write_places(const Device& device) {
    const std::vector<SetBindings> sets = separate_bindings({});
    const vk::DeviceSize bytes = most_bindings(sets) * sizeof(std::uint32_t);
    places_.emplace(
        device, MemoryDomain::mapped, std::vector<BufferSpec>(2 * sets.size(), {bytes, Usage::eUniformBuffer}));
    for (std::uint32_t i = 0; i < 2 * sets.size(); ++i) {
        const auto set = static_cast<SetIndex>(i / 2);
        if (!is_merged(sets[i / 2])) continue;
        if (const vk::DeviceSize all = group_of(set).whole().range; all > device.limits().maxStorageBufferRange)
            throw UnsupportedError(fmt::format(
                "{} lets shaders see {} MiB of a buffer. It lets them see so few buffers that {} MiB of the "
                "scene or image are in one; use a smaller scene or image",
                device.description().name, device.limits().maxStorageBufferRange >> 20, (all >> 20) + 1));
        const std::vector<std::uint32_t> places = places_of(sets[i / 2], separate_buffers(set, i % 2));
        std::memcpy(places_->mapped(i), places.data(), places.size() * sizeof places[0]);
    }
}

const BufferGroup& FrameResources::group_of(SetIndex set) const {
    return set == SetIndex::scene ? scene_ : set == SetIndex::camera ? camera_ : set == SetIndex::rays ? rays_ : image_;
}

std::vector<vk::DescriptorBufferInfo> FrameResources::buffers(SetIndex set, std::uint32_t parity) const {
    const std::vector<vk::DescriptorBufferInfo> separate = separate_buffers(set, parity);
    const std::vector<SetBindings> sets = separate_bindings({});
    const auto i = static_cast<std::size_t>(set);
    if (!places_ || i >= sets.size() || !is_merged(sets[i])) return separate;
    return merged(sets[i], separate, group_of(set).whole(), places_->info(2 * i + parity));
}

std::vector<vk::DescriptorBufferInfo> FrameResources::separate_buffers(SetIndex set, std::uint32_t parity) const {
    switch (set) {
        case SetIndex::scene:
            return scene_buffers(scene_);
        case SetIndex::camera:
            return all_of(camera_);
        case SetIndex::rays:
            return parity == both_parities ? ray_arrays(rays_) : ray_buffers(rays_, parity != 0);
        case SetIndex::image:
            return image_buffers(image_, parity != 0);
        case SetIndex::settings:
            break;
    }
    return {};
}

std::vector<vk::DescriptorBufferInfo> FrameResources::written_by_dispatches() const {
    if (places_) return {rays_.whole(), image_.whole()};
    std::vector<vk::DescriptorBufferInfo> buffers = all_of(rays_);
    for (const vk::DescriptorBufferInfo& buffer : all_of(image_)) buffers.push_back(buffer);
    return buffers;
}

void FrameResources::record_upload(const vk::raii::CommandBuffer& commands) const {
    for (std::size_t i = 0; staged_ && i < uploads_.size(); ++i) {
        const auto& [data, bytes, buffer] = uploads_[i];
        const BufferGroup& target = target_of(i);
        commands.copyBuffer(
            upload_[i], target[buffer], vk::BufferCopy(upload_.offset(i), target.offset(buffer), bytes));
    }
}

void FrameResources::record_clear_counters(const vk::raii::CommandBuffer& commands) const {
    commands.fillBuffer(image_[2], image_.offset(2), element, 0);
}

void FrameResources::set_pixel_list(std::span<const std::uint32_t> pixels) {
    std::memcpy(upload_.mapped(upload_.size() - 1), pixels.data(), pixels.size_bytes());
}

void FrameResources::record_pixel_list(const vk::raii::CommandBuffer& commands, std::uint32_t pixels) const {
    const std::size_t list = upload_.size() - 1;
    commands.copyBuffer(upload_[list], image_[2],
        vk::BufferCopy(upload_.offset(list), image_.offset(2) + element, pixels * list_bytes));
    barrier(commands, transfer_write, compute_access);
}

void FrameResources::record_download(
    const vk::raii::CommandBuffer& commands, std::uint32_t sum_parity, std::uint32_t tile_pixels) const {
    barrier(commands, compute_write, transfer_read);
    commands.copyBuffer(image_[sum_parity], readback_[0],
        vk::BufferCopy(image_.offset(sum_parity), readback_.offset(0), tile_pixels * sums_per_pixel * element));
    record_counters(commands);
}

void FrameResources::record_counters(const vk::raii::CommandBuffer& commands) const {
    barrier(commands, compute_write, transfer_read);
    commands.copyBuffer(image_[2], readback_[1], vk::BufferCopy(image_.offset(2), readback_.offset(1), element));
    barrier(commands, transfer_write, host_read);
}

gpu::Vec4* FrameResources::sums_to_copy() { return reinterpret_cast<gpu::Vec4*>(readback_.mapped(0)); }

void FrameResources::record_sums(
    const vk::raii::CommandBuffer& commands, std::uint32_t sum_parity, std::uint32_t tile_pixels) const {
    barrier(commands, compute_access, transfer_write);
    commands.copyBuffer(readback_[0], image_[sum_parity],
        vk::BufferCopy(readback_.offset(0), image_.offset(sum_parity), tile_pixels * sums_per_pixel * element));
    barrier(commands, transfer_write, compute_access);
}

const gpu::Vec4* FrameResources::downloaded_sums() const {
    return reinterpret_cast<const gpu::Vec4*>(readback_.mapped(0));
}

FrameResources::Counters FrameResources::downloaded_counters() const {
    Counters counters;
    std::memcpy(&counters, readback_.mapped(1), sizeof counters);
    return counters;
}

void FrameResources::record_queue_download(const vk::raii::CommandBuffer& commands, std::uint32_t segment) const {
    barrier(commands, compute_write, transfer_read);
    commands.copyBuffer(
        queues(), readback_[2], vk::BufferCopy(queue_offset(segment), readback_.offset(2), ray_queue_bytes));
    barrier(commands, transfer_write, host_read);
}

std::uint32_t FrameResources::downloaded_queue_count() const {
    std::array<std::uint32_t, ray_queue_bytes / sizeof(std::uint32_t)> queue{};
    std::memcpy(queue.data(), readback_.mapped(2), sizeof queue);
    return queue[3];  // after the dispatch's arguments
}

std::vector<JobFacts::Part> buffer_parts(const SceneData& scene, const std::optional<PathState>& path,
    std::uint32_t bounces, std::uint32_t tile_pixels, bool lists_pixels) {
    std::vector<JobFacts::Part> parts;
    const auto add = [&](const std::string& name, std::uint64_t bytes) {
        if (bytes > 0) parts.push_back({name, bytes});
    };
    for (const SceneBuffer& buffer : scene_list(scene))
        if (buffer.data != scene.tables.numbers.data() || buffer.data == nullptr) add(buffer.name, buffer.bytes);
    for (const SceneTables::Part& part : scene.tables.parts) add(part.name, part.floats * sizeof(float));
    add("camera", camera_of(scene).bytes);
    const auto list = ray_list(path);
    for (std::size_t i = 0; i < list.size(); ++i)
        add(list[i].name, tile_pixels * list[i].bytes * (is_ping_ponged(i) ? 2 : 1));
    if (path) add("ray-queues", (std::uint64_t{bounces} + 2) * ray_queue_bytes);
    add("sums", 2 * sums_per_pixel * element * tile_pixels);
    if (lists_pixels) add("pixel-list", list_bytes * tile_pixels);
    return parts;
}

std::uint64_t bytes_per_path(const std::optional<PathState>& path) {
    std::uint64_t bytes = 0;
    for (const RayBuffer& buffer : ray_list(path))
        if (buffer.carried) bytes += buffer.bytes;
    return bytes;
}

std::uint64_t bytes_per_pixel(const std::optional<PathState>& path) {
    std::uint64_t bytes = 2 * sums_per_pixel * element;
    const auto list = ray_list(path);
    for (std::size_t i = 0; i < list.size(); ++i) bytes += list[i].bytes * (is_ping_ponged(i) ? 2 : 1);
    return bytes;
}

std::uint32_t tile_size(const Device& device, std::uint64_t image_pixels, const std::optional<PathState>& path) {
    const DeviceAbilities& has = device.description().abilities;
    // Where the rays are in one buffer, an eighth of it is left to their queues.
    const bool merged = merges_storage_buffers(has);
    const std::uint64_t by_range = merged ? has.storage_buffer_bytes / 8 * 7 / bytes_per_pixel(path)
                                          : has.storage_buffer_bytes / (sums_per_pixel * element);
    const std::uint64_t by_groups = std::uint64_t{device.limits().maxComputeWorkGroupCount[0]} * workgroup_size;
    // One allocation holds the rays; all of it may take half of the device's memory, the rest being others'.
    const std::uint64_t memory = std::min(has.allocation_bytes, has.device_memory_bytes / 2);
    const std::uint64_t by_memory = memory / bytes_per_pixel(path);
    const std::uint64_t tile = std::min({image_pixels, by_range, by_groups, by_memory});
    if (tile == 0) throw UnsupportedError(device.description().name + " has too little memory for a single pixel");
    return static_cast<std::uint32_t>(tile);
}

}  // namespace tandem
