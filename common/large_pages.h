// Memory in large pages, for arrays that are written as a whole soon after they are made.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>

namespace tandem {

// An allocator that asks the system for large pages where an array fills half of one at least. Such an array takes
// whole pages. The first write to a page of 4 KiB took 2.4 µs on a host with an H200. For the sums of 256 x 144 pixels
// that is 1 ms, in which the GPU renders 16 samples.
template <class T>
class LargePages {
public:
    using value_type = T;

    LargePages() = default;
    template <class Other>
    explicit LargePages(const LargePages<Other>&) {}

    [[nodiscard]] T* allocate(std::size_t count) {
        if (!fills(count)) return std::allocator<T>().allocate(count);
        if (count > (std::numeric_limits<std::size_t>::max() - page) / sizeof(T)) throw std::bad_array_new_length();
        const std::size_t bytes = (count * sizeof(T) + page - 1) / page * page;
        void* const memory = std::aligned_alloc(page, bytes);
        if (memory == nullptr) throw std::bad_alloc();
        (void)::madvise(memory, bytes, MADV_HUGEPAGE);  // where the system has none, the pages are small
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t count) {
        if (fills(count))
            std::free(memory);
        else
            std::allocator<T>().deallocate(memory, count);
    }
    bool operator==(const LargePages&) const = default;

private:
    static constexpr std::size_t page = std::size_t{2} << 20;  // bytes, of x86-64
    [[nodiscard]] static constexpr bool fills(std::size_t count) { return count >= page / 2 / sizeof(T); }
};

}  // namespace tandem
