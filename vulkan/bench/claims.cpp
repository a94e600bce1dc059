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
        {.id = "M2",
            .text = "steady frames do not depend on cohesion",
            .source = thesis,
            .contrast = {.family = "memory", .arm = "per-buffer"},
            .predicted = Predicted::no_difference,
            .rule = "refuted where split memory changes steady frames surely by more than 1 %"},
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

}  // namespace

std::vector<Claim> pattern_claims() {
    std::vector<Claim> claims;
    for (const auto& part : {memory_claims(), scheduling_claims(), thread_claims()})
        claims.insert(claims.end(), part.begin(), part.end());
    return claims;
}

}  // namespace tandem
