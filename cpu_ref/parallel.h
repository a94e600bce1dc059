// Parallel loops by oneTBB, with annotations for the thread sanitizer. Debian's libtbb is not built with it. So the
// sanitizer does not see that the library orders a loop's start, parts and end.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstdint>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace tandem::cpu {

inline void happens_before([[maybe_unused]] void* event) {
#if defined(__SANITIZE_THREAD__)
    __tsan_release(event);
#endif
}

inline void happens_after([[maybe_unused]] void* event) {
#if defined(__SANITIZE_THREAD__)
    __tsan_acquire(event);
#endif
}

// body(i) for i in [0, count), in any order, in parallel.
template <class Body>
void parallel_for(tbb::task_arena& arena, std::uint32_t count, const Body& body) {
    char begun = 0, ended = 0;  // their addresses stand for the two events
    happens_before(&begun);
    arena.execute([&] {
        tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t index) {
            happens_after(&begun);
            body(index);
            happens_before(&ended);
        });
    });
    happens_after(&ended);
}

}  // namespace tandem::cpu
