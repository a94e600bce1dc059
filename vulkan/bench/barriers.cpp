// What orders the dispatches of a frame after one another.
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

struct Kind {
    const char *name, *text;
    BarrierPattern pattern;
};

constexpr std::array<Kind, 8> kinds{{
    {"memory", "one global memory barrier before each dispatch", BarrierPattern::memory},
    {"buffer", "a barrier for each buffer of ray state and sums, all in one command", BarrierPattern::buffer},
    {"buffer-apart", "the same, a command for each buffer", BarrierPattern::buffer_apart},
    {"full", "all commands, all accesses", BarrierPattern::full},
    {"execution", "no memory dependency, which Vulkan does not allow here: what visibility costs",
        BarrierPattern::execution},
    {"memory-v2", "as memory, by VK_KHR_synchronization2", BarrierPattern::memory_v2},
    {"buffer-v2", "as buffer, by VK_KHR_synchronization2", BarrierPattern::buffer_v2},
    {"event", "an event is set and waited for in place of the barrier", BarrierPattern::event},
}};

}  // namespace

Family barriers_family(const SharedDevice& device) {
    Family family;
    family.name = "barriers";
    family.question = "Which barrier should stand between two dispatches?";
    family.hypothesis = "Narrow barriers cost less than wide ones, few commands less than many";
    family.source = "AMD: batch barriers; Khronos samples: pipeline_barriers";
    family.held = "the dispatches of a frame and where they are ordered, one submission, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Kind& kind : kinds) {
            JobPatterns patterns;
            patterns.vulkan.barriers = kind.pattern;
            arms.push_back(render_arm(device, workload, kind.name, kind.text, patterns));
        }
        return arms;
    };
    return family;
}

}  // namespace tandem
