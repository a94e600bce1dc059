// Numbers that are the same in every run, for tests that mutilate files.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::test {

// Each call a number below a bound: xorshift64 [Marsaglia 2003].
class Draw {
public:
    std::size_t operator()(std::size_t below) {
        state_ ^= state_ << 13;
        state_ ^= state_ >> 7;
        state_ ^= state_ << 17;
        return static_cast<std::size_t>(state_ % below);
    }

private:
    std::uint64_t state_ = 1;
};

}  // namespace tandem::test
