// The words of pbrt's scene text: numbers, texts and lists of parameters, each with its line. What they mean is
// for pbrt_state.cpp and pbrt_import.cpp.
#pragma once

#include <fmt/format.h>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/text.h"

namespace tandem::scene_import {

struct Token {
    std::string text;
    bool quoted = false;
    std::size_t line = 0;
};

struct Parameter {
    std::string type;
    std::vector<Token> values;
    mutable bool used = false;
};

using Parameters = std::map<std::string, Parameter>;

// Each reader refuses, by the file's line, what is not there or is of another type.
class PbrtText {
public:
    PbrtText(std::string file, const std::string& text);

protected:
    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const;

    const Token& next(const char* what);
    std::string text(const char* what);
    double number();
    glm::dvec3 point();
    glm::dmat4 matrix();

    // "type name" value, or [ values ].
    Parameters parameters();
    const Parameter* find(const Parameters& parameters, const std::string& name) const;
    double real(const Parameters& parameters, const std::string& name, double otherwise) const;
    std::string word(const Parameters& parameters, const std::string& name, const std::string& otherwise) const;
    std::optional<glm::dvec3> colour(const Parameters& parameters, const std::string& name) const;
    template <int size>
    std::vector<glm::vec<size, double>> vectors(const Parameters& parameters, const std::string& name) const {
        const Parameter* found = find(parameters, name);
        std::vector<glm::vec<size, double>> list;
        if (found == nullptr) return list;
        if (found->values.size() % static_cast<std::size_t>(size) != 0)
            refuse(fmt::format("{} has {} numbers", printable(name), found->values.size()),
                fmt::format("write {} each", size));
        for (std::size_t i = 0; i < found->values.size(); i += static_cast<std::size_t>(size)) {
            list.emplace_back();
            for (int k = 0; k < size; ++k) list.back()[k] = number_of(found->values[i + static_cast<std::size_t>(k)]);
        }
        return list;
    }
    // Refuses those that nobody asked for: they change the image, for all that is known here.
    void only(
        const Parameters& parameters, const std::string& what, std::initializer_list<const char*> harmless = {}) const;
    double number_of(const Token& token) const;

    std::string file_;
    std::vector<Token> tokens_;
    std::size_t at_ = 0;
};

}  // namespace tandem::scene_import
