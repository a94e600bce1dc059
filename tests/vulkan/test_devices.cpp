// Which device is taken, and why one is refused, on invented devices; and the list of the real ones.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"
#include "tests/vulkan/few_buffers.h"
#include "vulkan/core/device.h"
#include "vulkan/core/device_selection.h"

using namespace tandem;
using tandem::testing::ScopedVariables;

namespace {

DeviceDescription device(std::uint32_t index, const std::string& name, DeviceType type) {
    DeviceDescription result;
    result.index = index;
    result.name = name;
    result.type = type;
    result.api_major = 1;
    result.api_minor = 2;
    result.abilities.compute_queue = true;
    for (const NeededLimit& limit : needed_limits) result.abilities.*limit.has = limit.guaranteed;
    result.suitable = true;
    return result;
}

DeviceDescription refused(DeviceDescription description, const std::string& reason) {
    description.suitable = false;
    description.reason = reason;
    return description;
}

const std::vector<DeviceDescription> three{device(0, "llvmpipe (LLVM 15)", DeviceType::cpu),
    device(1, "Intel Arc", DeviceType::integrated), device(2, "NVIDIA H200", DeviceType::discrete)};

std::string error_of(const std::vector<DeviceDescription>& devices, const std::string& wanted) {
    try {
        static_cast<void>(select_device(devices, wanted));
    } catch (const DeviceError& error) {
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("by default a discrete GPU is taken before an integrated one and both before a CPU") {
    CHECK(select_device(three, "") == 2);
    CHECK(select_device(std::vector{three[0], three[1]}, "") == 1);
    CHECK(select_device(std::vector{three[0]}, "") == 0);
}

TEST_CASE("a device that cannot be used is passed over by default") {
    CHECK(select_device(std::vector{three[0], refused(three[2], "is old")}, "") == 0);
}

TEST_CASE("a device is named by its index or a part of its name in any case") {
    CHECK(select_device(three, "1") == 1);
    CHECK(select_device(three, "nvidia") == 2);
    CHECK(select_device(three, "LLVM") == 0);
    CHECK(select_device(three, "h200") == 2);
}

TEST_CASE("a device is named by its UUID, with dashes or without") {
    std::vector<DeviceDescription> devices = three;
    devices[1].uuid = "0123456789abcdef0123456789abcdef";
    devices[2].uuid = "00000000000000000000000000000001";
    CHECK(select_device(devices, "01234567-89AB-cdef-0123-456789abcdef") == 1);
    CHECK(select_device(devices, "00000000000000000000000000000001") == 2);
    CHECK(contains(error_of(devices, "0123456789abcdef0123456789abcdee"), "no Vulkan device matches"));
}

TEST_CASE("a device is named by its PCI address, with a domain of any length or none") {
    std::vector<DeviceDescription> devices = three;
    devices[1].pci = "0000:00:02.0";
    devices[2].pci = "0001:3b:00.0";
    for (const char* same : {"00:02.0", "0000:00:02.0", "00000000:00:02.0"}) CHECK(select_device(devices, same) == 1);
    for (const char* same : {"0001:3B:00.0", "00000001:3b:00.0"}) CHECK(select_device(devices, same) == 2);
    for (const char* other : {"3b:00.0", "0001:3b:00.1", "0001:3b:00", "0001:3b:00.0.", ":3b:00.0", "0:0001:3b:00.0"})
        CHECK(contains(error_of(devices, other), "no Vulkan device matches"));
}

TEST_CASE("a number is an index, not a part of a name") { CHECK(contains(error_of(three, "200"), "2: NVIDIA H200")); }

TEST_CASE("a name that matches nothing is refused with a list of what there is") {
    const std::string error = error_of(three, "radeon");
    CHECK(contains(error, "radeon"));
    CHECK(contains(error, "2: NVIDIA H200 (discrete GPU)"));
    CHECK(contains(error, "0: llvmpipe"));
    CHECK(contains(error_of({}, ""), "there is no Vulkan device"));
}

TEST_CASE("naming a device that cannot be used says what it lacks") {
    CHECK(contains(error_of({three[0], refused(three[1], "offers Vulkan 1.1")}, "arc"), "offers Vulkan 1.1"));
}

TEST_CASE("each lack is named") {
    CHECK(unsuitability(three[0]).empty());
    DeviceDescription old = three[0];
    old.api_minor = 1;
    CHECK(contains(unsuitability(old), "Vulkan 1.1"));
    DeviceDescription no_compute = three[0];
    no_compute.abilities.compute_queue = false;
    CHECK(contains(unsuitability(no_compute), "compute"));
    for (const NeededLimit& limit : needed_limits) {
        DeviceDescription enough = three[0], less = three[0];
        enough.abilities.*limit.has = limit.needed;
        less.abilities.*limit.has = limit.needed - 1;
        CHECK(unsuitability(enough).empty());
        CHECK(contains(unsuitability(less),
            std::string(limit.name) + " is " + std::to_string(limit.needed - 1) + ", Tandem needs"));
    }
}

TEST_CASE("storage buffers are merged where a stage or the sets together have too few of them") {
    DeviceAbilities abilities = three[0].abilities;
    abilities.storage_buffers_per_stage = abilities.storage_buffers_per_set = 32;
    CHECK_FALSE(merges_storage_buffers(abilities));
    for (const std::uint32_t few : {4u, 8u, 24u, 31u}) {
        abilities.storage_buffers_per_stage = few;
        CHECK(merges_storage_buffers(abilities));
    }
    abilities.storage_buffers_per_stage = 32;
    abilities.storage_buffers_per_set = 24;
    CHECK(merges_storage_buffers(abilities));
}

TEST_CASE("the Vulkan page has the limits that a device is held to") {
    std::ifstream page(TANDEM_SOURCE_DIR "/vulkan/README.md");
    std::vector<std::string> written, expected;
    for (std::string line; std::getline(page, line);)
        if (line.starts_with("| `max")) written.push_back(line);
    for (const NeededLimit& limit : needed_limits)
        expected.push_back("| `" + std::string(limit.name) + "` | " + std::to_string(limit.needed) + " | " +
                           std::to_string(limit.guaranteed) + " |");
    CHECK(written == expected);
}

TEST_CASE("optional features that are made use of are told by name") {
    const Instance instance(false);
    const Device real(instance, "");
    const auto tells = [&](const std::string& name) {
        return std::ranges::count(real.description().features_used, name) == 1;
    };
    const DeviceFeatures& has = real.features();
    CHECK(tells("doubles") == has.doubles);
    CHECK(tells("timeline semaphores") == has.timeline_semaphores);
    CHECK(tells("push descriptors") == has.push_descriptors);
    CHECK(tells("calibrated timestamps") == has.calibrated_timestamps);
    CHECK(tells("stores to images of any format") == has.stores_any_format);
    CHECK(tells("ray tracing") == has.ray_tracing);
    CHECK(tells("ray queries") == has.ray_queries);
    CHECK(names_of({}).empty());
    DeviceFeatures one;
    one.ray_tracing = true;
    CHECK(names_of(one) == std::vector<std::string>{"ray tracing"});
}

TEST_CASE("this machine's devices are listed with driver, version and UUID") {
    const std::vector<DeviceDescription> devices = list_devices();
    REQUIRE(!devices.empty());
    for (const DeviceDescription& each : devices) {
        CHECK(!each.name.empty());
        CHECK(each.api_major >= 1);
        CHECK(each.uuid.size() == 32);
        CHECK(each.suitable == each.reason.empty());
    }
    CHECK(std::ranges::any_of(devices, &DeviceDescription::suitable));
    const nlohmann::json report = devices_as_json();
    CHECK(report.at("devices").size() == devices.size());
    CHECK(report.at("devices")[0].at("name") == devices[0].name);
    CHECK(report.at("devices")[0].at("index") == 0);
}

TEST_CASE("devices that lack parts of Vulkan, as on top of Metal, are listed too") {
    const std::filesystem::path drivers = "/usr/share/vulkan/icd.d";
    const TemporaryFolder folder;
    const std::filesystem::path manifest = folder / "portable.json";
    for (const auto& entry : std::filesystem::directory_iterator(drivers)) {
        if (!entry.path().filename().string().starts_with("lvp_icd")) continue;
        std::ifstream file(entry.path());
        nlohmann::json driver = nlohmann::json::parse(file);
        driver["file_format_version"] = "1.0.1";
        driver["ICD"]["is_portability_driver"] = true;
        std::ofstream(manifest) << driver;
    }
    REQUIRE(std::filesystem::exists(manifest));  // of mesa-vulkan-drivers
    ScopedVariables variables;
    variables.set("VK_ICD_FILENAMES", manifest.string());
    variables.set("VK_DRIVER_FILES", manifest.string());
    const std::vector<DeviceDescription> devices = list_devices();
    REQUIRE(devices.size() == 1);
    CHECK(devices[0].suitable);
}
