#include "common/text.h"

#include <fmt/format.h>

#include <cmath>

namespace tandem {

namespace {

constexpr double most_times = 1e4;  // beyond it a factor has no figures worth telling

std::string times(double factor) {
    if (factor >= most_times) return fmt::format("over {:.0f} times", most_times);
    return factor >= 10.0 ? fmt::format("{:.0f} times", factor) : fmt::format("{:.2g} times", factor);
}

}  // namespace

std::string percent(double fraction) {
    const double value = 100.0 * std::abs(fraction);
    if (!std::isfinite(value)) return "∞ %";
    if (value > 100.0) return times(std::abs(fraction));
    return value >= 10.0 ? fmt::format("{:.0f} %", value) : fmt::format("{:#.2g} %", value);
}

std::string signed_percent(double fraction) {
    if (!std::isfinite(fraction)) return fraction > 0.0 ? "+∞ %" : "-∞ %";
    if (fraction > 1.0) return times(1.0 + fraction);
    if (fraction < -1.0) return "below -100 %";
    const double value = 100.0 * fraction;
    return std::abs(value) >= 10.0 ? fmt::format("{:+.0f} %", value) : fmt::format("{:+.2g} %", value);
}

}  // namespace tandem
