#include "common/scene/loader/json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <system_error>

#include "common/error.h"

namespace tandem::scene_json {

namespace {

// The format nests nine deep; anything far beyond is a mistake or an attack.
constexpr std::size_t max_depth = 64;
constexpr std::size_t max_shown_bytes = 160;

// RFC 6901: '~' and '/' are escaped within a pointer; what cannot stand in a line of text is made printable.
std::string pointer_token(std::string_view key) {
    std::string token;
    for (const char c : key) {
        if (c == '~')
            token += "~0";
        else if (c == '/')
            token += "~1";
        else
            token += c;
    }
    return printable(token);
}

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
    return length;
}

// Builds the document from parser events; nlohmann's own builder keeps the last of two equal keys in silence.
class Builder : public nlohmann::json_sax<Json> {
public:
    Builder(const std::string& text, const std::string& file) : text_(text), file_(file) {}

    Json take() { return std::move(root_); }

    bool null() override { return scalar(nullptr); }
    bool boolean(bool value) override { return scalar(value); }
    bool number_integer(number_integer_t value) override { return scalar(value); }
    bool number_unsigned(number_unsigned_t value) override { return scalar(value); }
    bool number_float(number_float_t value, const string_t&) override { return scalar(value); }
    bool string(string_t& value) override { return scalar(std::move(value)); }
    bool binary(binary_t&) override { return false; }  // JSON text has none

    bool start_object(std::size_t) override { return open(Json::object()); }
    bool start_array(std::size_t) override { return open(Json::array()); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }

    bool key(string_t& name) override {
        if (open_.back()->contains(name))
            throw input_error(file_, pointer() + "/" + pointer_token(name), "the key stands twice in this object",
                "keep one of the two");
        key_ = std::move(name);
        return true;
    }

    bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
        const std::size_t end = std::min(position > 0 ? position - 1 : 0, text_.size());
        const auto before = std::string_view(text_).substr(0, end);
        const auto line = 1 + std::ranges::count(before, '\n');
        const std::size_t line_start = before.rfind('\n');
        const std::size_t column = end - (line_start == std::string_view::npos ? 0 : line_start + 1) + 1;
        if (error.id == 406)  // "number overflow parsing '…'"
            throw input_error(file_, "",
                fmt::format("line {}, column {}: a number is beyond double precision", line, column),
                "write a finite number");
        std::string reason = error.what();
        for (const std::string_view prefix : {"column ", ": "}) {
            const std::size_t found = reason.find(prefix);
            if (found != std::string::npos) reason.erase(0, found + prefix.size());
        }
        throw input_error(file_, "", fmt::format("line {}, column {}: not JSON: {}", line, column, printable(reason)),
            "scene files are plain JSON, without comments or trailing commas");
    }

private:
    Json* place(Json value) {
        if (open_.empty()) {
            root_ = std::move(value);
            return &root_;
        }
        Json& parent = *open_.back();
        if (parent.is_array()) {
            parent.push_back(std::move(value));
            return &parent.back();
        }
        return &(parent[key_] = std::move(value));
    }

    bool scalar(Json value) {
        place(std::move(value));
        return true;
    }

    bool open(Json container) {
        if (open_.size() == max_depth)
            throw input_error(file_, pointer(), fmt::format("nested deeper than {} levels", max_depth),
                "scenes/format/FORMAT.md shows the shape of a scene file");
        Json* const placed = place(std::move(container));
        if (open_.empty())
            names_.emplace_back();
        else
            names_.push_back(open_.back()->is_array() ? fmt::format("/{}", open_.back()->size() - 1)
                                                      : fmt::format("/{}", pointer_token(key_)));
        open_.push_back(placed);
        return true;
    }

    bool close() {
        open_.pop_back();
        names_.pop_back();
        return true;
    }

    std::string pointer() const { return std::accumulate(names_.begin(), names_.end(), std::string()); }

    const std::string& text_;
    const std::string& file_;
    Json root_;
    std::vector<Json*> open_;  // the containers around the current place
    std::vector<std::string> names_;
    std::string key_;
};

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

}  // namespace

