// An exercise: a function that a student writes in GLSL, and how it is checked. cpu_ref/exercises holds thirty of them,
// a row each. The marker (marker.h) works on any.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/render/path_trace.h"

namespace tandem {

// Arguments or results of a function, one number after the other: a vec3 takes three.
struct Values {
    static constexpr std::size_t most = 16;
    std::array<double, most> list{};

    double& operator[](std::size_t i) { return list[i]; }
    double operator[](std::size_t i) const { return list[i]; }
    [[nodiscard]] glm::dvec2 two(std::size_t i) const { return {list[i], list[i + 1]}; }
    [[nodiscard]] glm::dvec3 three(std::size_t i) const { return {list[i], list[i + 1], list[i + 2]}; }
    void set(std::size_t i, const glm::dvec2& v) { list[i] = v.x, list[i + 1] = v.y; }
    void set(std::size_t i, const glm::dvec3& v) { list[i] = v.x, list[i + 1] = v.y, list[i + 2] = v.z; }
};

// What turns arguments into results.
using Answer = void (*)(const Values& arguments, Values& results);

// A bug that students make.
struct WrongAnswer {
    std::string_view name;  // as the mark says it: "the cosine is dropped"
    Answer answer;
};

// A path that a function's results make, and the scene that it goes through: the camera stands where the path begins.
struct ExercisePath {
    Scene scene;
    std::array<std::uint32_t, 2> pixel{};  // through which the right path begins
    PathTrace path;
};

enum class CheckKind {
    values,        // each result is that of `answer`, but for rounding
    distribution,  // results are distributed as those of `answer`
    expectation,   // the mean of the results is that of `answer`
    property,      // many answers are right: `fault` says how far a result is from being one
};

struct Exercise {
    std::string_view slug;  // of the file: 03-slug.glsl
    std::string_view title;
    std::string_view lesson;     // its two digits
    std::string_view task;       // lines of at most 96 characters
    std::string_view prototype;  // of the function, as the student is to write it
    std::string_view call;       // GLSL: reads given(k), given2(k), given3(k); writes answer(k, x)
    std::string_view arguments;  // "origin:3 radius": names and counts of numbers
    std::string_view results;
    CheckKind kind;
    Answer draw;    // arguments from Values::most independent numbers, uniform in [0, 1)
    Answer answer;  // by the reference backends, in double precision
    std::vector<WrongAnswer> wrong;
    // distribution: arguments (0 … most − 1) and results as one list, to two coordinates in [0, 1).
    glm::dvec2 (*place)(const Values& arguments, const Values& results) = nullptr;
    // How far the results are from what they must be, in tolerances: above 1 is wrong. Also NaN is.
    double (*fault)(const Values& arguments, const Values& results) = nullptr;
    // values, of functions that are a step of a path: that path.
    ExercisePath (*path)(const Values& arguments, const Values& results) = nullptr;
};

// Names of single numbers: "origin.x origin.y origin.z radius".
[[nodiscard]] std::vector<std::string> names_of_values(std::string_view list);

}  // namespace tandem
