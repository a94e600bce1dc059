// The gain of each of our changes to the thesis's frame. The arms lead from its frame to ours, each with one more
// change.
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

struct Step {
    const char *name, *text;
    void (*change)(JobPatterns&);
};

constexpr std::array<Step, 7> steps{{
    {"thesis", "the thesis's frame, its image not shown: a recording a sample and two more", [](JobPatterns&) {}},
    {"device-local", "Scene and Camera copied to the device's own memory, Settings in it if the host can reach it",
        [](JobPatterns& p) { p.vulkan.scene = BufferPlacement::device_local; }},
    {"push-constants", "Settings pushed with the commands in place of a uniform buffer",
        [](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::push_constants; }},
    {"sums-apart", "samples kept and added to the sums by a stage of its own, and no image",
        [](JobPatterns& p) { p.tracer.kernel = KernelShape::image_stages; }},
    {"wavefront", "rays compacted in queues, dispatched indirectly: ours on CPUs",
        [](JobPatterns& p) { p.tracer.kernel = KernelShape::stages; }},
    {"megakernel", "whole paths in registers, a dispatch a frame: ours on GPUs",
        [](JobPatterns& p) { p.tracer.kernel = KernelShape::megakernel; }},
    {"pre-recorded", "its commands recorded once and submitted again, which we do not",
        [](JobPatterns& p) { p.vulkan.recording = RecordingPattern::pre_recorded; }},
}};

}  // namespace

Family thesis_steps_family(const SharedDevice& device) {
    Family family;
    family.name = "thesis-steps";
    family.question = "What is each change worth that leads from the thesis's frame to ours?";
    family.hypothesis =
        "How paths are cut into kernels matters most; placement, parameters and recording matter little";
    family.source = "Ferreira 2019";
    family.held = "the paths, the scene, one submission a frame, one allocation a descriptor set, one recording thread";
    family.base =
        "the thesis's frame, in one submission, with a fence: pre-processing, each stage over the whole image for each "
        "sample, post-processing into an image. Its total lasts from before recording to the end of the wait";
    family.along = "samples";
    for (const std::uint32_t samples : {1u, 12u})
        family.workloads.push_back(workload_of({device->sizes().back(), samples, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        JobPatterns patterns = thesis_frame_patterns();
        for (const Step& step : steps) {
            step.change(patterns);
            arms.push_back(render_arm(device, workload, step.name, step.text, patterns));
            arms.back().same_bits = patterns.tracer.kernel == KernelShape::thesis;
        }
        return arms;
    };
    return family;
}

}  // namespace tandem
