// The two sides of a verdict.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem {

enum class VerifiedSide : std::uint8_t { reference, candidate };
inline constexpr std::array<std::string_view, 2> verified_side_names{"reference", "candidate"};

[[nodiscard]] constexpr std::string_view name_of(VerifiedSide side) {
    return verified_side_names.at(static_cast<std::size_t>(side));
}

}  // namespace tandem
