#include "common/exercise/marker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/exercise/checks.h"
#include "common/exercise/submission.h"
#include "common/render/random.h"

namespace tandem {

namespace {

// Enough that a fault in a thousandth of all arguments shows (8192: but for e^-8), and that a density 3 % off does.
constexpr std::uint32_t pointwise_count = 8192, statistical_count = 1u << 18;

bool is_pointwise(CheckKind kind) { return kind == CheckKind::values || kind == CheckKind::property; }

Trial trial_of(const Exercise& exercise, const std::string& text, std::uint64_t seed) {
    Trial trial;
    trial.exercise = &exercise;
    trial.argument_names = names_of_values(exercise.arguments);
    trial.result_names = names_of_values(exercise.results);
    const std::string shader = shader_of(exercise, text);
    const std::uint32_t count = is_pointwise(exercise.kind) ? pointwise_count : statistical_count;
    std::vector<float> given;
    for (std::uint32_t i = 0; i < count; ++i) {
        Values arguments = drawn(exercise, seed, i);
        for (std::size_t k = 0; k < trial.argument_names.size(); ++k) given.push_back(static_cast<float>(arguments[k]));
        trial.arguments.push_back(arguments);
    }
    const auto width = static_cast<std::uint32_t>(trial.result_names.size());
    const std::vector<float> answers = run_apart(shader, given, count, width);
    for (std::uint32_t i = 0; i < count; ++i) {
        Values& results = trial.results.emplace_back();
        for (std::uint32_t k = 0; k < width; ++k) results[k] = static_cast<double>(answers[std::size_t{i} * width + k]);
    }
    return trial;
}

}  // namespace

Values drawn(const Exercise& exercise, std::uint64_t seed, std::uint32_t index) {
    Values numbers, arguments;
    for (std::uint32_t block = 0; block < Values::most / 4; ++block) {
        const RandomBlock words = random_block(seed, index, 0, block);
        for (std::size_t k = 0; k < 4; ++k) numbers[4 * block + k] = to_unit<double>(words[k]);
    }
    exercise.draw(numbers, arguments);
    // As the shader gets them.
    for (double& x : arguments.list) x = static_cast<double>(static_cast<float>(x));
    return arguments;
}

Mark mark_of(const Exercise& exercise, const std::string& text, std::uint64_t seed) {
    Mark mark;
    try {
        const Trial trial = trial_of(exercise, text, seed);
        switch (exercise.kind) {
            case CheckKind::values:
                mark = check_values(trial);
                break;
            case CheckKind::property:
                mark = check_property(trial);
                break;
            case CheckKind::distribution:
                mark = check_distribution(trial, seed);
                break;
            case CheckKind::expectation:
                mark = check_expectation(trial);
                break;
        }
        mark.ran = true;
    } catch (const RefusedSubmission& refusal) {
        mark.summary = std::string("it is not run: ") + refusal.what();
    } catch (const SubmissionFailure& failure) {
        mark.summary = std::string("it ") + failure.what();
        mark.evidence = failure.log();
    }
    if (mark.errs_like.size() > 3) mark.errs_like.resize(3);
    return mark;
}

std::string_view name_of(MarkKind kind) {
    return kind == MarkKind::right ? "right" : kind == MarkKind::wrong ? "wrong" : "undecided";
}

}  // namespace tandem
