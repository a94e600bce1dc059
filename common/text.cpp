#include "common/text.h"

#include <fmt/format.h>

#include <cmath>

namespace tandem {

std::string percent(double fraction) {
    const double value = 100.0 * std::abs(fraction);
    if (!std::isfinite(value)) return "∞ %";
    return value >= 10.0 ? fmt::format("{:.0f} %", value) : fmt::format("{:#.2g} %", value);
}

}  // namespace tandem
