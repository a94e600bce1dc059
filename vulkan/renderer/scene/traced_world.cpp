#include "vulkan/renderer/scene/traced_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "vulkan/command/barrier.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/scene/world_boxes.h"

namespace tandem {

namespace {

using Usage = vk::BufferUsageFlagBits;
using Type = vk::AccelerationStructureTypeKHR;

// gamma(16) of shaders/geometry/bvh.glsl, which adds this part of a box's padding for the origin of the ray in hand.
// Here it must do for all origins; twice, since how a device rounds on its way to a box is its own matter.
constexpr double origin_padding = 2.0 * 9.5367523e-7;

float rounded_up(double x) {
    const auto rounded = static_cast<float>(x);
    return rounded < x ? std::nextafterf(rounded, INFINITY) : rounded;
}
float rounded_down(double x) { return -rounded_up(-x); }

vk::AabbPositionsKHR rounded_outwards(const glm::dvec3& low, const glm::dvec3& high) {
    return {rounded_down(low.x), rounded_down(low.y), rounded_down(low.z), rounded_up(high.x), rounded_up(high.y),
        rounded_up(high.z)};
}

// The greatest coordinate of any ray's origin: those of the camera, and of surfaces.
double farthest_origin(const Scene& scene, const std::vector<Box>& boxes) {
    const auto greatest = [](const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); };
    const Camera& camera = scene.camera;
    double farthest = greatest(camera.position) + greatest(camera.position_motion) + camera.lens_radius;
    for (const Box& box : boxes) farthest = std::max({farthest, greatest(box.low), greatest(box.high)});
    return farthest;
}

std::size_t kind_of(const SceneData& data, std::size_t slot) {
    return slot < data.triangle_count ? 0 : slot < data.triangle_count + data.sphere_count ? 1 : 2;
}

vk::DeviceAddress address_of(const Device& device, const BufferGroup& group, std::size_t part) {
    return device.handle().getBufferAddress(vk::BufferDeviceAddressInfo(group[part])) + group.offset(part);
}

BufferGroup make_inputs(const Device& device, const KindBoxes& boxes) {
    const vk::BufferUsageFlags usage = Usage::eAccelerationStructureBuildInputReadOnlyKHR | Usage::eShaderDeviceAddress;
    std::vector<BufferSpec> specs;
    for (const std::vector<vk::AabbPositionsKHR>& kind : boxes)
        specs.push_back({kind.size() * sizeof(vk::AabbPositionsKHR), usage});
    specs.push_back({sizeof(vk::AccelerationStructureInstanceKHR), usage});
    BufferGroup inputs(device, MemoryDomain::mapped, specs);
    for (std::size_t kind = 0; kind < boxes.size(); ++kind)
        std::memcpy(inputs.mapped(kind), boxes[kind].data(), boxes[kind].size() * sizeof(vk::AabbPositionsKHR));
    return inputs;
}

std::array<std::uint32_t, 3> counts_of(const KindBoxes& boxes) {
    std::array<std::uint32_t, 3> counts{};
    for (std::size_t kind = 0; kind < boxes.size(); ++kind)
        counts[kind] = static_cast<std::uint32_t>(boxes[kind].size());
    return counts;
}

// Not opaque: the any-hit shader decides.
std::array<vk::AccelerationStructureGeometryKHR, 3> geometries_of(const Device& device, const BufferGroup& inputs) {
    std::array<vk::AccelerationStructureGeometryKHR, 3> geometries;
    for (std::size_t kind = 0; kind < geometries.size(); ++kind)
        geometries[kind] = vk::AccelerationStructureGeometryKHR(
            vk::GeometryTypeKHR::eAabbs, vk::AccelerationStructureGeometryAabbsDataKHR(
                                             address_of(device, inputs, kind), sizeof(vk::AabbPositionsKHR)));
    return geometries;
}

// One instance, in world space: hit group i is geometry i's.
vk::AccelerationStructureGeometryKHR instance_of(
    const Device& device, const BufferGroup& inputs, const vk::raii::AccelerationStructureKHR& bottom) {
    constexpr std::size_t part = 3;
    vk::AccelerationStructureInstanceKHR instance;
    for (std::size_t i = 0; i < 3; ++i) instance.transform.matrix[i][i] = 1.0F;
    instance.mask = 0xff;
    instance.accelerationStructureReference =
        device.handle().getAccelerationStructureAddressKHR(vk::AccelerationStructureDeviceAddressInfoKHR(*bottom));
    std::memcpy(inputs.mapped(part), &instance, sizeof instance);
    return {vk::GeometryTypeKHR::eInstances,
        vk::AccelerationStructureGeometryInstancesDataKHR(false, address_of(device, inputs, part))};
}

vk::AccelerationStructureBuildGeometryInfoKHR build_info(
    Type type, std::span<const vk::AccelerationStructureGeometryKHR> geometries) {
    return vk::AccelerationStructureBuildGeometryInfoKHR(type,
        vk::BuildAccelerationStructureFlagBitsKHR::ePreferFastTrace, vk::BuildAccelerationStructureModeKHR::eBuild, {},
        {}, static_cast<std::uint32_t>(geometries.size()), geometries.data());
}

void record_build(const vk::raii::CommandBuffer& commands, Type type, vk::AccelerationStructureKHR structure,
    std::span<const vk::AccelerationStructureGeometryKHR> geometries, std::span<const std::uint32_t> counts,
    vk::DeviceAddress scratch) {
    vk::AccelerationStructureBuildGeometryInfoKHR info = build_info(type, geometries);
    info.setDstAccelerationStructure(structure).setScratchData(vk::DeviceOrHostAddressKHR(scratch));
    std::vector<vk::AccelerationStructureBuildRangeInfoKHR> ranges;
    for (const std::uint32_t count : counts) ranges.emplace_back(count, 0, 0, 0);
    const vk::AccelerationStructureBuildRangeInfoKHR* const first = ranges.data();
    commands.buildAccelerationStructuresKHR(info, first);
}

DescriptorSets make_descriptors(
    const Device& device, vk::DescriptorSetLayout layout, const vk::raii::AccelerationStructureKHR& structure) {
    using Written = vk::WriteDescriptorSetAccelerationStructureKHR;
    const SetBindings bindings{vk::DescriptorType::eAccelerationStructureKHR};
    DescriptorSets sets(device, std::array{DescriptorSets::Request{layout, bindings, {}}});
    const vk::AccelerationStructureKHR handle = *structure;
    const Written written(handle);
    vk::WriteDescriptorSet write(sets[0], 0, 0, 1, bindings[0].type);
    write.setPNext(&written);
    device.handle().updateDescriptorSets(write, {});
    return sets;
}

}  // namespace

