#include "common/commands/device_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "common/commands/child_process.h"
#include "common/deadline.h"
#include "common/distribution/device_group.h"
#include "common/error.h"
#include "common/external/child.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

constexpr const char *cpu = "cpu", *all_of_them = "all";

void left_out(const std::string& device, const std::string& reason) {
    fmt::print(stderr, "tandem: device {} is left out: {}\n", escaped(device), escaped(reason));
}

// Each by its UUID, which stays where the devices are numbered anew; by its index where it shares that.
std::vector<std::string> all_devices(const nlohmann::json& listed) {
    std::vector<std::string> names;
    const nlohmann::json& devices = listed.at("devices");
    for (const nlohmann::json& device : devices) {
        if (!device.at("suitable").get<bool>()) {
            left_out(device.at("name").get<std::string>(), device.at("reason").get<std::string>());
            continue;
        }
        const auto uuid = device.at("uuid").get<std::string>();
        const auto of_it = std::ranges::count_if(devices, [&](const auto& other) { return other.at("uuid") == uuid; });
        names.push_back(uuid.empty() || of_it > 1 ? std::to_string(device.at("index").get<int>()) : uuid);
    }
    return names;
}

}  // namespace

bool is_device_list(const std::string& list) { return list == all_of_them || list.find(',') != std::string::npos; }

std::vector<std::string> devices_named(const std::string& list, const CommandContext& context) {
    std::vector<std::string> names;
    std::istringstream parts(list);
    for (std::string name; std::getline(parts, name, ',');) {
        const std::size_t begin = name.find_first_not_of(' '), end = name.find_last_not_of(' ');
        if (begin == std::string::npos) throw InputError("--device: '" + list + "' has an empty place");
        name = name.substr(begin, end - begin + 1);
        if (name != all_of_them) {
            names.push_back(name);
            continue;
        }
        for (std::string& one : all_devices(context.program.devices())) names.push_back(std::move(one));
    }
    return names;
}

namespace {

// A look at a device, in a process that may hang or die.
struct Look {
    std::string device;
    TemporaryFile log, report;
    std::unique_ptr<Child> child;
};

std::string last_line_of(const std::string& log) {
    std::ifstream file(log);
    std::string last;
    for (std::string line; std::getline(file, line);)
        if (!line.empty()) last = line;
    return last;
}

// Why the device is not to be used; empty: it is.
std::string fault_of(const Look& look, bool ended, double seconds) {
    if (!ended) return fmt::format("it has not answered for {:.0f} s", seconds);
    const int status = look.child->exit_status();
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(look.report.name()), nullptr, false);
    if (!report.is_object() || report.at("scenes").empty())
        return fmt::format("{} ({})", last_line_of(look.log.name()), look.child->how_it_ended());
    const nlohmann::json& scene = report.at("scenes").front();
    if (status == static_cast<int>(ExitStatus::disagree)) return scene.at("sentence").get<std::string>();
    for (const nlohmann::json& test : report.at("device_self_tests"))
        if (test.value("passed", true) == false) return "its arithmetic is less exact than Vulkan demands";
    return "";
}

// The devices that agree with the CPU on a small image of the scene.
std::vector<std::string> sound_devices(const std::vector<std::string>& names, const std::string& scene,
    const std::vector<std::string>& words, const CommandContext& context) {
    std::vector<std::unique_ptr<Look>> looks;
    for (const std::string& name : names) {
        if (name == cpu || std::ranges::any_of(looks, [&](const auto& look) { return look->device == name; })) continue;
        auto look = std::make_unique<Look>();
        look->device = name;
        // Its false alarms are a hundredth of a verdict's.
        std::vector<std::string> all{std::filesystem::read_symlink("/proc/self/exe").string(), "verify", scene,
            "--device", name, "--size", "32", "--samples", "256", "--time", "1", "--oracle", "none", "--no-layer",
            "--among", "100", "--json", look->report.name()};
        all.insert(all.end(), words.begin(), words.end());
        look->child = std::make_unique<Child>(all, look->log.name(), false);
        looks.push_back(std::move(look));
    }
    // A second of work; the rest is for loading the scene and making kernels, by many devices at once.
    constexpr double limit_seconds = 60.0, poll_seconds = 0.05;
    const Stopwatch watch;
    std::vector<std::string> sound;
    for (const auto& look : looks) {
        bool ended = look->child->ended_within(0.0);
        while (!ended && watch.seconds() < limit_seconds && !context.stop.stop_requested())
            ended = look->child->ended_within(poll_seconds);
        if (context.stop.stop_requested()) throw StoppedError("stopped while devices were checked; nothing is written");
        const std::string fault = fault_of(*look, ended, watch.seconds());
        if (fault.empty())
            sound.push_back(look->device);
        else
            left_out(look->device, fault);
    }
    std::vector<std::string> taken;
    for (const std::string& name : names)
        if (name == cpu || std::ranges::find(sound, name) != sound.end()) taken.push_back(name);
    return taken;
}

}  // namespace

std::unique_ptr<Renderer> renderer_on(const std::string& backend, const BackendOptions& options,
    const std::string& scene, const std::vector<std::string>& words, const CommandContext& context) {
    const Backend& named = find_backend(context.program.backends, backend);
    if (!is_device_list(options.device)) return named.create(options);
    if (backend != "vulkan")
        throw UnsupportedError(fmt::format(
            "--device: the {} backend has no choice of devices; add --backend vulkan, and cpu to the devices",
            backend));
    const std::vector<std::string> names = sound_devices(devices_named(options.device, context), scene, words, context);
    std::vector<std::unique_ptr<Renderer>> members;
    for (const std::string& name : names) {
        BackendOptions own = options;
        own.device = name == cpu ? "" : name;
        if (name == cpu) own.kernel.clear();
        if (name == cpu) own.validation = false;
        members.push_back(find_backend(context.program.backends, name == cpu ? cpu : "vulkan").create(own));
    }
    if (members.empty()) throw DeviceError("--device: no device of '" + options.device + "' can be used");
    return device_group(std::move(members), [](const std::string& told) { left_out(told, "others do its blocks"); });
}

}  // namespace tandem
