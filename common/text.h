// How messages and reports write figures, and which of many things a list of names asks for.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

// "0.21 %": two significant figures, without the sign; beyond 100 % "7.3 times".
[[nodiscard]] std::string percent(double fraction);

// A relative difference: "+1.2 %"; beyond +100 % what is `fraction` more, "78 times" as much. No difference of figures
// above 0 is below -100 %, but an end of an interval may be.
[[nodiscard]] std::string signed_percent(double fraction);

// Whether `names` has the name; an empty list asks for everything.
[[nodiscard]] inline bool asked_for(std::string_view name, const std::vector<std::string>& names) {
    return names.empty() || std::ranges::find(names, name) != names.end();
}

}  // namespace tandem
