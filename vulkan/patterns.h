// Ways to use Vulkan for one and the same image: factors that the pattern benchmarks vary (vulkan/bench). The defaults
// are what `tandem render` does.
#pragma once

#include <cstdint>

namespace tandem {

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

// Whose memory buffers are in.
enum class BufferPlacement : std::uint32_t {
    device_local,  // for the device alone: what the host writes is copied there
    host_visible,  // in memory of the host, which the device reaches each time: the thesis's for Scene and Camera
    mapped,        // in the device's own memory, of a type that the host reaches too, if there is one
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

struct VulkanPatterns {
    MemoryLayout memory = MemoryLayout::per_set;
    BufferPlacement scene = BufferPlacement::device_local;  // and the camera
    BufferPlacement rays = BufferPlacement::device_local;   // and the sums
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
    QueueSlot queue = {};
};

}  // namespace tandem
