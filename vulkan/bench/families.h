// The families of arms, one file a family or two. A family is a value: its texts, its workloads, and its arms, the
// first of which is the baseline.
#pragma once

#include "vulkan/bench/bench_device.h"
#include "vulkan/make_show_place.h"

namespace tandem {

[[nodiscard]] Family memory_family(const SharedDevice& device);        // where buffers live, steady frames
[[nodiscard]] Family fresh_memory_family(const SharedDevice& device);  // the same, first frames and allocation
[[nodiscard]] Family submission_family(const SharedDevice& device);    // samples and command buffers a submission
[[nodiscard]] Family waiting_family(const SharedDevice& device);       // how the host learns of the end
[[nodiscard]] Family recording_family(const SharedDevice& device);     // on the fly, pre-recorded, secondary; resets
[[nodiscard]] Family threads_family(const SharedDevice& device);       // recorders with a pool each
[[nodiscard]] Family barriers_family(const SharedDevice& device);      // between dispatches
[[nodiscard]] Family parameters_family(const SharedDevice& device);    // push constants, buffers, constants
[[nodiscard]] Family descriptors_family(const SharedDevice& device);   // sets, templates, push descriptors, arrays
[[nodiscard]] Family queues_family(const SharedDevice& device);        // parts of an image over queues
[[nodiscard]] Family frames_family(const SharedDevice& device);        // in flight
[[nodiscard]] Family transfers_family(const SharedDevice& device);     // from the host to the device
[[nodiscard]] Family transfers_beside_family(const SharedDevice& device);  // the same, while a frame runs
[[nodiscard]] Family readback_family(const SharedDevice& device);          // from the device to the host
[[nodiscard]] Family pipelines_family(const SharedDevice& device);         // caches, derivatives, threads
[[nodiscard]] Family kernels_family(const SharedDevice& device);           // shapes of the kernels
[[nodiscard]] Family thesis_steps_family(const SharedDevice& device);      // from the thesis's frame to ours
[[nodiscard]] Family workgroups_family(const SharedDevice& device);        // and their workgroups
[[nodiscard]] Family megakernel_family(const SharedDevice& device);        // what its invocations take and share
[[nodiscard]] Family candidates_family(const SharedDevice& device);        // which triangles are tested in full

[[nodiscard]] Family images_family(const SharedDevice& device);  // how a frame ends in an image
// Presented frames. `make_window`: where they are seen; empty: nowhere, if there is no display.
[[nodiscard]] Family presentation_family(const SharedDevice& device, const MakeShowPlace& make_window);

// Not one of all_families(): it tests the runner, not a pattern.
inline constexpr double self_test_busy_seconds = 0.5e-3;
[[nodiscard]] Family self_test_family(const SharedDevice& device);

// All of them, in the order in which they run and are listed.
[[nodiscard]] std::vector<Family> all_families(const SharedDevice& device, const MakeShowPlace& make_window = {});

}  // namespace tandem