std::string printable(std::string_view text) {
    std::string line;
    while (!text.empty()) {
        if (line.size() >= max_shown_bytes) return line + "…";
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

std::string shown(double number) { return fmt::format("{}", number); }

std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
    if (name.size() > 64) return {};
    std::string best;
    std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;  // further is no misspelling
    for (const std::string& candidate : candidates) {
        if (candidate.size() > 64) continue;
        const std::size_t distance = edit_distance(name, candidate);
        if (distance < best_distance) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

Json parse_strict(const std::string& text, const std::string& file) {
    Builder builder(text, file);
    Json::sax_parse(text, &builder);
    return builder.take();
}

void Value::refuse(const std::string& reason, const std::string& mend) const {
    throw input_error(*file_, pointer_, reason, mend);
}

std::string Value::found() const {
    switch (json_->type()) {
        case Json::value_t::null:
            return "null";
        case Json::value_t::object:
            return "an object";
        case Json::value_t::array:
            return "an array";
        case Json::value_t::string:
            return "the text \"" + printable(json_->get_ref<const std::string&>()) + "\"";
        case Json::value_t::boolean:
            return json_->get<bool>() ? "true" : "false";
        default:
            return "the number " + shown(json_->get<double>());
    }
}

void Value::expect_object() const {
    if (!json_->is_object()) refuse("is " + found(), "write an object, { … }");
}

void Value::only(std::span<const std::string_view> keys) const {
    expect_object();
    const std::vector<std::string> known(keys.begin(), keys.end());
    for (const auto& [key, value] : json_->items()) {
        if (std::ranges::find(known, key) != known.end()) continue;
        const std::string guess = nearest(key, known);
        std::string mend = guess.empty() ? "the keys known here are" : "did you mean \"" + guess + "\"?";
        if (guess.empty())
            for (const std::string& name : known) mend += (&name == known.data() ? " " : ", ") + name;
        Value(value, file_, pointer_ + "/" + pointer_token(key)).refuse("unknown key", mend);
    }
}

bool Value::has(std::string_view key) const { return json_->is_object() && json_->contains(key); }

Value Value::member(std::string_view key) const {
    return {(*json_)[std::string(key)], file_, pointer_ + "/" + pointer_token(key)};
}

Value Value::required(std::string_view key) const {
    expect_object();
    if (!has(key)) refuse(fmt::format("\"{}\" is missing", key), "add it; scenes/format/FORMAT.md says what it holds");
    return member(key);
}

void Value::for_each_member(const std::function<void(const std::string&, const Value&)>& visit) const {
    expect_object();
    for (const auto& [key, value] : json_->items())
        visit(key, Value(value, file_, pointer_ + "/" + pointer_token(key)));
}

std::size_t Value::array_size() const {
    if (!json_->is_array()) refuse("is " + found(), "write an array, [ … ]");
    return json_->size();
}

Value Value::element(std::size_t index) const {
    return {(*json_)[index], file_, pointer_ + "/" + std::to_string(index)};
}

void Value::expect_number(const char* what) const {
    if (!json_->is_number()) refuse("is " + found(), std::string("write ") + what);
}

double Value::number(double least, double greatest) const {
    expect_number("a number");
    const double value = json_->get<double>();
    // The comparison is false for NaN, which therefore never passes.
    if (!(value >= least && value <= greatest))
        refuse(fmt::format("{} is out of range", shown(value)),
            fmt::format("write a number from {} to {}", shown(least), shown(greatest)));
    return value;
}

double Value::whole_number(double least, double greatest) const {
    expect_number("a whole number");
    const double value = json_->get<double>();
    if (!(value >= least && value <= greatest) || value != std::floor(value))
        refuse(
            fmt::format("{} is {}", shown(value), value == std::floor(value) ? "out of range" : "not a whole number"),
            fmt::format("write a whole number from {} to {}", shown(least), shown(greatest)));
    return value;
}

std::uint32_t Value::integer(std::uint32_t least, std::uint32_t greatest) const {
    return static_cast<std::uint32_t>(whole_number(least, greatest));
}

std::int32_t Value::signed_integer(std::int32_t least, std::int32_t greatest) const {
    return static_cast<std::int32_t>(whole_number(least, greatest));
}

bool Value::boolean() const {
    if (!json_->is_boolean()) refuse("is " + found(), "write true or false");
    return json_->get<bool>();
}

std::string Value::text() const {
    if (!json_->is_string()) refuse("is " + found(), "write text in quotation marks");
    return json_->get<std::string>();
}

std::size_t Value::choice(std::span<const std::string_view> names) const {
    const std::string chosen = text();
    const auto place = std::ranges::find(names, std::string_view(chosen));
    if (place != names.end()) return static_cast<std::size_t>(place - names.begin());
    std::string known;
    for (const std::string_view name : names) known += fmt::format("{}\"{}\"", known.empty() ? "" : " or ", name);
    refuse("unknown choice \"" + printable(chosen) + "\"", "write " + known);
}

glm::dvec3 Value::vector(double least, double greatest) const {
    if (array_size() != 3) refuse(fmt::format("has {} elements", json_->size()), "write an array of three numbers");
    return {element(0).number(least, greatest), element(1).number(least, greatest), element(2).number(least, greatest)};
}

std::string Value::relative_file() const {
    std::string name = text();
    if (name.empty() || std::filesystem::path(name).is_absolute() || name.find('\0') != std::string::npos)
        refuse("is not a relative path", "name the file relative to the scene file");
    return name;
}

void Names::add(const std::string& name, const Value& value) {
    if (name.empty()) value.refuse("a " + kind_ + " without a name", "name it");
    index_.emplace(name, static_cast<std::uint32_t>(names_.size()));
    names_.push_back(name);
}

std::uint32_t Names::find(const Value& reference) const {
    const std::string name = reference.text();
    if (const auto found = index_.find(name); found != index_.end()) return found->second;
    constexpr std::size_t listed_at_most = 20;
    std::string list;
    for (std::size_t i = 0; i < std::min(names_.size(), listed_at_most); ++i)
        list += (i == 0 ? "" : ", ") + printable(names_[i]);
    if (names_.size() > listed_at_most) list += ", …";
    const std::string guess = nearest(name, names_);
    reference.refuse("unknown " + kind_ + " \"" + printable(name) + "\"",
        names_.empty() ? "define it under \"" + section_ + "\""
                       : (guess.empty() ? "" : "did you mean \"" + printable(guess) + "\"? ") + "known are " + list);
}

}  // namespace tandem::scene_json
