// The device's clock in terms of the host's (VK_EXT_calibrated_timestamps): when, by the steady clock, a stamp was
// written.
#pragma once

#include "vulkan/core/device.h"

namespace tandem {

// Both clocks at one moment.
struct ClockPair {
    std::uint64_t ticks = 0;  // of the device
    double host = 0.0;        // seconds by the steady clock
    double deviation = 0.0;   // seconds: neither clock was read farther from that moment, as the driver states
};

// When a stamp was written that lies between two moments, or near them. It lies on the straight line through both, so
// that it does not matter how the clocks drift apart. Its error is at most the greater deviation of the two. `bits` of
// stamps are valid; counters may wrap once between any two of the three.
[[nodiscard]] double host_seconds(
    const ClockPair& before, const ClockPair& after, std::uint64_t stamp, std::uint32_t bits);

class DeviceClock {
public:
    // Throws UnsupportedError, with what is lacking, where the clocks cannot be related.
    explicit DeviceClock(const Device& device);  // which must outlive it

    // The one of several readings that deviates least.
    [[nodiscard]] ClockPair now() const;

private:
    const Device& device_;
};

}  // namespace tandem
