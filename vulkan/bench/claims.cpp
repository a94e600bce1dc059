// Published claims, each tied to the arms that decide it. What is negligible is 1 % unless the claim names a size.
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

constexpr const char* thesis = "Ferreira 2019";

std::vector<Claim> memory_claims() {
    return {
        {.id = "M1",
            .text = "the first frame is much slower with split memory than with cohesive",
            .source = thesis,
            .contrast = {.family = "memory-fresh", .arm = "per-buffer", .clock = "first-frame"},
            .predicted = Predicted::more,
            .negligible_relative = 0.05,
            .rule = "refuted where split memory adds surely less than 5 % to the first frame"},
        {.id = "M1-thesis",
            .text = "the first frame is much slower with split memory than with cohesive, in the thesis's frame and "
                    "placement",
            .source = thesis,
            .contrast =
                {.family = "memory-fresh", .arm = "thesis-split", .against = "thesis-cohesive", .clock = "first-frame"},
            .predicted = Predicted::more,
            .negligible_relative = 0.05,
            .rule = "as M1"},
        {.id = "M2",
            .text = "steady frames do not depend on cohesion",
            .source = thesis,
            .contrast = {.family = "memory", .arm = "per-buffer"},
            .predicted = Predicted::no_difference,
            .rule = "refuted where split memory changes steady frames surely by more than 1 %"},
        {.id = "M3",
            .text = "grouping pays where one shader touches several buffers",
            .source = thesis,
            .contrast = {.family = "memory", .arm = "rays-per-set", .against = "per-buffer"},
            .predicted = Predicted::less,
            .rule = "refuted where one allocation each for ray state and sums saves surely less than 1 % of a steady "
                    "frame"},
        {.id = "M3-vertex",
            .text = "grouping the Scene's buffers pays in frames whose vertex stage touches three of them",
            .source = thesis,
            .contrast =
                {.family = "memory-fresh", .arm = "others-per-set", .against = "per-buffer", .clock = "fresh-frame"},
            .predicted = Predicted::less,
            .rule =
                "refuted where grouping all but ray state and sums saves surely less than 1 % of a frame of a scene "
                "sent anew"},
        {.id = "M3-unrelated",
            .text = "grouping does not pay where buffers are unrelated",
            .source = thesis,
            .contrast = {.family = "memory", .arm = "others-per-set", .against = "per-buffer"},
            .predicted = Predicted::no_difference,
            .rule = "refuted where grouping all but ray state and sums changes a steady frame surely by more than 1 %"},
        {.id = "host-visible",
            .text = "what the host writes and the device reads often belongs in the device's own memory",
            .source = "vendors' advice; the thesis has it host-visible",
            .contrast = {.family = "memory", .arm = "host-visible"},
            .predicted = Predicted::more,
            .rule = "refuted where Scene and Camera in the host's memory cost surely less than 1 % of a steady frame"},
        {.id = "cpu-accesses",
            .text = "few CPU accesses to GPU memory",
            .source = "Mammeri and Juurlink 2018 (VComputeBench)",
            .contrast = {.family = "memory", .arm = "sent-each-frame"},
            .predicted = Predicted::more,
            .rule = "refuted where sending Scene and Camera before each frame costs surely less than 1 % of it"},
        {.id = "dedicated",
            .text = "small dedicated allocations cost",
            .source = "best-practice layers",
            .contrast = {.family = "memory-fresh", .arm = "dedicated", .against = "one-block", .clock = "total"},
            .predicted = Predicted::more,
            .rule = "refuted where making dedicated buffers and a first frame take surely less than 1 % longer than "
                    "from one block"},
        {.id = "offsets",
            .text = "one buffer with offsets beats many buffers in one block",
            .source = "Khronos, later withdrawn",
            .contrast = {.family = "memory", .arm = "one-buffer", .against = "one-block"},
            .predicted = Predicted::less,
            .rule = "refuted where offsets save surely less than 1 %"},
    };
}

