// `tandem bench --arm-library`: the arms of a user's library, as a family.
#pragma once

#include "common/experiment/bench.h"

namespace tandem {

// On a device of its own, without a scene. Throws InputError for the library, DeviceError for the device.
[[nodiscard]] BenchTarget own_arms_bench(const BenchRequest& request);

}  // namespace tandem
