// Arrays of any size keep what is written, and large ones begin where large pages do.
#include <doctest/doctest.h>

#include <cstdint>
#include <new>
#include <numeric>
#include <vector>

#include "common/large_pages.h"

namespace tandem {
namespace {

using Array = std::vector<std::uint64_t, LargePages<std::uint64_t>>;
constexpr std::size_t half_page = (std::size_t{1} << 20) / sizeof(std::uint64_t);

TEST_CASE("arrays of a few bytes and of several large pages keep their values while they grow") {
    Array array;
    for (const std::size_t size : {std::size_t{1}, half_page - 1, half_page, 5 * half_page + 1}) {
        CAPTURE(size);
        const std::size_t before = array.size();
        array.resize(size);
        std::iota(array.begin() + static_cast<std::ptrdiff_t>(before), array.end(), before);
        std::uint64_t wrong = 0;
        for (std::size_t i = 0; i < size; ++i) wrong += array[i] != i;
        CHECK(wrong == 0);
        const bool at_large_page = reinterpret_cast<std::uintptr_t>(array.data()) % (std::size_t{2} << 20) == 0;
        CHECK((at_large_page || size < half_page));
    }
    const Array copy = array;
    CHECK(copy == array);
}

TEST_CASE("an array larger than memory is refused") {
    LargePages<std::uint64_t> pages;
    CHECK_THROWS_AS((void)pages.allocate(SIZE_MAX / 8), std::bad_alloc);
}

}  // namespace
}  // namespace tandem
