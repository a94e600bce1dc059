// Ways to trace one and the same image: factors that the pattern benchmarks vary (vulkan/bench). The defaults are what
// `tandem render` does, except for the kernel's shape (kernels/kernel_shape.h).
#pragma once

#include <cstdint>

#include "vulkan/patterns.h"

namespace tandem {

// How the work of a path is cut into kernels.
enum class KernelShape : std::uint32_t {
    stages,        // the thesis's six, as a wavefront: rays in queues from segment to segment, dispatched indirectly
    megakernel,    // whole paths, in registers, pixel by pixel
    image_stages,  // the six, each over the whole image, rays at their pixels' places
    fragment,      // the megakernel's work in the fragment shader of a render pass
    ray_tracing,   // the same in a ray-tracing pipeline, whose traversal finds hits (VK_KHR_ray_tracing_pipeline)
    thesis,        // the thesis's frame: image_stages that add samples up as paths end, and at last fill an image
    ray_tracing_triangles,  // ray_tracing, with the device's own test of triangles at rest
    ray_query,              // the megakernel's work, whose hits ray queries find (VK_KHR_ray_query)
    ray_query_triangles,    // ray_query, with the device's own test of triangles at rest
};

// How the invocations of a megakernel's dispatch come to their pixels.
enum class PixelPattern : std::uint32_t {
    automatic,  // claimed where there are no trees and the driver tells how many invocations the device holds
    one_each,   // an invocation a pixel
    claimed,    // as many as the device holds; each takes a pixel that none has begun, and another when that is done
};

// Where a megakernel reads what it must know of a primitive that was hit, which threads ask for one by one.
enum class HitDataPattern : std::uint32_t {
    automatic,  // shared, if the scene is small enough and the device no CPU
    buffers,    // storage buffers
    shared,     // copies that each workgroup makes in its shared memory
};

// Which triangles threads test in full for the closest hit, where the loop over them is unrolled.
enum class CandidatePattern : std::uint32_t {
    automatic,  // edges; on a CPU every one
    every,      // one after the other
    edges,      // those whose edges the ray passes between, the nearest plane's first
};

struct TracerTuning {
    KernelShape kernel = KernelShape::stages;
    HitDataPattern hit_data = HitDataPattern::automatic;
    CandidatePattern candidates = CandidatePattern::automatic;
    std::uint32_t workgroup = 128;  // invocations of a workgroup
    PixelPattern pixels = PixelPattern::automatic;
    std::uint32_t claimants = 0;  // invocations of a dispatch where pixels are claimed; 0: as many as the device holds
    std::uint32_t tile_pixels = 0;  // in flight at a time; 0: as many as the device takes
    // The job renders the pixels of one of so many parts of the image, row by row; the others stay empty.
    std::uint32_t part = 0, parts = 1;
    bool half_state = false;  // of Precision::half_storage: the one factor that changes the image
};

// All that may vary about a job while its image stays.
struct JobPatterns {
    VulkanPatterns vulkan;
    TracerTuning tracer;
};

}  // namespace tandem
