#include "vulkan/renderer/scene/traced_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "vulkan/command/barrier.h"
#include "vulkan/command/submission.h"
#include "vulkan/renderer/kernels/kernel_shape.h"
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

// A medium scatters rays anywhere. Those that begin farther away than so many diagonals of the box around everything
// are left to trees (shaders/geometry/traced_rays.glsl).
constexpr double most_diagonals = 16.0;

// The greatest coordinate of any ray's origin that counts: those of the camera, of surfaces, and of media.
double farthest_origin(const Scene& scene, const std::vector<Box>& boxes, double in_media) {
    const auto greatest = [](const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); };
    const Camera& camera = scene.camera;
    double farthest = greatest(camera.position) + greatest(camera.position_motion) + camera.lens_radius;
    for (const Box& box : boxes) farthest = std::max({farthest, greatest(box.low), greatest(box.high)});
    return std::max(farthest, in_media);
}

std::size_t kind_of(const SceneData& data, std::size_t slot) {
    return slot < data.triangle_count ? 0 : slot < data.triangle_count + data.sphere_count ? 1 : 2;
}

vk::DeviceAddress address_of(const Device& device, const BufferGroup& group, std::size_t part) {
    return device.handle().getBufferAddress(vk::BufferDeviceAddressInfo(group[part])) + group.offset(part);
}

// Parts of the inputs, after the boxes of each kind.
constexpr std::size_t corners_part = 3, instances_part = 4, most_instances = 2;

BufferGroup make_inputs(const Device& device, const TracedGeometry& geometry) {
    const vk::BufferUsageFlags usage = Usage::eAccelerationStructureBuildInputReadOnlyKHR | Usage::eShaderDeviceAddress;
    std::vector<std::span<const std::byte>> parts;
    for (const std::vector<vk::AabbPositionsKHR>& kind : geometry.boxes)
        parts.push_back(std::as_bytes(std::span(kind)));
    parts.push_back(std::as_bytes(std::span(geometry.corners)));
    std::vector<BufferSpec> specs;
    for (const std::span<const std::byte> part : parts) specs.push_back({part.size(), usage});
    specs.push_back({most_instances * sizeof(vk::AccelerationStructureInstanceKHR), usage});
    BufferGroup inputs(device, MemoryDomain::mapped, specs);
    for (std::size_t i = 0; i < parts.size(); ++i)
        if (!parts[i].empty()) std::memcpy(inputs.mapped(i), parts[i].data(), parts[i].size());
    return inputs;
}

vk::AccelerationStructureBuildGeometryInfoKHR build_info(
    Type type, std::span<const vk::AccelerationStructureGeometryKHR> geometries) {
    return vk::AccelerationStructureBuildGeometryInfoKHR(type,
        vk::BuildAccelerationStructureFlagBitsKHR::ePreferFastTrace, vk::BuildAccelerationStructureModeKHR::eBuild, {},
        {}, static_cast<std::uint32_t>(geometries.size()), geometries.data());
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

// The corners of triangles at rest, rounded as little as may be.
std::vector<gpu::Vec3> corners_at_rest(const Scene& scene, const SceneData& data, const PlacedPrimitives& all) {
    std::vector<gpu::Vec3> corners;
    for (std::size_t slot = 0; slot < data.triangle_count; ++slot) {
        const PlacedPrimitive placed = all[data.placed[slot].id];
        const Entity& entity = scene.entities[placed.entity];
        for (std::size_t i = 0; i < 3; ++i) {
            const glm::dvec3& vertex = scene.vertices[scene.primitives[placed.primitive].index[i]];
            const glm::vec3 p = entity.motion == glm::dvec3(0.0)
                                    ? glm::vec3(entity.object_to_world * glm::dvec4(vertex, 1.0))
                                    : glm::vec3(NAN);
            corners.push_back({p.x, p.y, p.z});
        }
    }
    return corners;
}

}  // namespace