std::vector<Claim> scheduling_claims() {
    return {
        {.id = "S1",
            .text = "batching more samples into one submission lowers the time of a sample",
            .source = thesis,
            .contrast = {.family = "submission", .arm = "frame-a-submit", .against = "1-a-submit"},
            .predicted = Predicted::less,
            .rule = "refuted where sixteen samples in one submission save surely less than 1 % over one in each"},
        {.id = "S1-small",
            .text = "the same on the smallest image",
            .source = thesis,
            .contrast =
                {.family = "submission", .arm = "frame-a-submit", .against = "1-a-submit", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "as S1"},
        {.id = "S2",
            .text = "recording on the fly with few descriptor sets costs no more than pre-recorded command buffers",
            .source = thesis,
            .contrast = {.family = "recording", .arm = "on-the-fly", .against = "pre-recorded"},
            .predicted = Predicted::no_more,
            .rule = "refuted where it costs surely more than 1 % of the frame"},
        {.id = "S2-sets",
            .text = "few re-updated descriptor sets cost no more than a set for each combination",
            .source = thesis,
            .contrast = {.family = "descriptors", .arm = "rewritten"},
            .predicted = Predicted::no_more,
            .rule = "refuted where sets written for each dispatch cost surely more than 1 % of the frame"},
        {.id = "S3-memory",
            .text = "command scheduling has more influence than memory",
            .source = thesis,
            .contrast = {.family = "submission", .arm = "frame-a-submit", .against = "1-a-submit"},
            .over = Contrast{.family = "memory", .arm = "per-set", .against = "per-buffer"},
            .predicted = Predicted::less,
            .rule =
                "refuted where sixteen samples in one submission save surely less than 1 % more than cohesive memory"},
        {.id = "S3-threads",
            .text = "command scheduling has more influence than recording threads",
            .source = thesis,
            .contrast = {.family = "submission", .arm = "frame-a-submit", .against = "1-a-submit"},
            .over = Contrast{.family = "threads", .arm = "8-threads", .workload = "samples=12"},
            .predicted = Predicted::less,
            .rule =
                "refuted where sixteen samples in one submission save surely less than 1 % more than eight threads"},
        {.id = "pre-recorded",
            .text = "pre-recorded beats re-recorded",
            .source = "threaded_cadscene (0.03, 1.8 ms)",
            .contrast = {.family = "recording", .arm = "pre-recorded", .workload = "smallest", .clock = "record"},
            .predicted = Predicted::less,
            .rule = "refuted where recording time falls surely by less than 1 %"},
        {.id = "free",
            .text = "freeing command buffers costs more than resetting them",
            .source = "Khronos (28.8 against 1.16 %)",
            .contrast = {.family = "recording",
                .arm = "free",
                .against = "buffer-reset",
                .workload = "smallest",
                .clock = "record"},
            .predicted = Predicted::more,
            .rule = "refuted where recording time grows surely by less than 1 %"},
        {.id = "pool-reset",
            .text = "resetting a pool costs less than resetting its buffers",
            .source = "Khronos (0.45 against 1.16 %)",
            .contrast = {.family = "recording",
                .arm = "on-the-fly",
                .against = "buffer-reset",
                .workload = "smallest",
                .clock = "record"},
            .predicted = Predicted::less,
            .rule = "refuted where recording time falls surely by less than 1 %"},
        {.id = "few-submits",
            .text = "many submissions a frame cost",
            .source = "AMD: at most 20 a frame",
            .contrast = {.family = "submission", .arm = "bounce-a-submit", .workload = "smallest"},
            .predicted = Predicted::more,
            .rule = "refuted where a submission for each path segment costs surely less than 1 %"},
        {.id = "iterations",
            .text = "all iterations in one command buffer with barriers beat a submission each",
            .source = "VComputeBench",
            .contrast = {.family = "submission", .arm = "frame-a-submit", .against = "bounce-a-submit"},
            .predicted = Predicted::less,
            .rule = "refuted where they save surely less than 1 %"},
        {.id = "fence",
            .text = "a fence wait beats queue idle",
            .source = "Khronos (22 %)",
            .contrast = {.family = "waiting", .arm = "fence", .against = "queue-idle", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "refuted where it saves surely less than 1 %"},
    };
}

std::vector<Claim> thread_claims() {
    return {
        {.id = "T1",
            .text = "several recording threads are a little faster at one sample a frame",
            .source = thesis,
            .contrast = {.family = "threads", .arm = "8-threads", .workload = "samples=1"},
            .predicted = Predicted::less,
            .rule = "refuted where eight threads save surely less than 1 %"},
        {.id = "T2",
            .text = "several recording threads are slower at twelve samples a frame",
            .source = thesis,
            .contrast = {.family = "threads", .arm = "8-threads", .workload = "samples=12"},
            .predicted = Predicted::more,
            .rule = "refuted where eight threads cost surely less than 1 %"},
        {.id = "T3",
            .text = "the gain from threads grows with the number of recordings",
            .source = thesis,
            .contrast = {.family = "threads", .arm = "8-threads", .workload = "samples=48"},
            .over = Contrast{.family = "threads", .arm = "8-threads", .workload = "samples=2"},
            .predicted = Predicted::less,
            .rule = "refuted where eight threads gain at 48 samples of the smallest image surely less than 1 % more "
                    "than at two"},
    };
}

std::vector<Claim> binding_claims() {
    return {
        {.id = "push-constants",
            .text = "push constants beat bindings",
            .source = "VComputeBench; denied by Khronos on Mali",
            .contrast = {.family = "parameters", .arm = "push-constants", .against = "uniform", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "refuted where they save surely less than 1 % of the smallest frame"},
        {.id = "specialisation",
            .text = "specialisation constants are faster than uniforms",
            .source = "Khronos (4.4 %)",
            .contrast = {.family = "parameters", .arm = "specialisation", .against = "uniform"},
            .predicted = Predicted::less,
            .rule = "refuted where they save surely less than 1 % of the largest frame"},
        {.id = "avoid-templates",
            .text = "update templates cost more than vkUpdateDescriptorSets",
            .source = "AMD",
            .contrast = {.family = "descriptors",
                .arm = "templates",
                .against = "rewritten",
                .workload = "smallest",
                .clock = "record"},
            .predicted = Predicted::more,
            .rule = "refuted where recording grows surely by less than 1 %"},
        {.id = "use-templates",
            .text = "update templates cost less than vkUpdateDescriptorSets",
            .source = "vkoverhead",
            .contrast = {.family = "descriptors",
                .arm = "templates",
                .against = "rewritten",
                .workload = "smallest",
                .clock = "record"},
            .predicted = Predicted::less,
            .rule = "refuted where recording falls surely by less than 1 %"},
        {.id = "array-indexing",
            .text = "indexing arrays of descriptors defeats optimisation",
            .source = "Khronos",
            .contrast = {.family = "descriptors", .arm = "arrays"},
            .predicted = Predicted::more,
            .rule = "refuted where arrays cost surely less than 1 % of the largest frame"},
    };
}

std::vector<Claim> barrier_claims() {
    return {
        {.id = "global-barrier",
            .text = "a global barrier costs more than buffer barriers",
            .source = "common advice",
            .contrast = {.family = "barriers", .arm = "memory", .against = "buffer", .workload = "smallest"},
            .predicted = Predicted::more,
            .rule = "refuted where it costs surely less than 1 % more"},
        {.id = "batch-barriers",
            .text = "barriers should be batched into one command",
            .source = "AMD",
            .contrast = {.family = "barriers", .arm = "buffer", .against = "buffer-apart", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "refuted where one command saves surely less than 1 %"},
        {.id = "events",
            .text = "events are cheaper than barriers, since they overlap",
            .source = "Khronos",
            .contrast = {.family = "barriers", .arm = "event"},
            .predicted = Predicted::less,
            .rule = "refuted where they save surely less than 1 % of the largest frame; here nothing stands between "
                    "setting and waiting"},
    };
}

std::vector<Claim> queue_claims() {
    return {
        {.id = "several-queues",
            .text = "several queues of a family help",
            .source = "users disagree",
            .contrast = {.family = "queues", .arm = "4-queues", .against = "one-queue", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "refuted where four parts on four queues save surely less than 1 % of the smallest frame"},
        {.id = "frames-in-flight",
            .text = "two frames in flight beat one",
            .source = "Vulkan Tutorial",
            .contrast = {.family = "frames-in-flight", .arm = "2-in-flight", .workload = "smallest"},
            .predicted = Predicted::less,
            .rule = "refuted where the second saves surely less than 1 % of the smallest frames"},
        {.id = "transfer-queue",
            .text = "the transfer queue is faster",
            .source = "VComputeBench; denied by users of wlroots",
            .contrast = {.family = "transfers", .arm = "transfer-queue"},
            .predicted = Predicted::less,
            .rule = "refuted where it saves surely less than 1 % of the largest transfer"},
        {.id = "transfer-queue-beside",
            .text = "the transfer queue is faster beside a frame",
            .source = "vendors' advice",
            .contrast = {.family = "transfers-beside", .arm = "transfer-queue"},
            .predicted = Predicted::less,
            .rule = "refuted where it saves surely less than 1 % of the largest transfer and its frame"},
        {.id = "wavefront",
            .text = "a wavefront beats a megakernel",
            .source = "Laine, Karras and Aila 2013 (36 to 220 %)",
            .contrast = {.family = "kernels", .arm = "wavefront", .against = "megakernel"},
            .predicted = Predicted::less,
            .rule = "refuted where it saves surely less than 1 % of the largest frame"},
        {.id = "compaction",
            .text = "compacted rays beat dispatches over the whole image",
            .source = "Laine, Karras and Aila 2013",
            .contrast = {.family = "kernels", .arm = "wavefront", .against = "image-stages"},
            .predicted = Predicted::less,
            .rule = "refuted where compaction saves surely less than 1 % of the largest frame"},
        {.id = "workgroup-64",
            .text = "workgroups of 64 are as fast as larger ones",
            .source = "Arm: 64 or fewer; AMD: multiples of 64",
            .contrast = {.family = "workgroups", .arm = "stages-64"},
            .predicted = Predicted::no_more,
            .rule = "refuted where 64 cost surely 1 % more than 128 on the largest frame"},
        {.id = "persistent-threads",
            .text = "invocations that take work until none is left beat one invocation an item",
            .source = "Aila and Laine 2009",
            .contrast = {.family = "megakernel", .arm = "claimed"},
            .predicted = Predicted::less,
            .rule = "refuted where claims save surely less than 1 % of the largest frame"},
        {.id = "pipeline-cache",
            .text = "the pipeline cache shortens creation",
            .source = "Khronos (50.4 to 24.4 ms)",
            .contrast = {.family = "pipelines", .arm = "cache"},
            .predicted = Predicted::less,
            .rule = "refuted where it saves surely less than 1 %"},
    };
}

// A step from the thesis's frame to ours, against the step before.
Claim step(const char* id, const char* text, const char* arm, const char* against) {
    return {.id = id,
        .text = text,
        .source = "ours",
        .contrast = {.family = "thesis-steps", .arm = arm, .against = against},
        .predicted = Predicted::less,
        .rule = "refuted where the step saves surely less than 1 % of a frame of twelve samples"};
}

std::vector<Claim> step_claims() {
    return {step("step-placement", "Scene and Camera in the device's own memory", "device-local", "thesis"),
        step("step-push", "Settings pushed with the commands", "push-constants", "device-local"),
        step("step-sums", "samples added to the sums by a stage of its own", "sums-apart", "push-constants"),
        step("step-wavefront", "rays compacted in queues", "wavefront", "sums-apart"),
        step("step-megakernel", "whole paths in registers", "megakernel", "wavefront"),
        step("step-pre-recorded", "commands recorded once", "pre-recorded", "megakernel")};
}

}  // namespace

std::vector<Claim> pattern_claims() {
    std::vector<Claim> claims;
    for (const auto& part : {memory_claims(), scheduling_claims(), thread_claims(), binding_claims(), barrier_claims(),
             queue_claims(), step_claims()})
        claims.insert(claims.end(), part.begin(), part.end());
    return claims;
}

}  // namespace tandem
