// The catalogue of planted bugs (VALIDATION 6): which bug (common/render/planted_bugs.h), with which amounts, in which
// backend. The shipped scenes that should show it come the cheapest first.
#pragma once

#include <string>
#include <vector>

#include "common/render/planted_bugs.h"
#include "common/validation/explanation/likeness.h"

namespace tandem::test {

enum class Planting : std::uint32_t { cpu, vulkan, both };  // both: the closed forms alone can notice
[[nodiscard]] const char* name_of(Planting planting);

struct Mutant {
    PlantedFault fault;
    Planting planting = Planting::cpu;
    std::vector<std::string> scenes;  // file names without ending, below scenes/
    bool unbiased = false;            // the image's mean is right: paths differ from what MODEL.md says
    bool tuned_for = true;            // else it was never looked at how to find it: MUTANTS.md tells of these apart
    // "albedo-scaled-0.01", "cosine-dropped"
    [[nodiscard]] std::string id() const;
};

// Where the bug lies. If it could be said to lie in several places, the one whose code a developer would open.
[[nodiscard]] Subsystem subsystem_of(PlantedBug bug);

// Changes what the bug hides from: some show with --light-sampling tree alone, or with a pixel filter.
void make_visible(PlantedBug bug, RenderSettings& settings);

// Every bug with each of its amounts in each of its backends, and in both where a closed form knows its effect.
[[nodiscard]] const std::vector<Mutant>& catalogue();

// The bugs that are not planted in both, in the catalogue's order, and why.
struct NotInBoth {
    PlantedBug bug = PlantedBug::none;
    std::string reason;
};
[[nodiscard]] std::vector<NotInBoth> not_in_both();

}  // namespace tandem::test
