#include "common/exercise/marker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "common/exercise/checks.h"
#include "common/exercise/submission.h"
#include "common/render/random.h"
#include "common/rounding.h"
#include "common/validation/verify/trace_comparison.h"

namespace tandem {

namespace {

// Enough that a fault in a thousandth of all arguments shows (8192: but for e^-8), and that a density 3 % off does.
constexpr std::uint32_t pointwise_count = 8192, statistical_count = 1u << 18;

bool is_pointwise(CheckKind kind) { return kind == CheckKind::values || kind == CheckKind::property; }

// The answers of the student's function.
std::vector<Values> answers_to(const std::vector<Values>& arguments, std::size_t argument_count,
    std::size_t result_count, const std::string& shader) {
    std::vector<float> given;
    for (const Values& list : arguments)
        for (std::size_t k = 0; k < argument_count; ++k) given.push_back(static_cast<float>(list[k]));
    const std::vector<float> answers = run_apart(
        shader, given, static_cast<std::uint32_t>(arguments.size()), static_cast<std::uint32_t>(result_count));
    std::vector<Values> results(arguments.size());
    for (std::size_t i = 0; i < results.size(); ++i)
        for (std::size_t k = 0; k < result_count; ++k)
            results[i][k] = static_cast<double>(answers[i * result_count + k]);
    return results;
}

Trial trial_of(const Exercise& exercise, const std::string& text, std::uint64_t seed) {
    Trial trial;
    trial.exercise = &exercise;
    trial.argument_names = names_of_values(exercise.arguments);
    trial.result_names = names_of_values(exercise.results);
    const std::string shader = shader_of(exercise, text);
    const std::uint32_t count = is_pointwise(exercise.kind) ? pointwise_count : statistical_count;
    for (std::uint32_t i = 0; i < count; ++i) trial.arguments.push_back(drawn(exercise, seed, i));
    trial.results = answers_to(trial.arguments, trial.argument_names.size(), trial.result_names.size(), shader);
    return trial;
}

// What a ray's function finds about the ray at which it is most wrong. The direction turns from column to column and
// from row to row. Nothing for functions of other things.
std::optional<MarkPicture> picture_about(const Trial& trial, const std::string& text, const Values& worst) {
    constexpr std::uint32_t side = 65;  // odd: the ray itself is the pixel in the middle
    const auto place_of = [&](const char* name) -> std::size_t {
        return static_cast<std::size_t>(std::ranges::find(trial.argument_names, name) - trial.argument_names.begin());
    };
    const std::size_t at = place_of("direction.x"), none = trial.argument_names.size();
    if (at == none || place_of("origin.x") == none || trial.result_names.size() != 1) return std::nullopt;
    const glm::dvec3 forward = worst.three(at);
    const glm::dvec3 other = std::abs(forward.y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, other)), up = glm::cross(right, forward);
    std::vector<Values> arguments;
    for (std::uint32_t i = 0; i < side * side; ++i) {
        const double x = (i % side + 0.5) / (0.5 * side) - 1.0, y = 1.0 - (i / side + 0.5) / (0.5 * side);
        const glm::dvec3 turned = glm::normalize(forward + x * right + y * up);
        Values& list = arguments.emplace_back(worst);
        for (int c = 0; c < 3; ++c) list[at + static_cast<std::size_t>(c)] = rounded_to_single(turned[c]);
    }
    MarkPicture picture{.side = side, .right = {}, .yours = {}, .shows = {}};
    picture.shows =
        fmt::format("{} of rays from that origin, turned by up to 45 degrees: left to right, and up and down",
            trial.result_names[0]);
    const std::vector<Values> found = answers_to(arguments, none, 1, shader_of(*trial.exercise, text));
    for (std::uint32_t i = 0; i < side * side; ++i) {
        Values exact;
        trial.exercise->answer(arguments[i], exact);
        picture.right.push_back(exact[0]);
        picture.yours.push_back(found[i][0]);
    }
    return picture;
}

std::string text_of(const glm::dvec3& v) { return fmt::format("({:.5g}, {:.5g}, {:.5g})", v.x, v.y, v.z); }

// "meets the sphere at (1, 2, 3)", "goes on along (0, 0, 1)"; what both do alike is left out.
std::string step_of(const Scene& scene, const TracedVertex& vertex, const TracedVertex& other) {
    if (!std::isfinite(glm::length(vertex.next_direction)) || std::isnan(vertex.t)) return "is not a number";
    if (!std::isfinite(vertex.t)) return "meets nothing";
    if (vertex.position != other.position || !std::isfinite(other.t))
        return fmt::format("meets the {} at {}{}", scene.entities.front().name, text_of(vertex.position),
            vertex.t < 0.0 ? ", behind its origin" : "");
    return vertex.end == PathEnd::goes_on ? "goes on along " + text_of(vertex.next_direction) : "ends there";
}

// The angle between two directions; nothing where one is none.
std::string angle_between(const TracedVertex& a, const TracedVertex& b) {
    const double both = glm::length(a.next_direction) * glm::length(b.next_direction);
    if (a.position != b.position || !(both > 0.0) || !std::isfinite(both)) return "";
    const double cosine = glm::dot(a.next_direction, b.next_direction) / both;
    return fmt::format(", {:.3g} degrees apart", std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi);
}

// Adds where the path of the worst answer parts from the right one, where the function is a step of a path.
void add_paths(PicturedMark& pictured, const Trial& trial, std::size_t worst) {
    if (trial.exercise->path == nullptr) return;
    Values exact;
    trial.exercise->answer(trial.arguments[worst], exact);
    PartedPaths paths{.right = trial.exercise->path(trial.arguments[worst], exact),
        .yours = trial.exercise->path(trial.arguments[worst], trial.results[worst]).path};
    const TraceComparison comparison = compare_traces(paths.right.path, paths.yours, CompareRadiance::no);
    if (!comparison.first_divergence) return;
    const std::size_t k = std::min(*comparison.first_divergence, comparison.vertices.size() - 1);
    const TracedVertex &right = paths.right.path.vertices[k], &yours = paths.yours.vertices[k];
    pictured.mark.evidence.push_back(
        fmt::format("the paths part at vertex {}: right {}; yours {}{}", k, step_of(paths.right.scene, right, yours),
            step_of(paths.right.scene, yours, right), angle_between(right, yours)));
    pictured.paths = std::move(paths);
}

// Where the function fails only there, the mark stands without the picture.
void add_picture(PicturedMark& pictured, const Trial& trial, const std::string& text, std::size_t worst) {
    try {
        pictured.picture = picture_about(trial, text, trial.arguments[worst]);
    } catch (const SubmissionFailure& failure) {
        pictured.mark.evidence.push_back(std::string("no picture, as it ") + failure.what());
    }
}

PicturedMark marked(const Exercise& exercise, const std::string& text, std::uint64_t seed, bool with_picture) {
    PicturedMark pictured;
    Mark& mark = pictured.mark;
    try {
        const Trial trial = trial_of(exercise, text, seed);
        std::size_t worst = 0;
        switch (exercise.kind) {
            case CheckKind::values:
                mark = check_values(trial, &worst);
                if (mark.kind == MarkKind::wrong) add_paths(pictured, trial, worst);
                if (mark.kind == MarkKind::wrong && with_picture) add_picture(pictured, trial, text, worst);
                break;
            case CheckKind::property:
                mark = check_property(trial);
                break;
            case CheckKind::distribution:
                mark = check_distribution(trial, seed, with_picture ? &pictured.picture : nullptr);
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
    return pictured;
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
    for (double& x : arguments.list) x = rounded_to_single(x);
    return arguments;
}

Mark mark_of(const Exercise& exercise, const std::string& text, std::uint64_t seed) {
    return marked(exercise, text, seed, false).mark;
}

PicturedMark pictured_mark_of(const Exercise& exercise, const std::string& text, std::uint64_t seed) {
    return marked(exercise, text, seed, true);
}

std::string_view name_of(MarkKind kind) {
    return kind == MarkKind::right ? "right" : kind == MarkKind::wrong ? "wrong" : "undecided";
}

}  // namespace tandem
