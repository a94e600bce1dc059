// The marks of a class: a folder for each student, marked in parallel, and what marking systems read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "common/exercise/marker.h"

namespace tandem {

struct StudentMark {
    std::size_t exercise = 0;  // its number
    std::string file;          // relative to the student's folder; empty: nothing was handed in
    Mark mark;
    double seconds = 0.0;
};

struct Student {
    std::string name;
    std::filesystem::path folder;
    std::vector<StudentMark> marks;  // of every exercise that is due, in their order
    [[nodiscard]] std::size_t right() const;
};

// The students of a folder: its folders, or, where it has files NN-….glsl itself, the one that it is of. Each gets a
// mark for each exercise of `due`; where that is empty, for those that anybody handed in. Links are not followed. From
// several files for an exercise the first by name counts. Throws InputError where there is no submission.
[[nodiscard]] std::vector<Student> students_of(
    const std::filesystem::path& folder, std::span<const Exercise> exercises, std::vector<std::size_t> due);

// Fills in the marks, so many at a time. `tell` is called after each with the share that is done, by one thread at a
// time.
void mark_all(std::vector<Student>& students, std::span<const Exercise> exercises, std::uint64_t seed,
    unsigned at_a_time, const std::function<void(double)>& tell, const std::stop_token& stop);

// Summary, evidence and likely causes as lines.
[[nodiscard]] std::string feedback_of(const Mark& mark);

// A testsuite a student, a testcase an exercise: wrong is a failure, undecided an error.
[[nodiscard]] std::string class_junit(const std::vector<Student>& students, std::span<const Exercise> exercises);
// The results.json of a Gradescope autograder for one student, with one point an exercise.
[[nodiscard]] nlohmann::json gradescope_results(const Student& student, std::span<const Exercise> exercises);
// For one student, what a combinator template grader of Moodle's CodeRunner prints.
[[nodiscard]] nlohmann::json coderunner_results(const Student& student, std::span<const Exercise> exercises);

}  // namespace tandem
