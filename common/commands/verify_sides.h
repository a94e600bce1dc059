// The two renderers that `tandem verify` compares, made of its options.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/commands/command.h"
#include "common/commands/programs.h"
#include "common/commands/verdict_options.h"
#include "common/self_test/self_test.h"

namespace tandem {

inline constexpr double default_seconds = 120.0;  // of a scene

struct VerifyArguments {
    std::vector<std::string> scenes;
    std::string reference = "cpu", candidate = "vulkan", device, reference_device, kernel, reference_kernel, precision,
                reference_precision, memory;
    RenderOptions render;
    CriteriaArguments criteria;
    std::string preset, total_time;
    std::optional<double> seconds;  // of a scene
    std::optional<std::uint64_t> samples;
    std::uint64_t among = 0;  // scenes of a run that is split
    std::string oracle = "oracle";
    bool no_paired = false, no_layer = false, strict = false, validation = false, convergence = false;
    bool follows_model = false, negative_colours = false;
};

struct Sides {
    std::unique_ptr<Renderer> reference, candidate;
    Programs programs;
    std::vector<Renderer*> tested;  // each device by itself
};

// The candidate's devices, where --device names several; empty: one. Throws UnsupportedError or DeviceError.
[[nodiscard]] std::vector<std::string> devices_of(const VerifyArguments& arguments, const CommandContext& context);

// Programs that stay up are started here. `lost` gets the devices of several that fail. Throws InputError.
[[nodiscard]] Sides sides_of(const VerifyArguments& arguments, const std::vector<std::string>& devices,
    std::vector<std::string>& lost, const CommandContext& context);

// The CPU's path tracer as a reference, in double precision where that is in single, or else in single. It shows what
// rounding alone does to its samples. Nothing for other references.
[[nodiscard]] std::unique_ptr<Renderer> in_other_precision(
    const VerifyArguments& arguments, const BackendList& backends);

// A side that is a backend in single precision, in another one. Nothing for others. Throws what its backend does.
[[nodiscard]] std::unique_ptr<Renderer> in_precision(
    const VerifyArguments& arguments, VerifiedSide side, Precision precision, const BackendList& backends);

// Says in a line how exactly each side's device computes, where it has an arithmetic of its own.
[[nodiscard]] std::vector<DeviceSelfTest> self_tests_of(const std::vector<Renderer*>& sides);

}  // namespace tandem
