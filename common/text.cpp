#include "common/text.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <numeric>

namespace tandem {

namespace {

// Length in bytes of the UTF-8 sequence that begins `text`, 0 if it is none. [RFC 3629]
std::size_t utf8_length(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char lead = byte(0);
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xC2 ? 0
                               : lead < 0xE0 ? 2
                               : lead < 0xF0 ? 3
                               : lead < 0xF5 ? 4
                                             : 0;
    if (length == 0 || length > text.size()) return 0;
    for (std::size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xC0) != 0x80) return 0;
    // Longer than need be, surrogates, beyond U+10FFFF.
    const bool none = (lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xED && byte(1) > 0x9F) ||
                      (lead == 0xF0 && byte(1) < 0x90) || (lead == 0xF4 && byte(1) > 0x8F);
    return none ? 0 : length;
}

// As far as whole characters of it stay within `most` bytes.
std::string escaped_up_to(std::string_view text, std::size_t most) {
    std::string line;
    while (!text.empty()) {
        if (line.size() >= most) return line + "…";
        const std::size_t length = utf8_length(text);
        const auto lead = static_cast<unsigned char>(text.front());
        const bool control = length == 2 && lead == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0;  // U+0080 … 9F
        if (length == 0 || lead < 0x20 || lead == 0x7F || control) {
            line += fmt::format("\\x{:02x}", lead);
            text.remove_prefix(1);
        } else {
            line += text.substr(0, length);
            text.remove_prefix(length);
        }
    }
    return line;
}

// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({row[j] + 1, diagonal + 1, replaced});
        }
    }
    return row[b.size()];
}

constexpr double most_times = 1e4;  // beyond it a factor has no figures worth telling

std::string times(double factor) {
    if (factor >= most_times) return fmt::format("over {:.0f} times", most_times);
    return factor >= 10.0 ? fmt::format("{:.0f} times", factor) : fmt::format("{:.2g} times", factor);
}

}  // namespace

std::string percent(double fraction) {
    const double value = 100.0 * std::abs(fraction);
    if (!std::isfinite(value)) return "∞ %";
    constexpr double as_factor = 200.0;  // 2 digits of a factor tell less below it
    if (value >= as_factor) return times(std::abs(fraction));
    return value >= 10.0 ? fmt::format("{:.0f} %", value) : fmt::format("{:#.2g} %", value);
}

std::string signed_percent(double fraction) {
    if (!std::isfinite(fraction)) return fraction > 0.0 ? "+∞ %" : "-∞ %";
    if (fraction > 1.0) return times(1.0 + fraction);
    if (fraction < -1.0) return "below -100 %";
    const double value = 100.0 * fraction;
    return std::abs(value) >= 10.0 ? fmt::format("{:+.0f} %", value) : fmt::format("{:+.2g} %", value);
}

std::string hash_of(std::string_view bytes) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return fmt::format("{:016x}", hash);
}

bool is_utf8(std::string_view text) {
    while (!text.empty()) {
        const std::size_t length = utf8_length(text);
        if (length == 0) return false;
        text.remove_prefix(length);
    }
    return true;
}

std::string escaped(std::string_view text) { return escaped_up_to(text, std::string::npos); }

std::string shell_word(std::string_view text) {
    const auto is_plain = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
               std::string_view("_-+./:,=@%").find(c) != std::string_view::npos;
    };
    if (!text.empty() && std::ranges::all_of(text, is_plain)) return std::string(text);
    std::string word = "'";
    for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return word + "'";
}

std::string printable(std::string_view text) {
    constexpr std::size_t most_bytes = 160;
    return escaped_up_to(text, most_bytes);
}

std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
    if (name.size() > 64) return {};
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;  // further is no misspelling
    for (const std::string& candidate : candidates) {
        if (candidate.size() > 64) continue;
        const std::size_t distance = edit_distance(name, candidate);
        const bool goes_on = distance == best_distance && candidate.starts_with(name) && !best.starts_with(name);
        if (distance < best_distance || (goes_on && !best.empty())) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
    const std::string near = nearest(name, candidates);
    return near.empty() ? "" : "did you mean " + near + "? ";
}

}  // namespace tandem
