// tandem devices: what Vulkan devices there are, and why one cannot be used.
#include <fmt/format.h>

#include "common/commands/command.h"

namespace tandem {

namespace {

ExitStatus list_devices(const CommandContext& context) {
    const nlohmann::json report = context.program.devices();
    write_json(context, report);
    bool usable = false;
    for (const nlohmann::json& device : report.at("devices")) {
        const bool suitable = device.at("suitable").get<bool>();
        usable = usable || suitable;
        fmt::print("{}  {}\n   {}, driver {}, Vulkan {}\n", device.at("index").get<int>(),
            device.at("name").get<std::string>(), device.at("type").get<std::string>(),
            device.at("driver").get<std::string>(), device.at("api").get<std::string>());
        if (!suitable) fmt::print("   cannot be used: {}\n", device.at("reason").get<std::string>());
        if (context.verbose) fmt::print("{}\n", device.dump(2));
    }
    if (report.at("devices").empty())
        fmt::print(stderr, "tandem: no Vulkan device; install a driver, or mesa-vulkan-drivers for lavapipe\n");
    return usable ? ExitStatus::fine : ExitStatus::no_device;
}

}  // namespace

void add_devices_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("devices", "List the Vulkan devices, and why one cannot be used");
    add_common_options(*command, context, "  tandem devices\n  tandem devices -v --json devices.json");
    command->callback([&context] { context.action = [&context] { return list_devices(context); }; });
}

}  // namespace tandem
