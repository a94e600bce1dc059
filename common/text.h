// How messages and reports write figures and names. Also the selection of things by a list of names.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

// "0.21 %": two significant figures, without the sign; from 200 % on "7.3 times".
[[nodiscard]] std::string percent(double fraction);

// A relative difference: "+1.2 %"; beyond +100 % what is `fraction` more, "78 times" as much. No difference of figures
// above 0 is below -100 %, but an end of an interval may be.
[[nodiscard]] std::string signed_percent(double fraction);

// FNV-1a of 64 bits, in hexadecimal: tells damage, no malice.
[[nodiscard]] std::string hash_of(std::string_view bytes);

// Whether the text is UTF-8 [RFC 3629].
[[nodiscard]] bool is_utf8(std::string_view text);

// The text fit for one line of a message: control characters and what is no UTF-8 escaped.
[[nodiscard]] std::string escaped(std::string_view text);

// The text as one word of a shell's command line, quoted where it must be [POSIX.1-2017, Shell Command Language 2.2].
[[nodiscard]] std::string shell_word(std::string_view text);

// The text fit for a message, as `escaped`, and long text cut.
[[nodiscard]] std::string printable(std::string_view text);

// The candidate nearest to `name` by edit distance if one is near, else empty; of equals one that goes on where `name`
// ends.
[[nodiscard]] std::string nearest(std::string_view name, const std::vector<std::string>& candidates);

// "did you mean NAME? " with the nearest candidate, or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

// Digits and nothing else, in the range of `Number`; else nothing.
template <class Number>
[[nodiscard]] std::optional<Number> whole_number(std::string_view text) {
    Number value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// Whether `names` has the name; an empty list asks for everything.
[[nodiscard]] inline bool asked_for(std::string_view name, const std::vector<std::string>& names) {
    return names.empty() || std::ranges::find(names, name) != names.end();
}

}  // namespace tandem
