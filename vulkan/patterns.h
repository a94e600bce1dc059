// Ways to use Vulkan for one and the same image: the factors that the pattern benchmarks vary (vulkan/bench). But
// for the kernel's shape (renderer/kernels/kernel_shape.h) the defaults are what `tandem render` does. Images do not
// depend on them.
#pragma once

#include <cstdint>

namespace tandem {

// How the work of a path is cut into kernels.
enum class KernelShape : std::uint32_t {
    stages,        // the thesis's six, as a wavefront: rays in queues from segment to segment, dispatched indirectly
    megakernel,    // whole paths, in registers, pixel by pixel
    image_stages,  // the thesis's six as they were: each over the whole image, rays at their pixels' places
    fragment,      // the megakernel's work in the fragment shader of a render pass
    ray_tracing,   // the same in a ray-tracing pipeline, whose traversal finds hits (VK_KHR_ray_tracing_pipeline)
};

// Where buffers live.
enum class MemoryLayout : std::uint32_t {
    per_set,         // one allocation a descriptor set: the thesis's "cohesive" memory
    per_buffer,      // one allocation a buffer: its "split" memory
    dedicated,       // one allocation a buffer, which the driver is told (VkMemoryDedicatedAllocateInfo)
    one_block,       // one allocation for all buffers of a domain (device, upload, readback)
    one_buffer,      // one buffer a descriptor set, its parts told apart by offsets
    rays_per_set,    // per_set for what the same kernels touch, ray state and sums; per_buffer for the rest
    others_per_set,  // the reverse
};

enum class RecordingPattern : std::uint32_t {
    on_the_fly,    // before each submission
    pre_recorded,  // once, then submitted again and again
    secondary,     // on the fly, into secondary command buffers that one primary executes
};

// How command buffers become free again for recording on the fly.
enum class ResetPattern : std::uint32_t {
    pool,    // vkResetCommandPool
    buffer,  // vkResetCommandBuffer, one by one
    free,    // vkFreeCommandBuffers, and new ones allocated
};

// How command buffers are handed over.
enum class SubmissionPattern : std::uint32_t {
    many_buffers,  // one VkSubmitInfo that lists all command buffers
    many_infos,    // a VkSubmitInfo for each, in one vkQueueSubmit
    many_submits,  // a vkQueueSubmit for each; the fence is the last one's
};

// How the host learns that a submission has finished.
enum class WaitPattern : std::uint32_t {
    fence,
    timeline,    // a timeline semaphore (Vulkan 1.2)
    queue_idle,  // vkQueueWaitIdle
};

// What orders a dispatch after the writes of the one before.
enum class BarrierPattern : std::uint32_t {
    memory,        // one global memory barrier, compute writes to what the next dispatch does
    buffer,        // a buffer barrier for each buffer of the ray state, all in one command
    buffer_apart,  // the same, a command each
    full,          // all commands, all accesses
    execution,     // no memory dependency: Vulkan does not promise the image, a device may give it all the same
    memory_v2,     // as memory, by VK_KHR_synchronization2
    buffer_v2,     // as buffer, likewise
    event,         // an event set after the writes and waited for, with a global memory barrier
};

// How a dispatch is told what it alone is to do: the words of shaders/kernels/settings.glsl.
enum class ParameterPattern : std::uint32_t {
    push_constants,
    uniform,          // a uniform buffer, a descriptor set for each dispatch
    dynamic_uniform,  // a uniform buffer, one descriptor set with a dynamic offset
    storage,          // a storage buffer, a descriptor set for each dispatch
    device_address,   // a buffer whose address is pushed
    specialisation,   // what no dispatch of a job changes is built into its pipelines; the rest is pushed
};

// How dispatches get the descriptors that change between them: those of ray state and sums.
enum class DescriptorPattern : std::uint32_t {
    per_combination,    // a set for each combination, written once
    rewritten,          // a set for each dispatch, written when it is recorded
    templates,          // the same by update templates
    push,               // ray state by push descriptors
    arrays,             // one set with arrays of both halves, indexed by what is the same for all invocations
    arrays_nonuniform,  // the same, but declared to differ between invocations
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

// Which of the device's queues a job uses.
enum class QueueKind : std::uint32_t {
    rendering,      // of the family that a renderer takes
    compute_only,   // of one with compute and no graphics
    transfer_only,  // of one with neither; not for jobs
};
struct QueueSlot {
    QueueKind kind = QueueKind::rendering;
    std::uint32_t index = 0;  // in its family
};

struct Patterns {
    KernelShape kernel = KernelShape::stages;
    MemoryLayout memory = MemoryLayout::per_set;
    RecordingPattern recording = RecordingPattern::on_the_fly;
    ResetPattern reset = ResetPattern::pool;
    bool one_time_submit = true;  // the flag on command buffers recorded on the fly
    std::uint32_t recording_threads = 1;
    std::uint32_t recordings_per_buffer = 1;  // a sample's path segments, or its accumulation, is one recording
    SubmissionPattern submission = SubmissionPattern::many_buffers;
    // Path segments in one submission, over one or several samples. 0: in render() what takes 0.1 to 0.3 s, in frame()
    // all of a frame.
    std::uint32_t segments_per_submission = 0;
    WaitPattern wait = WaitPattern::fence;
    BarrierPattern barriers = BarrierPattern::memory;
    ParameterPattern parameters = ParameterPattern::push_constants;
    DescriptorPattern descriptors = DescriptorPattern::per_combination;
    HitDataPattern hit_data = HitDataPattern::automatic;
    CandidatePattern candidates = CandidatePattern::automatic;
    QueueSlot queue = {};
    std::uint32_t workgroup = 128;  // invocations of a workgroup
    PixelPattern pixels = PixelPattern::automatic;
    std::uint32_t claimants = 0;  // invocations of a dispatch where pixels are claimed; 0: as many as the device holds
    std::uint32_t tile_pixels = 0;  // in flight at a time; 0: as many as the device takes
    // The job renders the pixels of one of so many parts of the image, row by row; the others stay empty.
    std::uint32_t part = 0, parts = 1;
};

}  // namespace tandem
