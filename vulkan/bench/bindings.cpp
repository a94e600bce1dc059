// How dispatches get their parameters and their descriptors.
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

struct Parameters {
    const char *name, *text;
    ParameterPattern pattern;
};

constexpr std::array<Parameters, 6> parameters{{
    {"push-constants", "push constants before each dispatch", ParameterPattern::push_constants},
    {"uniform", "a uniform buffer, a descriptor set for each dispatch", ParameterPattern::uniform},
    {"dynamic-uniform", "a uniform buffer, one set with a dynamic offset for each dispatch",
        ParameterPattern::dynamic_uniform},
    {"storage", "a storage buffer, a descriptor set for each dispatch", ParameterPattern::storage},
    {"device-address", "a buffer, whose address for each dispatch is pushed", ParameterPattern::device_address},
    {"specialisation", "nine words that no dispatch changes are specialisation constants, the rest is pushed",
        ParameterPattern::specialisation},
}};

struct Descriptors {
    const char *name, *text;
    DescriptorPattern pattern;
};

constexpr std::array<Descriptors, 6> descriptors{{
    {"per-combination", "a set for each combination of halves, written once", DescriptorPattern::per_combination},
    {"rewritten", "sets of ray state and sums are written for each dispatch (vkUpdateDescriptorSets)",
        DescriptorPattern::rewritten},
    {"templates", "the same by descriptor update templates", DescriptorPattern::templates},
    {"push", "ray state by push descriptors for each dispatch", DescriptorPattern::push},
    {"arrays", "both halves in one set as arrays, by an index that all invocations share; no restrict",
        DescriptorPattern::arrays},
    {"arrays-nonuniform", "the same, the index declared to differ between invocations",
        DescriptorPattern::arrays_nonuniform},
}};

}  // namespace

Family parameters_family(const SharedDevice& device) {
    Family family;
    family.name = "parameters";
    family.question = "How should a dispatch be told its parameters?";
    family.hypothesis = "Push constants beat bindings; constants known to the compiler beat both";
    family.source = "VComputeBench; denied by Khronos on Mali; Khronos samples: specialization_constants (+4.4 %)";
    family.held = "the dispatches of a frame, their parameters' values, one submission, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Parameters& kind : parameters) {
            JobPatterns patterns;
            patterns.vulkan.parameters = kind.pattern;
            arms.push_back(render_arm(device, workload, kind.name, kind.text, patterns));
        }
        return arms;
    };
    return family;
}

Family descriptors_family(const SharedDevice& device) {
    Family family;
    family.name = "descriptors";
    family.question = "How should dispatches get descriptors that change from one to the next?";
    family.hypothesis =
        "A set for each combination, written once, is the cheapest; few re-updated sets cost no more (S2)";
    family.source = "Ferreira 2019; Khronos samples: descriptor_management; vkoverhead";
    family.held = "the dispatches of a frame, the buffers, one submission, memory, one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes()) family.workloads.push_back(workload_of({size, 4, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        for (const Descriptors& kind : descriptors) {
            JobPatterns patterns;
            patterns.vulkan.descriptors = kind.pattern;
            arms.push_back(render_arm(device, workload, kind.name, kind.text, patterns));
        }
        return arms;
    };
    return family;
}

}  // namespace tandem
