// How many processors this process may use.
#pragma once

namespace tandem {

// At least 1. Fewer than the machine has where a CPU affinity says so (taskset, a batch system, a container's set of
// processors): std::thread::hardware_concurrency() counts those, too, with some C libraries.
[[nodiscard]] unsigned usable_processors();

}  // namespace tandem
