// Where buffers live: what it costs to allocate them so, and what to use them.
#include "common/error.h"
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

struct NamedLayout {
    const char *name, *text;
    MemoryLayout layout;
};

constexpr std::array<NamedLayout, 7> layouts{{
    {"per-set", "one allocation a descriptor set: the thesis's cohesive memory", MemoryLayout::per_set},
    {"per-buffer", "one allocation a buffer: the thesis's split memory", MemoryLayout::per_buffer},
    {"dedicated", "one dedicated allocation a buffer (VkMemoryDedicatedAllocateInfo)", MemoryLayout::dedicated},
    {"one-block", "one allocation for all buffers of a domain", MemoryLayout::one_block},
    {"one-buffer", "one buffer a descriptor set, its parts told apart by offsets", MemoryLayout::one_buffer},
    {"rays-per-set", "one allocation for ray state, one for sums, which the same kernels touch; the rest split",
        MemoryLayout::rays_per_set},
    {"others-per-set", "the reverse: ray state and sums split, the rest cohesive", MemoryLayout::others_per_set},
}};

JobPatterns patterns_of(const NamedLayout& layout) {
    JobPatterns patterns;
    patterns.vulkan.memory = layout.layout;
    return patterns;
}

struct Placement {
    const char *name, *text;
    BufferPlacement VulkanPatterns::*buffers;
    BufferPlacement place;
};

constexpr std::array<Placement, 4> placements{{
    {"host-visible", "Scene and Camera in the host's memory, which the device reads each time: the thesis's placement",
        &VulkanPatterns::scene, BufferPlacement::host_visible},
    {"mapped", "Scene and Camera in the device's own memory, written there by the host", &VulkanPatterns::scene,
        BufferPlacement::mapped},
    {"rays-host-visible", "ray state and sums in the host's memory, which kernels read and write",
        &VulkanPatterns::rays, BufferPlacement::host_visible},
    {"rays-mapped", "ray state and sums in the device's own memory, of a type that the host reaches",
        &VulkanPatterns::rays, BufferPlacement::mapped},
}};

// Throws UnsupportedError where the placement's memory is that of another one.
void check_placement(const Device& device, BufferPlacement placement) {
    using Flag = vk::MemoryPropertyFlagBits;
    constexpr vk::MemoryPropertyFlags reached = Flag::eHostVisible | Flag::eHostCoherent;
    const std::string& name = device.description().name;
    const std::uint32_t own = device.memory_type(~0u, Flag::eDeviceLocal, {}),
                        hosts = device.memory_type(~0u, reached, {});
    if (own == hosts) throw UnsupportedError(name + " has its own memory and the host's in one type");
    const std::uint32_t mapped = device.memory_type(~0u, reached, Flag::eDeviceLocal);
    if (placement == BufferPlacement::mapped && mapped == hosts)
        throw UnsupportedError("the host reaches nothing of the memory of " + name);
}

Arm placement_arm(const SharedDevice& device, const Workload& workload, const Placement& placement) {
    JobPatterns patterns;
    patterns.vulkan.*placement.buffers = placement.place;
    Arm arm = render_arm(device, workload, placement.name, placement.text, patterns);
    arm.make = [=, make = arm.make] {
        check_placement(device->device(), placement.place);
        return make();
    };
    return arm;
}

// Frames before each of which the host sends scene and camera, and the vertex stage runs.
class SentRun : public ArmRun {
public:
    SentRun(const SharedDevice& device, const RenderWork& work)
        : work_(work), job_(device->job(work.size, work.bounces, {})) {}

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        const SubmissionTimes times = job_->frame(work_.samples, true);
        return readings_of(times, steady_seconds() - start);
    }
    [[nodiscard]] std::optional<ArmOutput> output() override {
        auto estimate = std::make_shared<const Estimate>(job_->render({0, gate_samples}, {}).estimate);
        return ArmOutput{digest_of(*estimate), std::move(estimate)};
    }

private:
    RenderWork work_;
    std::unique_ptr<VulkanJob> job_;
};

// The thesis's frame in its cohesive and its split memory.
JobPatterns thesis_in(MemoryLayout layout) {
    JobPatterns patterns = thesis_frame_patterns();
    patterns.vulkan.memory = layout;
    return patterns;
}

// Makes a job, pipelines being at hand, and renders its first frame; then one of a scene sent anew.
Arm first_frame_arm(const SharedDevice& device, const Workload& workload, std::string name, std::string text,
    const JobPatterns& patterns) {
    const RenderWork work = work_of(workload);
    const auto make_job = [=] { return device->job(work.size, work.bounces, patterns); };
    return {std::move(name), std::move(text), [=] {
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
                    (void)job->frame(work.samples, true);
                    readings["fresh-frame"] = steady_seconds() - end;
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
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const NamedLayout& layout : layouts)
            arms.push_back(render_arm(device, workload, layout.name, layout.text, patterns_of(layout)));
        for (const Placement& placement : placements) arms.push_back(placement_arm(device, workload, placement));
        arms.push_back({"sent-each-frame", "Scene and Camera sent before each frame, whose vertex stage runs again",
            [=] { return std::make_unique<SentRun>(device, work_of(workload)); }});
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
    family.base =
        "a job made anew with pipelines at hand, and its first frame, of a scene just sent; its total lasts over both";
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 1, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const NamedLayout& layout : layouts)
            arms.push_back(first_frame_arm(device, workload, layout.name, layout.text, patterns_of(layout)));
        arms.push_back(first_frame_arm(device, workload, "thesis-cohesive",
            "the thesis's frame, Scene, Camera and Settings host-visible, an allocation a descriptor set",
            thesis_in(MemoryLayout::per_set)));
        arms.push_back(first_frame_arm(
            device, workload, "thesis-split", "the same, an allocation a buffer", thesis_in(MemoryLayout::per_buffer)));
        return arms;
    };
    return family;
}

}  // namespace tandem
