// How command buffers are recorded: when, at which level, how they are freed again, by how many threads.
#include <fmt/format.h>

#include <algorithm>

#include "common/processors.h"
#include "vulkan/bench/families.h"

namespace tandem {

Family recording_family(const SharedDevice& device) {
    Family family;
    family.name = "recording";
    family.question = "Should command buffers be recorded for each frame or once, and how be freed?";
    family.hypothesis = "Recording on the fly costs no more than pre-recorded command buffers (S2)";
    family.source = "Ferreira 2019; against it threaded_cadscene: 0.03 against 1.8 ms; Khronos on resets";
    family.held = "the dispatches of a frame, one submission, memory, descriptor sets; one recording thread";
    family.base = plain_frame;
    family.along = "pixels";
    for (const ImageSize& size : device->sizes())
        family.workloads.push_back(workload_of({size, 12, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        const auto arm = [&](const char* name, const char* text, const JobPatterns& patterns) {
            return render_arm(device, workload, name, text, patterns);
        };
        std::vector<Arm> arms{arm("on-the-fly", "recorded for each frame; the pool is reset as a whole", {})};
        JobPatterns patterns;
        patterns.vulkan.recording = RecordingPattern::pre_recorded;
        arms.push_back(arm("pre-recorded", "recorded once and submitted again", patterns));
        patterns.vulkan.recording = RecordingPattern::secondary;
        arms.push_back(arm("secondary", "secondary command buffers, executed by one primary", patterns));
        patterns = {};
        patterns.vulkan.reset = ResetPattern::buffer;
        arms.push_back(arm("buffer-reset", "each command buffer is reset by itself", patterns));
        patterns.vulkan.reset = ResetPattern::free;
        arms.push_back(arm("free", "command buffers are freed and allocated anew", patterns));
        patterns = {};
        patterns.vulkan.one_time_submit = false;
        arms.push_back(arm("no-one-time-flag", "without VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT", patterns));
        patterns = {};
        patterns.vulkan.recordings_per_buffer = std::numeric_limits<std::uint32_t>::max();
        arms.push_back(arm("one-buffer", "all dispatches of the frame in one command buffer", patterns));
        return arms;
    };
    return family;
}

Family threads_family(const SharedDevice& device) {
    Family family;
    family.name = "threads";
    family.question = "Do several recording threads, each with its own pool, make frames faster?";
    family.hypothesis =
        "A little at one sample a frame (T1), not at twelve (T2); the more the more there is to record (T3)";
    family.source = "Ferreira 2019; Blackert 2016";
    family.held = "the dispatches of a frame, one submission, memory, one command buffer a recording";
    family.base = plain_frame;
    family.along = "samples";
    // The thesis's frames; and frames so small that recording is most of their time.
    const ImageSize large = device->sizes().back(), small = device->sizes().front();
    for (const auto& [size, samples] : {std::pair{large, 1u}, {small, 2u}, {large, 12u}, {small, 48u}})
        family.workloads.push_back(workload_of({size, samples, device->bounces()}));
    family.arms = [device](const Workload& workload) {
        std::vector<Arm> arms;
        const unsigned most = std::clamp(2 * usable_processors(), 8u, 32u);
        for (unsigned threads = 1; threads <= most; threads *= 2) {
            JobPatterns patterns;
            patterns.vulkan.recording_threads = threads;
            arms.push_back(render_arm(device, workload, fmt::format("{}-thread{}", threads, threads == 1 ? "" : "s"),
                fmt::format("{} recording thread{}, a command pool each", threads, threads == 1 ? "" : "s"), patterns));
        }
        return arms;
    };
    return family;
}

}  // namespace tandem
