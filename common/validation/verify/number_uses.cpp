#include "common/validation/verify/number_uses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "common/render/path_trace.h"
#include "common/render/random.h"
#include "common/validation/verify/fault_place.h"

namespace tandem {

namespace {

enum class Decides : std::uint8_t { camera, time, distance, light, direction, end, count };
constexpr std::array<std::string_view, 6> decided_names{"the ray of the camera", "the time",
    "the distance in the medium", "the point of the light", "the direction of scattering", "the end by roulette"};

// Counted from the vertex's first block, in section 3's table.
constexpr std::uint32_t medium_of_vertex = 2;

struct Number {
    ChangedNumber number;
    Decides purpose;
    std::string_view name;
};

// Section 3's table, but for the time: it moves things, so that all else may follow from it. A number without a purpose
// decides nothing by the bit that is changed.
std::vector<Number> numbers_at(std::size_t vertex) {
    const auto first = static_cast<std::uint32_t>(dimension::first_vertex + dimension::blocks_per_vertex * vertex);
    const std::uint32_t scatter = first + dimension::scatter, to_light = first + dimension::light,
                        medium = first + medium_of_vertex;
    std::vector<Number> numbers{{{scatter, 0}, Decides::direction, "scattering's first number"},
        {{scatter, 1}, Decides::direction, "scattering's second number"},
        {{scatter, 2}, Decides::direction, "scattering's third number"},
        {{scatter, 3}, Decides::end, "roulette's number"}, {{to_light, 0}, Decides::light, "the light's first number"},
        {{to_light, 1}, Decides::light, "the light's second number"},
        {{to_light, 2}, Decides::light, "the light's third number"},
        {{medium, 0}, Decides::distance, "the medium's first number"},
        {{medium, 1}, Decides::distance, "the medium's second number"}};
    // What only chooses has hardly an effect by its lower half.
    constexpr std::uint32_t lower = 15;
    const auto chooses = [&](std::uint32_t block, std::uint32_t number, std::string_view name) {
        numbers.push_back({{block, number, lower}, Decides::count, name});
    };
    chooses(scatter, 2, "scattering's third number, which only chooses,");
    chooses(scatter, 3, "roulette's number, which only chooses,");
    chooses(to_light, 0, "the light's first number, which only chooses,");
    chooses(medium, 0, "the medium's first number, which only chooses,");
    if (vertex > 0) return numbers;
    constexpr std::array<std::string_view, 4> names{
        "the film's first number", "the film's second number", "the lens's first number", "the lens's second number"};
    for (std::uint32_t i = 0; i < 4; ++i)
        numbers.push_back({{dimension::film_and_lens, i}, Decides::camera, names.at(i)});
    return numbers;
}

// How many paths were asked for each figure, with one number changed, and in how many it became another.
struct Answers {
    std::array<double, static_cast<std::size_t>(Decides::count)> asked{}, other{};
    void add(Decides what, bool differs) {
        asked[static_cast<std::size_t>(what)] += 1.0;
        other[static_cast<std::size_t>(what)] += differs ? 1.0 : 0.0;
    }
};

void compare(const PathTrace& plain, const PathTrace& changed, std::size_t vertex, Answers& answers) {
    if (std::min(plain.vertices.size(), changed.vertices.size()) <= vertex) return;
    const TracedVertex &a = plain.vertices[vertex], &b = changed.vertices[vertex];
    const bool arrives = a.origin == b.origin && a.direction == b.direction;
    if (vertex == 0) answers.add(Decides::camera, !arrives);
    if (!arrives) return;
    const bool there = a.in_medium == b.in_medium && a.t == b.t;
    if (vertex == 0 && !a.in_medium && !b.in_medium) answers.add(Decides::time, !there);
    if (a.in_medium || b.in_medium) answers.add(Decides::distance, !there);
    if (!there || a.throughput != b.throughput) return;
    if (a.next_event.direction != glm::dvec3(0.0) || b.next_event.direction != glm::dvec3(0.0))
        answers.add(Decides::light, a.next_event.direction != b.next_event.direction);
    if (a.survival > 0.0 && a.survival < 1.0 && a.survival == b.survival) answers.add(Decides::end, a.end != b.end);
    if (a.end == PathEnd::goes_on && b.end == PathEnd::goes_on)
        answers.add(Decides::direction, a.next_direction != b.next_direction);
}

Answers answers_of(RenderJob& job, const NumberPaths& paths, const ChangedNumber& number) {
    Answers answers;
    for (const glm::uvec2& pixel : paths.pixels) {
        const std::vector<PathTrace> plain = job.trace(pixel.x, pixel.y, first_block),
                                     changed = job.trace_with(number, pixel.x, pixel.y, first_block);
        for (std::size_t i = 0; i < plain.size(); ++i) compare(plain[i], changed[i], paths.vertex, answers);
    }
    return answers;
}

// Never on one side, often on the other. A number that decides something in a quarter of a side's paths decides nothing
// in 16 of them with a chance of 0.75^16 = 1 %.
bool apart(const Answers& a, const Answers& b, std::size_t what) {
    constexpr double fewest = 16.0, often = 0.25;
    if (a.asked[what] < fewest || b.asked[what] < fewest) return false;
    return a.other[what] == 0.0 && b.other[what] >= often * b.asked[what];
}

}  // namespace

NumberUses number_uses(const NumberPaths& paths) {
    NumberUses found;
    for (const Number& number : numbers_at(paths.vertex)) {
        const std::array answers{
            answers_of(paths.reference, paths, number.number), answers_of(paths.candidate, paths, number.number)};
        for (std::size_t what = 0; what < decided_names.size(); ++what)
            for (std::size_t side = 0; side < 2; ++side) {
                if (!apart(answers[1 - side], answers[side], what)) continue;
                const bool foreign = what != static_cast<std::size_t>(number.purpose);
                if (found.use == NumberUse::foreign || (found.use == NumberUse::own && !foreign)) continue;
                const std::array<std::string_view, 2> sides{"reference", "candidate"};
                found.use = foreign ? NumberUse::foreign : NumberUse::own;
                found.words = foreign ? fmt::format("{} decides {} of the {}", number.name, decided_names.at(what),
                                            sides.at(side))
                                      : fmt::format("{} does not decide {} of the {}", number.name,
                                            decided_names.at(what), sides.at(1 - side));
            }
    }
    return found;
}

}  // namespace tandem