std::string untraceable(KernelShape shape, const RenderSettings& settings) {
    if (has_device_triangles(shape) && settings.intersection.triangles != TriangleKernel::watertight)
        return "the device's own test of triangles takes the place of --triangle-test; use --kernel ray-tracing or "
               "ray-query, or leave --triangle-test out";
    return {};
}

TracedGeometry traced_geometry(const Scene& scene, const SceneData& data, EffectSet effects, bool device_triangles) {
    const PlacedPrimitives all = placed_primitives(scene);
    std::vector<Box> boxes;
    for (const gpu::Placed& placed : data.placed) boxes.push_back(world_box(scene, all[placed.id]));
    const double in_media = effects.has(Effect::medium_scattering) ? most_diagonals * double{data.header.extent} : 0.0;
    const glm::dvec3 padding(origin_padding * farthest_origin(scene, boxes, in_media));
    TracedGeometry result;
    for (std::size_t slot = 0; slot < boxes.size(); ++slot)
        result.boxes[kind_of(data, slot)].push_back(
            rounded_outwards(boxes[slot].low - padding, boxes[slot].high + padding));
    if (!device_triangles || data.triangle_count == 0) return result;
    result.corners = corners_at_rest(scene, data, all);
    std::vector<vk::AabbPositionsKHR>& moving = result.boxes[0];
    for (std::size_t slot = 0; slot < moving.size(); ++slot)
        if (!std::isnan(result.corners[3 * slot].x)) moving[slot].minX = NAN;
    if (std::ranges::all_of(moving, [](const vk::AabbPositionsKHR& box) { return std::isnan(box.minX); }))
        moving.clear();
    else if (std::ranges::none_of(moving, [](const vk::AabbPositionsKHR& box) { return std::isnan(box.minX); }))
        result.corners.clear();
    return result;
}

TracedWorld::Level TracedWorld::make_level(const Device& device, Type type,
    std::vector<vk::AccelerationStructureGeometryKHR> geometries, std::vector<std::uint32_t> counts) {
    const vk::AccelerationStructureBuildSizesInfoKHR sizes = device.handle().getAccelerationStructureBuildSizesKHR(
        vk::AccelerationStructureBuildTypeKHR::eDevice, build_info(type, geometries), counts);
    BufferGroup storage(device, MemoryDomain::device,
        std::array{BufferSpec{
            sizes.accelerationStructureSize, Usage::eAccelerationStructureStorageKHR | Usage::eShaderDeviceAddress}});
    vk::raii::AccelerationStructureKHR structure(device.handle(),
        vk::AccelerationStructureCreateInfoKHR({}, storage[0], 0, sizes.accelerationStructureSize, type));
    return {type, std::move(geometries), std::move(counts), sizes.buildScratchSize, std::move(storage),
        std::move(structure)};
}

// Boxes are not opaque: the tests of primitives decide.
std::vector<TracedWorld::Level> TracedWorld::make_bottom(
    const Device& device, const BufferGroup& inputs, const TracedGeometry& geometry) {
    std::vector<vk::AccelerationStructureGeometryKHR> boxes;
    std::vector<std::uint32_t> counts;
    for (std::size_t kind = 0; kind < geometry.boxes.size(); ++kind) {
        boxes.emplace_back(
            vk::GeometryTypeKHR::eAabbs, vk::AccelerationStructureGeometryAabbsDataKHR(
                                             address_of(device, inputs, kind), sizeof(vk::AabbPositionsKHR)));
        counts.push_back(static_cast<std::uint32_t>(geometry.boxes[kind].size()));
    }
    std::vector<Level> bottom;
    bottom.push_back(make_level(device, Type::eBottomLevel, std::move(boxes), std::move(counts)));
    if (geometry.corners.empty()) return bottom;
    const auto corners = static_cast<std::uint32_t>(geometry.corners.size());
    const vk::AccelerationStructureGeometryTrianglesDataKHR triangles(vk::Format::eR32G32B32Sfloat,
        address_of(device, inputs, corners_part), sizeof(gpu::Vec3), corners - 1, vk::IndexType::eNoneKHR);
    bottom.push_back(make_level(device, Type::eBottomLevel,
        {{vk::GeometryTypeKHR::eTriangles, triangles, vk::GeometryFlagBitsKHR::eOpaque}}, {corners / 3}));
    return bottom;
}

