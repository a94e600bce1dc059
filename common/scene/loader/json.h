// Strict JSON for scene files. Duplicate keys, overflowing numbers, and documents that are too deep or too large are
// refused. A Value knows its place in the document, so every error names file, JSON pointer, reason and remedy. The
// meaning of a scene's fields is not known here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/text.h"

namespace tandem::scene_json {

using Json = nlohmann::json;

// Where an error is to be reported.
struct Place {
    std::string file;
    std::string pointer;
    std::shared_ptr<std::vector<std::string>> files;  // Value::files_read
};

// Parses `text` in time and memory linear in its size. Throws InputError: syntax errors with line and column, duplicate
// keys, numbers beyond double precision, nesting deeper than any scene needs.
[[nodiscard]] Json parse_strict(const std::string& text, const std::string& file);

// A number as a person would write it.
[[nodiscard]] std::string shown(double number);

// One value of the document with its place. Views refer to the document, which must outlive them.
class Value {
public:
    Value(const Json& json, std::string file) : json_(&json), document_(std::make_shared<Document>()) {
        document_->file = std::move(file);
    }

    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const;
    [[nodiscard]] Place place() const {
        return {
            document_->file, pointer_, std::shared_ptr<std::vector<std::string>>(document_, &document_->files_read)};
    }
    // Those that the document names, as they were read.
    [[nodiscard]] const std::vector<std::string>& files_read() const { return document_->files_read; }
    [[nodiscard]] const Json& json() const { return *json_; }

    // Objects. `only` checks that this is an object with no other keys; `required` refuses a missing key.
    void only(std::span<const std::string_view> keys) const;
    void only(std::initializer_list<std::string_view> keys) const { only(std::span(keys.begin(), keys.size())); }
    [[nodiscard]] bool has(std::string_view key) const;
    [[nodiscard]] Value required(std::string_view key) const;
    [[nodiscard]] Value member(std::string_view key) const;
    void for_each_member(const std::function<void(const std::string& key, const Value& value)>& visit) const;

    // Arrays.
    [[nodiscard]] std::size_t array_size() const;
    [[nodiscard]] Value element(std::size_t index) const;

    // Scalars, each refusing another type or a number out of its closed range.
    [[nodiscard]] double number(double least, double greatest) const;
    [[nodiscard]] std::uint32_t integer(std::uint32_t least, std::uint32_t greatest) const;
    [[nodiscard]] std::int32_t signed_integer(std::int32_t least, std::int32_t greatest) const;
    [[nodiscard]] bool boolean() const;
    [[nodiscard]] std::string text() const;
    [[nodiscard]] std::size_t choice(std::span<const std::string_view> names) const;  // index of the name
    [[nodiscard]] std::size_t choice(std::initializer_list<std::string_view> names) const {
        return choice(std::span(names.begin(), names.size()));
    }

    // Arrays of exactly three numbers.
    [[nodiscard]] glm::dvec3 vector(double least, double greatest) const;

    // The name of a file relative to the scene's, and nothing else.
    [[nodiscard]] std::string relative_file() const;

private:
    struct Document {
        std::string file;
        std::vector<std::string> files_read;
    };

    Value(const Json& json, std::shared_ptr<Document> document, std::string pointer)
        : json_(&json), document_(std::move(document)), pointer_(std::move(pointer)) {}
    void expect_object() const;
    void expect_number(const char* what) const;
    [[nodiscard]] double whole_number(double least, double greatest) const;
    [[nodiscard]] std::string found() const;

    const Json* json_;
    std::shared_ptr<Document> document_;
    std::string pointer_;
};

// Names that an object of the file defines, and what refers to them.
class Names {
public:
    // `kind` is for messages ("material"), `section` the key that defines them ("materials").
    Names(std::string kind, std::string section) : kind_(std::move(kind)), section_(std::move(section)) {}

    void add(const std::string& name, const Value& value);           // refuses the empty name
    [[nodiscard]] std::uint32_t find(const Value& reference) const;  // its place in the order of add; refuses others

private:
    std::string kind_, section_;
    std::vector<std::string> names_;
    std::map<std::string, std::uint32_t, std::less<>> index_;
};

}  // namespace tandem::scene_json