std::string untraceable(const Scene& scene, const RenderSettings& settings) {
    const EffectSet needed = needed_effects(scene, settings);
    if (needed.has(Effect::entity_motion))
        return "intersection shaders are not told a path's time: the ray-tracing pipeline has no entity-motion";
    if (needed.has(Effect::medium_scattering) && scene.medium != no_index)
        return "the boxes of the ray-tracing pipeline are widened for rays that begin within the scene, and fog around "
               "everything has them begin anywhere";
    return {};
}

KindBoxes traced_boxes(const Scene& scene, const SceneData& data) {
    const std::vector<PlacedPrimitive> all = placed_primitives(scene);
    std::vector<Box> boxes;
    for (const gpu::Placed& placed : data.placed) boxes.push_back(world_box(scene, all[placed.id]));
    const glm::dvec3 padding(origin_padding * farthest_origin(scene, boxes));
    KindBoxes result;
    for (std::size_t slot = 0; slot < boxes.size(); ++slot)
        result[kind_of(data, slot)].push_back(rounded_outwards(boxes[slot].low - padding, boxes[slot].high + padding));
    return result;
}

TracedWorld::Level TracedWorld::make_level(const Device& device, Type type,
    std::span<const vk::AccelerationStructureGeometryKHR> geometries, std::span<const std::uint32_t> counts) {
    const vk::AccelerationStructureBuildSizesInfoKHR sizes = device.handle().getAccelerationStructureBuildSizesKHR(
        vk::AccelerationStructureBuildTypeKHR::eDevice, build_info(type, geometries), counts);
    BufferGroup storage(device, MemoryDomain::device,
        std::array{BufferSpec{
            sizes.accelerationStructureSize, Usage::eAccelerationStructureStorageKHR | Usage::eShaderDeviceAddress}});
    vk::raii::AccelerationStructureKHR structure(device.handle(),
        vk::AccelerationStructureCreateInfoKHR({}, storage[0], 0, sizes.accelerationStructureSize, type));
    return {std::move(storage), std::move(structure), sizes.buildScratchSize};
}

TracedWorld::TracedWorld(const Device& device, const KindBoxes& boxes, vk::DescriptorSetLayout set)
    : inputs_(make_inputs(device, boxes)),
      boxes_(geometries_of(device, inputs_)),
      bottom_(make_level(device, Type::eBottomLevel, boxes_, counts_of(boxes))),
      instance_(instance_of(device, inputs_, bottom_.structure)),
      top_(make_level(device, Type::eTopLevel, {&instance_, 1}, std::array{1u})),
      descriptors_(make_descriptors(device, set, top_.structure)) {
    using Properties = vk::PhysicalDeviceAccelerationStructurePropertiesKHR;
    const vk::DeviceSize alignment = device.physical()
                                         .getProperties2<vk::PhysicalDeviceProperties2, Properties>()
                                         .get<Properties>()
                                         .minAccelerationStructureScratchOffsetAlignment;
    // One after the other: they share what they need meanwhile.
    const vk::DeviceSize bytes = std::max(bottom_.scratch_bytes, top_.scratch_bytes) + alignment;
    const BufferGroup scratch(device, MemoryDomain::device,
        std::array{BufferSpec{bytes, Usage::eStorageBuffer | Usage::eShaderDeviceAddress}});
    const vk::DeviceAddress begin = (address_of(device, scratch, 0) + alignment - 1) / alignment * alignment;
    Submission submission(device, {});
    submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
        const std::array<std::uint32_t, 3> counts = counts_of(boxes);
        record_build(commands, Type::eBottomLevel, *bottom_.structure, boxes_, counts, begin);
        // The scratch memory, too, is read and written as acceleration structures are.
        barrier(commands, acceleration_write,
            {acceleration_read.stage, acceleration_read.access | acceleration_write.access});
        record_build(commands, Type::eTopLevel, *top_.structure, {&instance_, 1}, std::array{1u}, begin);
    });
    (void)submission.run();
}

}  // namespace tandem
