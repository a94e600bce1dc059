#include "common/processors.h"

#include <sched.h>

#include <algorithm>
#include <thread>

namespace tandem {

unsigned usable_processors() {
    cpu_set_t usable;
    CPU_ZERO(&usable);
    // The call tells nothing of more processors than a cpu_set_t holds.
    if (sched_getaffinity(0, sizeof usable, &usable) == 0)
        return static_cast<unsigned>(std::max(1, CPU_COUNT(&usable)));
    return std::max(1u, std::thread::hardware_concurrency());
}

}  // namespace tandem
