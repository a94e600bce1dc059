#include "vulkan/renderer/job/ray_batch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>

#include "common/error.h"
#include "common/rounding.h"
#include "common/stopwatch.h"
#include "vulkan/command/barrier.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/renderer/job/job_settings.h"
#include "vulkan/renderer/scene/double_geometry.h"

namespace tandem {

namespace {

constexpr std::uint32_t most_rays = 16384;                 // at a time
constexpr std::array<std::size_t, 3> ray_inputs{0, 1, 2};  // of the Rays set (shaders/kernels/ray_batch.comp)
constexpr std::array<std::size_t, 4> ray_outputs{5, 6, 7, 8};
constexpr PathState all_buffers{true, true, false};
constexpr std::uint32_t no_slot = 0x07ffffffu, ray_inside = 1u << 27;

std::vector<BufferSpec> host_specs(std::size_t count, std::size_t element, vk::BufferUsageFlags usage) {
    return std::vector<BufferSpec>(count, BufferSpec{most_rays * element, usage});
}

SceneData flatten_for_rays(
    const Scene& scene, const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision) {
    SceneData result = flatten(scene, with_possible_instancing(settings, precision, std::nullopt), acceleration);
    if (precision != GeometryPrecision::single_precision)
        result.in_double = place_in_double(scene, settings, result, precision == GeometryPrecision::mixed);
    return result;
}

Specialisation specialise(const SceneData& scene, const IntersectionSettings& chosen, GeometryPrecision precision) {
    Specialisation result;
    result.hands_on_floats = precision == GeometryPrecision::mixed;
    result.path = all_buffers;
    if (scene.triangle_count > 0 || scene.has_meshes()) result.effects = result.effects.with(Effect::triangles);
    if (scene.sphere_count > 0) result.effects = result.effects.with(Effect::spheres);
    if (scene.cuboid_count > 0) result.effects = result.effects.with(Effect::cuboids);
    result.triangles = result.spheres = result.cuboids = told_at_run_time;
    result.triangle_root = scene.trees.triangles;
    result.sphere_root = scene.trees.spheres;
    result.cuboid_root = scene.trees.cuboids;
    result.mesh_root = scene.trees.meshes;
    result.first_mesh_slot = scene.meshes.first_slot;
    result.place_count = scene.meshes.places;
    result.intersection = chosen;
    return result;
}

// The direction as it is where of unit length, else normalised, scaled before its square could overflow (ray_batch.h).
glm::dvec3 direction_of(const GivenRay& ray) {
    const glm::dvec3 d = ray.direction;
    if (std::abs(glm::length(d) - 1.0) <= 1e-6) return d;
    const double size = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    return std::isfinite(size) && size > 0.0 ? glm::normalize(d / size) : glm::dvec3(0.0);
}

template <class Vec4>
using Real = decltype(Vec4::x);

template <class Vec4>
Vec4 packed(const glm::dvec3& v, Real<Vec4> w) {
    return {static_cast<Real<Vec4>>(v.x), static_cast<Real<Vec4>>(v.y), static_cast<Real<Vec4>>(v.z), w};
}

template <class Vec4>
glm::dvec3 unpacked(const Vec4& v) {
    return {double{v.x}, double{v.y}, double{v.z}};
}

// Words travel as their bits in floats and as numbers in doubles, which hold them.
template <class Vec4>
Real<Vec4> packed_word(std::uint32_t word) {
    if constexpr (sizeof(Real<Vec4>) == 4)
        return std::bit_cast<float>(word);
    else
        return static_cast<double>(word);
}
std::uint32_t word_of(float w) { return std::bit_cast<std::uint32_t>(w); }
std::uint32_t word_of(double w) { return static_cast<std::uint32_t>(w); }

// What single precision makes of a ray.
GivenRay as_floats(GivenRay ray) {
    ray.origin = rounded_to_single(ray.origin);
    ray.direction = rounded_to_single(ray.direction);
    ray.t_min = rounded_to_single(ray.t_min);
    ray.t_max = rounded_to_single(ray.t_max);
    return ray;
}

RayHit as_floats(RayHit hit) {
    hit.t = rounded_to_single(hit.t);
    for (glm::dvec3* v : {&hit.point, &hit.normal, &hit.leaving_front, &hit.leaving_back}) *v = rounded_to_single(*v);
    return hit;
}

// The kernel is never handed a NaN: what a driver makes of one in a comparison is its own affair.
bool is_sound(const GivenRay& ray) {
    const glm::dvec3& o = ray.origin;
    return std::isfinite(o.x + o.y + o.z) && !std::isnan(ray.t_min) && !std::isnan(ray.t_max) && ray.t_min <= ray.t_max;
}

}  // namespace

void check_kernels(const IntersectionSettings& chosen) {
    if (chosen.triangles == TriangleKernel::embree || chosen.triangles == TriangleKernel::embree_robust)
        throw UnsupportedError(
            "the Vulkan renderer has no triangle tests of Embree's, which runs on CPUs; use another --triangle-test, "
            "or the cpu backend");
}

VulkanIntersector::VulkanIntersector(const Instance& instance, const Device& device, Stages& stages, const Scene& scene,
    const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision)
    : instance_(instance),
      precision_(precision),
      element_(precision == GeometryPrecision::single_precision ? sizeof(gpu::Vec4) : sizeof(gpu::DoubleVec4)),
      scene_((check_kernels(settings.intersection), flatten_for_rays(scene, settings, acceleration, precision))),
      pipelines_(scene_.in_double ? stages.double_ray_pipelines(specialise(scene_, settings.intersection, precision))
                                  : stages.ray_pipelines(specialise(scene_, settings.intersection, precision))),
      resources_(device, scene_, all_buffers, 0, static_cast<std::uint32_t>(most_rays * element_ / sizeof(gpu::Vec4)),
          MemoryLayout::per_set),
      bindings_(device, stages.layout(), resources_),
      upload_(
          device, MemoryDomain::upload, host_specs(ray_inputs.size(), element_, vk::BufferUsageFlagBits::eTransferSrc)),
      readback_(device, MemoryDomain::readback,
          host_specs(ray_outputs.size(), element_, vk::BufferUsageFlagBits::eTransferDst)),
      submission_(device, VulkanPatterns{}),
      slots_(scene_.primitives() + scene_.meshes.placed_triangles, no_slot) {
    for (std::uint32_t slot = 0; slot < scene_.primitives(); ++slot) slots_[scene_.placed[slot].id] = slot;
    for (std::uint32_t place = 0; place < scene_.meshes.places; ++place) {
        const std::size_t at = scene_.meshes.first_slot + place;
        const std::uint32_t first = scene_.sources[at].index1, end = place + 1 < scene_.meshes.places
                                                                         ? scene_.sources[at + 1].index1
                                                                         : static_cast<std::uint32_t>(slots_.size());
        for (std::uint32_t slot = first; slot < end; ++slot) slots_[scene_.placed[at].id + (slot - first)] = slot;
    }
    place_scene();
}

void VulkanIntersector::place_scene() {
    const std::uint32_t count = scene_.triangle_count + scene_.sphere_count + scene_.cuboid_count;
    resources_.write_scene();
    submission_.add({}, [=, this](const vk::raii::CommandBuffer& commands) {
        resources_.record_upload(commands);
        barrier(commands, transfer_write, compute_access);
        if (count == 0 || scene_.in_double) return;
        gpu::Settings settings;
        settings.triangle_count = scene_.triangle_count;
        settings.sphere_count = scene_.sphere_count;
        settings.cuboid_count = scene_.cuboid_count;
        commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipelines_->vertex);
        bindings_.bind(commands, settings, 0, 0);
        commands.dispatch((count + workgroup_size - 1) / workgroup_size, 1, 1);
    });
    (void)submission_.run();
    instance_.log().raise();
}

