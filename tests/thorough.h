// Whether the long run of the tests is on, `scripts/test full`, which the presets but `release` ask for. Then tests
// repeat on every scene, effect or combination what they otherwise show on some.
#pragma once

#include <cstdlib>

namespace tandem::test {

[[nodiscard]] inline bool thorough() { return std::getenv("TANDEM_THOROUGH") != nullptr; }

}  // namespace tandem::test
