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

}  // namespace

std::string shown(double number) { return fmt::format("{}", number); }

Json parse_strict(const std::string& text, const std::string& file) {
    Builder builder(text, file);
    Json::sax_parse(text, &builder);
    return builder.take();
}

void Value::refuse(const std::string& reason, const std::string& mend) const {
    throw input_error(document_->file, pointer_, reason, mend);
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
        Value(value, document_, pointer_ + "/" + pointer_token(key)).refuse("unknown key", mend);
    }
}

bool Value::has(std::string_view key) const { return json_->is_object() && json_->contains(key); }

Value Value::member(std::string_view key) const {
    return {(*json_)[std::string(key)], document_, pointer_ + "/" + pointer_token(key)};
}

Value Value::required(std::string_view key) const {
    expect_object();
    if (!has(key)) refuse(fmt::format("\"{}\" is missing", key), "add it; scenes/format/FORMAT.md says what it holds");
    return member(key);
}

void Value::for_each_member(const std::function<void(const std::string&, const Value&)>& visit) const {
    expect_object();
    for (const auto& [key, value] : json_->items())
        visit(key, Value(value, document_, pointer_ + "/" + pointer_token(key)));
}

std::size_t Value::array_size() const {
    if (!json_->is_array()) refuse("is " + found(), "write an array, [ … ]");
    return json_->size();
}

Value Value::element(std::size_t index) const {
    return {(*json_)[index], document_, pointer_ + "/" + std::to_string(index)};
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