template <class Vec4>
void VulkanIntersector::stage(std::span<const GivenRay> rays) {
    const auto write = [&](std::size_t buffer, std::size_t i, const Vec4& value) {
        std::memcpy(upload_.mapped(buffer) + i * sizeof value, &value, sizeof value);
    };
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool sound = is_sound(rays[i]);
        GivenRay ray = rays[i];
        ray.direction = sound ? direction_of(ray) : glm::dvec3(0.0);
        if (precision_ == GeometryPrecision::mixed) ray = as_floats(ray);
        constexpr double farthest = std::numeric_limits<Real<Vec4>>::max();
        const auto distance = [&](double t) { return static_cast<Real<Vec4>>(sound ? std::min(t, farthest) : 0.0); };
        std::uint32_t word = ray.left_primitive < slots_.size() ? slots_[ray.left_primitive] : no_slot;
        if (ray.inside) word |= ray_inside;
        write(0, i, packed<Vec4>(sound ? ray.origin : glm::dvec3(0.0), packed_word<Vec4>(word)));
        write(1, i, packed<Vec4>(ray.direction, 0));
        write(2, i, {distance(ray.t_min), distance(ray.t_max), 0, 0});
    }
}

template <class Vec4>
void VulkanIntersector::fetch(std::span<RayHit> hits) const {
    const auto read = [&](std::size_t buffer, std::size_t i) {
        Vec4 value;
        std::memcpy(&value, readback_.mapped(buffer) + i * sizeof value, sizeof value);
        return value;
    };
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const Vec4 point = read(0, i), normal = read(1, i);
        const std::uint32_t id = word_of(normal.w);
        if (id == no_index) continue;
        hits[i] = {double{point.w}, id, unpacked(point), unpacked(normal), unpacked(read(2, i)), unpacked(read(3, i))};
        if (precision_ == GeometryPrecision::mixed) hits[i] = as_floats(hits[i]);
    }
}

