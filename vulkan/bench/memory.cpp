// Where buffers live: what it costs to allocate them so, and what to use them.
#include <span>

#include "vulkan/bench/families.h"

namespace tandem {

namespace {

struct Layout {
    const char *name, *text;
    MemoryLayout layout;
};

constexpr std::array<Layout, 7> layouts{{
    {"per-set", "one allocation a descriptor set: the thesis's cohesive memory", MemoryLayout::per_set},
    {"per-buffer", "one allocation a buffer: the thesis's split memory", MemoryLayout::per_buffer},
    {"dedicated", "one dedicated allocation a buffer (VkMemoryDedicatedAllocateInfo)", MemoryLayout::dedicated},
    {"one-block", "one allocation for all buffers of a domain", MemoryLayout::one_block},
    {"one-buffer", "one buffer a descriptor set, its parts told apart by offsets", MemoryLayout::one_buffer},
    {"rays-per-set", "one allocation for ray state, one for sums, which the same kernels touch; the rest split",
        MemoryLayout::rays_per_set},
    {"others-per-set", "the reverse: ray state and sums split, the rest cohesive", MemoryLayout::others_per_set},
}};

JobPatterns patterns_of(const Layout& layout) {
    JobPatterns patterns;
    patterns.vulkan.memory = layout.layout;
    return patterns;
}

// Makes a job, pipelines being at hand, and renders its first frame.
Arm first_frame_arm(const SharedDevice& device, const Workload& workload, const Layout& layout) {
    const RenderWork work = work_of(workload);
    const auto make_job = [=] { return device->job(work.size, work.bounces, patterns_of(layout)); };
    return {layout.name, layout.text, [=] {
                (void)make_job();  // a layout that the device cannot have is refused here
                return run_of([=] {
                    const double start = steady_seconds();
                    const std::unique_ptr<VulkanJob> job = make_job();
                    const double made = steady_seconds();
                    const SubmissionTimes times = job->frame(work.samples, true);
                    const double end = steady_seconds();
                    ClockReadings readings = readings_of(times, end - start);
                    readings["prepare"] = made - start;
                    readings["first-frame"] = end - made;
                    return readings;
                });
            }};
}

}  // namespace

Family memory_family(const SharedDevice& device) {
    Family family;
    family.name = "memory";
    family.question = "Does it matter to steady frames how many allocations hold the buffers?";
    family.hypothesis = "Steady frames do not depend on it (M2); many small allocations cost";
    family.source = "Ferreira 2019; best-practice layers";
    family.held = "scene, buffers and their sizes, descriptor sets, recording, submission";
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Layout& layout : layouts)
            arms.push_back(render_arm(device, workload, layout.name, layout.text, patterns_of(layout)));
        return arms;
    };
    return family;
}

Family fresh_memory_family(const SharedDevice& device) {
    Family family;
    family.name = "memory-fresh";
    family.question = "What do allocations cost where buffers are made anew, and the first frame in them?";
    family.hypothesis = "The first frame is much slower with split memory than with cohesive (M1)";
    family.source = "Ferreira 2019";
    family.held = "scene, pipelines (made before), buffers and their sizes, recording, submission";
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Layout& layout : std::span(layouts).first(5))
            arms.push_back(first_frame_arm(device, workload, layout));
        return arms;
    };
    return family;
}

}  // namespace tandem
