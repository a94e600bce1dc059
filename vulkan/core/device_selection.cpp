#include "vulkan/core/device_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "common/error.h"
#include "vulkan/core/driver_remedy.h"

namespace tandem {

namespace {

std::string lower_case(std::string text) {
    std::ranges::transform(
        text, text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    return text;
}

// Position in the order of preference, the best first.
std::size_t rank(DeviceType type) {
    constexpr std::array order{
        DeviceType::discrete, DeviceType::integrated, DeviceType::virtual_gpu, DeviceType::cpu, DeviceType::other};
    return static_cast<std::size_t>(std::ranges::find(order, type) - order.begin());
}

std::string listing(std::span<const DeviceDescription> devices) {
    if (devices.empty()) return "there is no Vulkan device; " + driver_remedy();
    std::string text = "there is";
    for (const DeviceDescription& device : devices) {
        text += fmt::format(
            "{} {}: {} ({})", &device == devices.data() ? "" : ",", device.index, device.name, to_string(device.type));
        if (!device.suitable) text += fmt::format(" [not usable: {}]", device.reason);
    }
    return text;
}

// A UUID as `tandem devices` shows it, or with the dashes that other tools put in.
bool is_uuid_of(const DeviceDescription& device, std::string wanted) {
    std::erase(wanted, '-');
    return !device.uuid.empty() && lower_case(wanted) == device.uuid;
}

// The four numbers of [domain:]bus:device.function, in hexadecimal; tools write domains of four digits, of eight, or
// none.
std::optional<std::array<std::uint32_t, 4>> pci_numbers(const std::string& text) {
    const auto separators = std::ranges::count(text, ':');
    const std::string whole = separators == 1 ? "0:" + text : text;
    std::array<std::uint32_t, 4> numbers{};
    const char *at = whole.data(), *const end = at + whole.size();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const auto [next, failure] = std::from_chars(at, end, numbers[i], 16);
        if (failure != std::errc{}) return std::nullopt;
        if (next == end) return i + 1 == numbers.size() ? std::optional(numbers) : std::nullopt;
        if (i + 1 == numbers.size() || *next != "::."[i]) return std::nullopt;
        at = next + 1;
    }
    return std::nullopt;
}

bool is_at(const DeviceDescription& device, const std::string& wanted) {
    const auto address = pci_numbers(wanted);
    return address && address == pci_numbers(device.pci);
}

bool is_named(const DeviceDescription& device, const std::string& wanted) {
    if (is_uuid_of(device, wanted)) return true;  // also one of decimal digits alone
    if (is_at(device, wanted)) return true;
    std::uint32_t index = 0;
    const char* end = wanted.data() + wanted.size();
    const auto [parsed, failure] = std::from_chars(wanted.data(), end, index);
    constexpr std::size_t most_digits = 10;  // of an index; with more it is a UUID of another device
    if (failure == std::errc{} && parsed == end && wanted.size() <= most_digits)
        return index == device.index;  // not "5" of a name
    return lower_case(device.name).find(lower_case(wanted)) != std::string::npos;
}

}  // namespace

bool merges_storage_buffers(const DeviceAbilities& abilities) {
    return std::min(abilities.storage_buffers_per_stage, abilities.storage_buffers_per_set) < separate_storage_buffers;
}

std::string unsuitability(const DeviceDescription& device) {
    const DeviceAbilities& has = device.abilities;
    if (std::pair{device.api_major, device.api_minor} < std::pair{1u, 2u})
        return fmt::format("offers Vulkan {}.{}, Tandem needs 1.2", device.api_major, device.api_minor);
    if (!has.compute_queue) return "has no queue family with compute";
    for (const NeededLimit& limit : needed_limits)
        if (has.*limit.has < limit.needed)
            return fmt::format("{} is {}, Tandem needs {}", limit.name, has.*limit.has, limit.needed);
    return {};
}

std::size_t select_device(std::span<const DeviceDescription> devices, const std::string& wanted) {
    std::optional<std::size_t> best, refused;
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (!wanted.empty() && !is_named(devices[i], wanted)) continue;
        if (!devices[i].suitable) {
            if (!refused) refused = i;
        } else if (!best || rank(devices[i].type) < rank(devices[*best].type)) {
            best = i;
        }
    }
    if (best) return *best;
    if (!wanted.empty() && refused)
        throw DeviceError(
            fmt::format("Vulkan device '{}' cannot be used: {}", devices[*refused].name, devices[*refused].reason));
    if (!wanted.empty()) throw DeviceError(fmt::format("no Vulkan device matches '{}'; {}", wanted, listing(devices)));
    if (devices.empty()) throw DeviceError(listing(devices));
    throw DeviceError("no Vulkan device can be used; " + listing(devices));
}

}  // namespace tandem
