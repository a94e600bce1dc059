// The formulas of each effect (common/render/effects.def), each as it is when wrong. That is a planted bug, or an edit
// of the scene or settings where no bug is planted. Measured here: how much that changes a scene's image, on the CPU.
// scripts/measure/effects makes the table.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/render/effects.h"
#include "common/statistics/interval.h"
#include "tests/mutants/catalogue.h"

namespace tandem::test {

using Edit = std::function<void(Scene&, RenderSettings&)>;

struct Formula {
    Effect effect = Effect::count;
    std::string name;                 // a mutant's id, or what an edit does
    PlantedFault fault;               // or none:
    Edit edit;                        // what is wrong
    std::vector<std::string> scenes;  // to try, below scenes/
    Edit setting;                     // of both sides, where no scene asks for the effect; empty: none
};

// In the order of the effects. A bug has the greatest of its catalogued amounts, and the scenes that the catalogue
// names.
[[nodiscard]] std::vector<Formula> formulas();

struct ImageChange {
    Estimated relative;  // root of the sum over tiles and channels of squared differences, over that of the image. A
                         // black image's is over that of the wrong one
    std::uint32_t width = 0, height = 0;
    std::uint64_t samples = 0;  // a pixel and side
    double seconds = 0.0;
};

// Whether the scene, as the formula takes it, calls for the formula's effect.
[[nodiscard]] bool calls_for(const Formula& formula, const std::string& scene);
[[nodiscard]] ImageChange change_of(const Formula& formula, const std::string& scene);

}  // namespace tandem::test
