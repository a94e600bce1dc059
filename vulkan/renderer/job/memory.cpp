#include "vulkan/renderer/job/memory.h"

#include "vulkan/core/device_selection.h"
#include "vulkan/renderer/job/job_settings.h"
#include "vulkan/renderer/kernels/frame_resources.h"
#include "vulkan/renderer/kernels/kernel_shape.h"
#include "vulkan/renderer/scene/gpu_layout.h"
#include "vulkan/renderer/scene/world_boxes.h"

namespace tandem {

namespace {

// What the host flattens and sends: vertices, primitives and images.
std::uint64_t sent_bytes(const Scene& scene, std::uint64_t primitives) {
    std::uint64_t texels = 0;
    for (const Texture& texture : scene.textures)
        if (texture.image) texels += std::uint64_t{texture.image->width} * texture.image->height;
    if (scene.background.image) texels += std::uint64_t{scene.background.image->width} * scene.background.image->height;
    return scene.vertices.size() * sizeof(gpu::Vec4) +
           primitives * (sizeof(gpu::PrimitiveSource) + sizeof(gpu::Placed)) + texels * sizeof(gpu::Vec3);
}

// A path that keeps all that paths can; none where whole paths are traced.
std::optional<PathState> most_kept(KernelShape shape) {
    if (traces_whole_paths(shape)) return std::nullopt;
    return PathState{.next_events = true, .radiance = true, .interiors = true};
}

}  // namespace

std::uint64_t nodes_of(const PlacedCounts& counts) { return counts.all() + counts.mesh_triangles + counts.places; }

MemoryForecast memory_forecast(const Device& device, const Scene& scene, const RenderSettings& settings,
    KernelShape shape, GeometryPrecision precision, std::uint64_t pixels) {
    const bool in_double = precision != GeometryPrecision::single_precision;
    const PlacedCounts placed =
        placed_counts(scene, placed_meshes(scene, with_possible_instancing(settings, precision, shape)));
    const std::uint64_t n = nodes_of(placed), nodes = n * sizeof(gpu::BvhNode);
    const std::uint64_t sent = sent_bytes(scene, n) + scene.entities.size() * sizeof(gpu::EntityTransform);
    const std::uint64_t world =
        in_double ? placed.triangles * sizeof(gpu::DoubleTriangle) +
                        (placed.spheres + placed.cuboids) * sizeof(gpu::DoubleConvex)
                  : placed.triangles * sizeof(gpu::Triangle) + (placed.spheres + placed.cuboids) * sizeof(gpu::Convex);
    const bool shares_memory = device.description().type == DeviceType::cpu;
    // The host's own, what is staged, and the device's.
    const std::uint64_t copies = shares_memory ? 3 : 2;
    MemoryForecast forecast;
    forecast.tables = copies * sent + (in_double ? copies : shares_memory ? 1 : 0) * world;
    forecast.trees = copies * nodes;
    // Boxes, and their order, while the tree grows.
    forecast.building = n * (sizeof(Box) + sizeof(std::uint32_t));
    const std::optional<PathState> kept = most_kept(shape);
    constexpr std::uint64_t sums = channel_count * sizeof(gpu::Vec4);
    forecast.job_pixel = sums + sizeof(std::uint32_t);  // downloaded ones, and the list of pixels
    const std::uint32_t tile = tile_size(device, std::max<std::uint64_t>(1, pixels), kept);
    if (tile < pixels) forecast.pass_pixel = 2 * sums;  // tiles take turns: their sums, and those of the pass in hand
    if (shares_memory) forecast.workers = std::uint64_t{tile} * (bytes_per_pixel(kept) + sizeof(std::uint32_t));
    return forecast;
}

}  // namespace tandem
