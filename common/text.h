// How messages and reports write figures, and which of many things a list of names asks for.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

// "0.21 %": two significant figures, without the sign.
[[nodiscard]] std::string percent(double fraction);

// Whether `names` has the name; an empty list asks for everything.
[[nodiscard]] inline bool asked_for(std::string_view name, const std::vector<std::string>& names) {
    return names.empty() || std::ranges::find(names, name) != names.end();
}

}  // namespace tandem