// Uploads, traces and downloads `count` rays; returns the device's seconds of tracing, or NaN without a clock.
double VulkanIntersector::trace(std::uint32_t count) {
    const vk::DeviceSize bytes = count * element_;
    submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
        for (std::size_t i = 0; i < ray_inputs.size(); ++i)
            commands.copyBuffer(upload_[i], resources_.ray_buffer(ray_inputs[i]).buffer,
                vk::BufferCopy(upload_.offset(i), resources_.ray_buffer(ray_inputs[i]).offset, bytes));
        barrier(commands, transfer_write, compute_access);
    });
    (void)submission_.run();
    submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
        gpu::Settings settings;
        settings.pixel_count = count;
        settings.triangle_count = scene_.triangle_count;
        settings.sphere_count = scene_.sphere_count;
        settings.cuboid_count = scene_.cuboid_count;
        barrier(commands, compute_write, compute_access);
        commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipelines_->ray_batch);
        bindings_.bind(commands, settings, 0, 0);
        commands.dispatch((count + workgroup_size - 1) / workgroup_size, 1, 1);
        barrier(commands, compute_write, transfer_read);
    });
    const std::optional<double> seconds = submission_.run().device;
    submission_.add({}, [&](const vk::raii::CommandBuffer& commands) {
        for (std::size_t i = 0; i < ray_outputs.size(); ++i)
            commands.copyBuffer(resources_.ray_buffer(ray_outputs[i]).buffer, readback_[i],
                vk::BufferCopy(resources_.ray_buffer(ray_outputs[i]).offset, readback_.offset(i), bytes));
        barrier(commands, transfer_write, host_read);
    });
    (void)submission_.run();
    instance_.log().raise();
    return seconds.value_or(std::numeric_limits<double>::quiet_NaN());
}

RayHits VulkanIntersector::intersect(std::span<const GivenRay> rays) {
    RayHits result;
    result.hits.resize(rays.size());
    double device_seconds = 0.0;
    for (std::size_t first = 0; first < rays.size(); first += most_rays) {
        const std::size_t count = std::min<std::size_t>(most_rays, rays.size() - first);
        scene_.in_double ? stage<gpu::DoubleVec4>(rays.subspan(first, count))
                         : stage<gpu::Vec4>(rays.subspan(first, count));
        const Stopwatch watch;
        device_seconds += trace(static_cast<std::uint32_t>(count));
        result.seconds += watch.seconds();
        const std::span hits = std::span(result.hits).subspan(first, count);
        scene_.in_double ? fetch<gpu::DoubleVec4>(hits) : fetch<gpu::Vec4>(hits);
    }
    if (std::isfinite(device_seconds)) result.device_seconds = device_seconds;
    return result;
}

}  // namespace tandem