// In world space. Hit group i is that of the boxes of kind i, the last is the triangles'.
TracedWorld::Level TracedWorld::make_top(
    const Device& device, const BufferGroup& inputs, const std::vector<Level>& bottom) {
    std::vector<vk::AccelerationStructureInstanceKHR> instances(bottom.size());
    std::uint32_t hit_groups = 0;
    for (std::size_t i = 0; i < bottom.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) instances[i].transform.matrix[axis][axis] = 1.0F;
        instances[i].mask = 0xff;
        instances[i].setInstanceShaderBindingTableRecordOffset(hit_groups);
        instances[i].accelerationStructureReference = device.handle().getAccelerationStructureAddressKHR(
            vk::AccelerationStructureDeviceAddressInfoKHR(*bottom[i].structure));
        hit_groups += static_cast<std::uint32_t>(bottom[i].geometries.size());
    }
    std::memcpy(inputs.mapped(instances_part), instances.data(), std::as_bytes(std::span(instances)).size());
    return make_level(device, Type::eTopLevel,
        {{vk::GeometryTypeKHR::eInstances,
            vk::AccelerationStructureGeometryInstancesDataKHR(false, address_of(device, inputs, instances_part))}},
        {static_cast<std::uint32_t>(bottom.size())});
}

void TracedWorld::record_build(const vk::raii::CommandBuffer& commands, const Level& level, vk::DeviceAddress scratch) {
    vk::AccelerationStructureBuildGeometryInfoKHR info = build_info(level.type, level.geometries);
    info.setDstAccelerationStructure(*level.structure).setScratchData(vk::DeviceOrHostAddressKHR(scratch));
    std::vector<vk::AccelerationStructureBuildRangeInfoKHR> ranges;
    for (const std::uint32_t count : level.counts) ranges.emplace_back(count, 0, 0, 0);
    const vk::AccelerationStructureBuildRangeInfoKHR* const first = ranges.data();
    commands.buildAccelerationStructuresKHR(info, first);
    // The next has the same scratch memory, which is read and written as structures are; kernels read all of them.
    barrier(
        commands, acceleration_write, {acceleration_read.stage, acceleration_read.access | acceleration_write.access});
}

TracedWorld::TracedWorld(const Device& device, const TracedGeometry& geometry, vk::DescriptorSetLayout set)
    : inputs_(make_inputs(device, geometry)),
      bottom_(make_bottom(device, inputs_, geometry)),
      top_(make_top(device, inputs_, bottom_)),
      descriptors_(make_descriptors(device, set, top_.structure)) {
    using Properties = vk::PhysicalDeviceAccelerationStructurePropertiesKHR;
    const vk::DeviceSize alignment = device.physical()
                                         .getProperties2<vk::PhysicalDeviceProperties2, Properties>()
                                         .get<Properties>()
                                         .minAccelerationStructureScratchOffsetAlignment;
    vk::DeviceSize bytes = top_.scratch_bytes;
    for (const Level& level : bottom_) bytes = std::max(bytes, level.scratch_bytes);
    const BufferGroup scratch(device, MemoryDomain::device,
        std::array{BufferSpec{bytes + alignment, Usage::eStorageBuffer | Usage::eShaderDeviceAddress}});
    const vk::DeviceAddress begin = (address_of(device, scratch, 0) + alignment - 1) / alignment * alignment;
    Submission submission(device, {});
    submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
        for (const Level& level : bottom_) record_build(commands, level, begin);
        record_build(commands, top_, begin);
    });
    (void)submission.run();
}

}  // namespace tandem
