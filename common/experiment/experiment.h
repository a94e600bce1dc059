// Arms that compute the same thing in different ways, and the experiments that compare them. These are plain
// descriptions. Nothing here knows of Vulkan, so the runner is tested on synthetic clocks.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/render/estimate.h"

namespace tandem {

// Seconds by clock of one run of an arm. "total" (wall clock) is always there. "record", "record-cpu", "submit",
// "wait", "device", "prepare" are there where the arm has such phases. "submit-to-start", "end-to-known", "overlap" and
// "clock-deviation" need related clocks of device and host.
using ClockReadings = std::map<std::string, double>;

// What an arm computes, for the identity gate.
struct ArmOutput {
    std::uint64_t digest = 0;                  // equal digests: the same result, bit for bit
    std::shared_ptr<const Estimate> estimate;  // for arms that may differ in rounding: judged by the verdict
};
[[nodiscard]] std::uint64_t digest_of(const Estimate& estimate);

// An arm made ready on a device.
class ArmRun {
public:
    virtual ~ArmRun() = default;
    // The same work each time: a frame, a transfer. Throws what the device throws.
    [[nodiscard]] virtual ClockReadings run() = 0;
    // Empty: nothing to compare (allocations, pipelines).
    [[nodiscard]] virtual std::optional<ArmOutput> output() { return std::nullopt; }
};

struct Arm {
    std::string name;  // unique in its family: "per-buffer"
    std::string text;  // one line: what it does
    // Throws UnsupportedError with the reason where the device cannot: the arm is then not applicable.
    std::function<std::unique_ptr<ArmRun>()> make;
    bool same_bits = true;  // false: other arithmetic (a kernel shape), which the statistical verdict may pass
};

// How much an arm has to do. `factors` are what crossovers are sought along: "pixels", "samples", "bounces", "bytes".
struct Workload {
    std::string name;  // unique in its family: "512x288, 12 samples, 12 bounces"
    std::map<std::string, double> factors;
};

// One factor varied, crossed with workload size.
struct Family {
    std::string name;        // "memory"
    std::string question;    // what a reader wants to know
    std::string hypothesis;  // what is expected, and
    std::string source;      // who says so
    std::string held;        // what stays the same
    // What a run of the baseline does, and from when to when its total lasts. Baselines of two families with the same
    // text take the same time at the same workload.
    std::string base;
    std::string clock = "total";                            // the readings that arms are compared by
    bool everywhere = true;                                 // false: a device may lack what all arms need
    std::string along;                                      // the workload factor that grows
    std::vector<Workload> workloads;                        // ascending along it
    std::function<std::vector<Arm>(const Workload&)> arms;  // the first one is the baseline
};

}  // namespace tandem
