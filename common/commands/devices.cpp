// tandem devices: what Vulkan devices there are, why one cannot be used, and how exactly each computes.
#include <fmt/format.h>

#include "common/commands/command.h"
#include "common/self_test/self_test.h"

namespace tandem {

namespace {

void print_device(const nlohmann::json& device, bool verbose) {
    const bool suitable = device.at("suitable").get<bool>();
    fmt::print("{}  {}\n   {}, driver {}, Vulkan {}\n", device.at("index").get<int>(),
        device.at("name").get<std::string>(), device.at("type").get<std::string>(),
        device.at("driver").get<std::string>(), device.at("api").get<std::string>());
    if (!suitable) fmt::print("   cannot be used: {}\n", device.at("reason").get<std::string>());
    if (suitable && device.at("abilities").at("merges_storage_buffers").get<bool>())
        fmt::print("   few storage buffers a stage: {}; those of a descriptor set are merged\n",
            device.at("abilities").at("storage_buffers_per_stage").get<int>());
    if (verbose) fmt::print("{}\n", device.dump(2));
    std::fflush(stdout);
}

// Adds "self_test" to the device.
ExitStatus test_device(const CommandContext& context, nlohmann::json& device) {
    const Backend& vulkan = find_backend(context.program.backends, "vulkan");
    BackendOptions options;
    options.device = std::to_string(device.at("index").get<int>());
    const auto renderer = vulkan.create(options);
    const SelfTest test = run_self_test(*renderer->arithmetic());
    fmt::print("{}", in_full(test));
    device["self_test"] = to_json(test);
    return test.passed() ? ExitStatus::fine : ExitStatus::disagree;
}

ExitStatus list_devices(const CommandContext& context, bool self_test) {
    nlohmann::json report = context.program.devices();
    ExitStatus status = ExitStatus::no_device;
    for (nlohmann::json& device : report.at("devices")) {
        print_device(device, context.verbose);
        if (!device.at("suitable").get<bool>()) continue;
        if (status == ExitStatus::no_device) status = ExitStatus::fine;
        if (self_test && test_device(context, device) != ExitStatus::fine) status = ExitStatus::disagree;
    }
    write_json(context, report);
    if (report.at("devices").empty())
        fmt::print(stderr, "tandem: no Vulkan device; install a driver, or mesa-vulkan-drivers for lavapipe\n");
    return status;
}

}  // namespace

void add_devices_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("devices", "List the Vulkan devices, and why one cannot be used");
    const auto self_test = std::make_shared<bool>(false);
    command->add_flag("--self-test", *self_test,
        "Measure the arithmetic of each device: errors in ulp, rounding, subnormal numbers, infinities and NaN. Exit "
        "status 1 where it is less exact than Vulkan demands");
    add_common_options(*command, context,
        "  tandem devices\n  tandem devices -v --json devices.json\n  tandem devices --self-test --json devices.json");
    command->callback([&context, self_test] {
        context.action = [&context, self_test] { return list_devices(context, *self_test); };
    });
}

}  // namespace tandem
