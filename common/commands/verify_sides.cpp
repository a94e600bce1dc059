#include "common/commands/verify_sides.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/commands/arguments.h"
#include "common/commands/console.h"
#include "common/commands/device_list.h"
#include "common/commands/verify_presets.h"
#include "common/distribution/device_group.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

// Several devices as one candidate. No sound ones are chosen: all are to be judged. `lost` gets those that fail.
void add_candidates(const VerifyArguments& arguments, const std::vector<std::string>& devices,
    std::vector<std::string>& lost, const CommandContext& context, Sides& sides) {
    std::vector<std::unique_ptr<Renderer>> members;
    for (const std::string& device : devices) {
        members.push_back(find_backend(context.program.backends, "vulkan")
                              .create({.device = device,
                                  .precision = precision_from(arguments.precision),
                                  .kernel = arguments.kernel,
                                  .validation = arguments.validation}));
        sides.tested.push_back(members.back().get());
    }
    sides.candidate = device_group(std::move(members), [&lost](const std::string& told) {
        fmt::print(stderr, "tandem: device {}; others do its blocks\n", escaped(told));
        lost.push_back(told);
    });
}

}  // namespace

std::vector<DeviceSelfTest> self_tests_of(const std::vector<Renderer*>& sides) {
    std::vector<DeviceSelfTest> tests;
    for (Renderer* const side : sides) {
        const std::optional<DeviceSelfTest> test = self_test_of(*side);
        if (!test) continue;
        fmt::print("Self-test of {}: {}\n", test->device, in_short(test->result));
        tests.push_back(*test);
    }
    return tests;
}

std::unique_ptr<Renderer> in_other_precision(const VerifyArguments& arguments, const BackendList& backends) {
    if (arguments.reference != "cpu" || arguments.no_paired) return nullptr;
    const Precision own = precision_from(arguments.reference_precision).value_or(Precision::single_precision);
    BackendOptions options;
    options.precision = own == Precision::single_precision ? Precision::double_precision : Precision::single_precision;
    return find_backend(backends, arguments.reference).create(options);
}

std::unique_ptr<Renderer> in_precision(
    const VerifyArguments& arguments, VerifiedSide side, Precision precision, const BackendList& backends) {
    const bool reference = side == VerifiedSide::reference;
    const std::string& name = reference ? arguments.reference : arguments.candidate;
    const std::string& own = reference ? arguments.reference_precision : arguments.precision;
    const bool has_precisions = name == "cpu" || name == "vulkan";
    if (!has_precisions || precision_from(own).value_or(Precision::single_precision) != Precision::single_precision)
        return nullptr;
    BackendOptions options;
    if (name == "vulkan") options.device = reference ? arguments.reference_device : arguments.device;
    options.precision = precision;
    return find_backend(backends, name).create(options);
}

std::vector<std::string> devices_of(const VerifyArguments& arguments, const CommandContext& context) {
    if (!is_device_list(arguments.device)) return {};
    if (arguments.candidate != "vulkan")
        throw UnsupportedError("--device: several are for the candidate vulkan; leave it out");
    const std::vector<std::string> devices = devices_named(arguments.device, context);
    if (devices.empty()) throw DeviceError("--device: no device of '" + arguments.device + "' can be used");
    if (std::ranges::find(devices, "cpu") != devices.end())
        throw UnsupportedError("--device: cpu cannot be judged with Vulkan devices as one; verify --candidate cpu");
    return devices;
}

Sides sides_of(const VerifyArguments& arguments, const std::vector<std::string>& devices,
    std::vector<std::string>& lost, const CommandContext& context) {
    const BackendList& backends = context.program.backends;
    ProgramOptions of_programs;
    of_programs.follows_numbers = arguments.follows_model;
    of_programs.may_be_negative = arguments.negative_colours;
    of_programs.limit_seconds = arguments.seconds.value_or(
        arguments.total_time.empty() ? default_seconds : duration_from(arguments.total_time, "--total-time"));
    Sides sides;
    sides.reference = renderer_of(arguments.reference,
        {.device = arguments.reference_device,
            .precision = precision_from(arguments.reference_precision),
            .kernel = arguments.reference_kernel},
        of_programs, backends, sides.programs);
    sides.tested = {sides.reference.get()};
    if (!devices.empty()) {
        add_candidates(arguments, devices, lost, context, sides);
    } else {
        sides.candidate = renderer_of(arguments.candidate,
            {.device = arguments.device,
                .precision = precision_from(arguments.precision),
                .kernel = arguments.kernel,
                .validation = arguments.validation},
            of_programs, backends, sides.programs);
        sides.tested.push_back(sides.candidate.get());
    }
    for (const auto& [given, name] :
        {std::pair{arguments.follows_model, "--follows-model"}, {arguments.negative_colours, "--negative-colours"}})
        if (given && sides.programs.empty())
            throw InputError(
                fmt::format("{}: says it of a program; add --candidate exec:'COMMAND', or leave it out", name));
    return sides;
}

}  // namespace tandem
