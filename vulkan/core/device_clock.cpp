#include "vulkan/core/device_clock.h"

#include <algorithm>
#include <array>

#include "common/error.h"

namespace tandem {

namespace {

// From one stamp to another, across at most one wrap of the counter in either direction.
double ticks_between(std::uint64_t from, std::uint64_t to, std::uint32_t bits) {
    const std::uint32_t unused = bits >= 64 ? 0 : 64 - bits;
    return static_cast<double>(static_cast<std::int64_t>((to - from) << unused) >> unused);
}

// In which std::chrono::steady_clock counts.
constexpr vk::TimeDomainEXT host_domain = vk::TimeDomainEXT::eClockMonotonic;

}  // namespace

double host_seconds(const ClockPair& before, const ClockPair& after, std::uint64_t stamp, std::uint32_t bits) {
    const double whole = ticks_between(before.ticks, after.ticks, bits);
    const double share = ticks_between(before.ticks, stamp, bits) / whole;
    return before.host + share * (after.host - before.host);
}

DeviceClock::DeviceClock(const Device& device) : device_(device) {
    const std::string& name = device.description().name;
    if (device.description().abilities.timestamp_bits == 0)
        throw UnsupportedError(name + " writes no timestamps on the queue that renders");
    if (!device.features().calibrated_timestamps) throw UnsupportedError(name + " has no VK_EXT_calibrated_timestamps");
    const auto domains = device.physical().getCalibrateableTimeDomainsEXT();
    for (const vk::TimeDomainEXT wanted : {vk::TimeDomainEXT::eDevice, host_domain})
        if (std::ranges::find(domains, wanted) == domains.end())
            throw UnsupportedError(name + " does not calibrate the time domain " + vk::to_string(wanted));
}

ClockPair DeviceClock::now() const {
    constexpr int tries = 4;
    const std::array domains{
        vk::CalibratedTimestampInfoEXT(vk::TimeDomainEXT::eDevice), vk::CalibratedTimestampInfoEXT(host_domain)};
    ClockPair best;
    for (int i = 0; i < tries; ++i) {
        const auto [stamps, deviation] = device_.handle().getCalibratedTimestampsEXT(domains);
        const ClockPair pair{stamps[0], 1e-9 * static_cast<double>(stamps[1]), 1e-9 * static_cast<double>(deviation)};
        if (i == 0 || pair.deviation < best.deviation) best = pair;
    }
    return best;
}

}  // namespace tandem
