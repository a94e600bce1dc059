// How much goes into a submission, in how many pieces, and how its end is waited for.
#include <fmt/format.h>

#include "vulkan/bench/families.h"

namespace tandem {

namespace {

JobPatterns with_samples_a_submission(std::uint32_t samples, std::uint32_t bounces) {
    JobPatterns patterns;
    patterns.vulkan.segments_per_submission = samples * (bounces + 1);
    return patterns;
}

}  // namespace

Family submission_family(const SharedDevice& device) {
    Family family;
    family.name = "submission";
    family.question = "How many samples should one submission hold, and in how many pieces should they be handed over?";
    family.hypothesis = "More samples a submission lower the time of a sample, up to a limit (S1)";
    family.source = "Ferreira 2019; VComputeBench; AMD: at most 20 submits a frame";
    family.held = "the work of a frame, its command buffers, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    constexpr std::uint32_t samples = 16;
    for (const ImageSize& size : device->sizes())
        family.workloads.push_back(workload_of({size, samples, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        const std::uint32_t bounces = work_of(workload).bounces;
        std::vector<Arm> arms{
            render_arm(device, workload, "frame-a-submit", "all samples of the frame in one submission", {})};
        for (const std::uint32_t k : {1u, 2u, 4u, 8u})
            arms.push_back(render_arm(device, workload, fmt::format("{}-a-submit", k),
                fmt::format("{} sample{} a submission, each waited for", k, k == 1 ? "" : "s"),
                with_samples_a_submission(k, bounces)));
        JobPatterns bounce;
        bounce.vulkan.segments_per_submission = 1;
        arms.push_back(
            render_arm(device, workload, "bounce-a-submit", "each path segment a submission, waited for", bounce));
        JobPatterns pieces;
        pieces.vulkan.submission = SubmissionPattern::many_infos;
        arms.push_back(render_arm(
            device, workload, "many-infos", "one vkQueueSubmit with a VkSubmitInfo for each command buffer", pieces));
        pieces.vulkan.submission = SubmissionPattern::many_submits;
        arms.push_back(
            render_arm(device, workload, "many-submits", "a vkQueueSubmit for each command buffer, one wait", pieces));
        return arms;
    };
    return family;
}

Family waiting_family(const SharedDevice& device) {
    Family family;
    family.name = "waiting";
    family.question = "How should the host wait for a frame?";
    family.hypothesis = "A fence is better than waiting for the queue to be idle";
    family.source = "Khronos samples: wait_idle (22 %)";
    family.held = "the work of a frame, recording, submission, memory; one frame in flight";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        JobPatterns timeline, idle;
        timeline.vulkan.wait = WaitPattern::timeline;
        idle.vulkan.wait = WaitPattern::queue_idle;
        return std::vector<Arm>{render_arm(device, workload, "fence", "vkWaitForFences", {}),
            render_arm(device, workload, "timeline", "vkWaitSemaphores on a timeline semaphore", timeline),
            render_arm(device, workload, "queue-idle", "vkQueueWaitIdle", idle)};
    };
    return family;
}

}  // namespace tandem
