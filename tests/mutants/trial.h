// One planted bug on one scene, judged as `tandem verify` judges it: default criteria, the false alarms shared among
// the shipped scenes. Only the effort is chosen: image, samples, seconds.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/validation/verify/elimination.h"
#include "common/validation/verify/path_partings.h"
#include "common/validation/verify/verify.h"
#include "tests/mutants/catalogue.h"

namespace tandem::test {

struct Effort {
    std::uint32_t longer_side = 128;  // of the image, at most
    std::uint64_t samples = 0;        // a pixel and side, at most, more on films below 64x32; 0: verify's own limit
    std::size_t looks = 6;
    double seconds = 120.0;
    bool long_paths = true;  // looks at single samples also take paths beyond two bounces
    bool explained = false;  // where the sides disagree: the signature, and which part is suspected
};

// From little to that of `tandem verify` itself.
inline constexpr std::array efforts{Effort{64, 512, 2, 3600.0}, Effort{128, 2048, 3, 3600.0}, Effort{128, 0, 6, 120.0}};

// One short look, for bugs that are known to show.
inline constexpr Effort least_effort{48, 128, 1, 3600.0, false};

// Patterns show before small amounts do.
inline constexpr Effort signature_effort{48, 128, 1, 3600.0, false, true};

// Who told a bug: the two backends, by how they differ, or the closed form, by how it differs from a side. Backends
// that have the same bug may still differ, where what it does is a matter of rounding (which rays meet their own
// surface). But that they are not alike is no merit of the suite. So a bug in both counts as caught by the closed form
// alone.
struct Trial {
    std::string scene;
    bool caught = false;
    std::string witness;              // "backends" or "closed form"; empty: not caught
    std::string level;                // its most significant, or "fixed pixels", "invalid samples"; empty: none
    std::vector<std::string> levels;  // all that are significant, of either witness
    std::vector<std::string> blamed;  // subsystems, likeliest first, that the verdict names (likeness.h)
    bool coarse_arithmetic = false;   // the verdict says so, which is a fault with --strict alone
    std::uint64_t samples = 0;        // a pixel and side at the last look, the paired ones not counted
    std::uint32_t width = 0, height = 0;
    double seconds = 0.0;
    std::string sentence;
};

// What a bug's difference needs of a scene, in the image of signature_effort.
struct Needs {
    PathPartings partings;
    Elimination elimination;
};
[[nodiscard]] Needs needs_of(const PlantedFault& fault, Planting planting, const std::string& scene);

[[nodiscard]] std::filesystem::path scene_file(const std::string& name);
[[nodiscard]] std::vector<std::string> shipped_scenes();  // names, below scenes/ itself

// The CPU is the reference, as in `tandem verify`.
[[nodiscard]] SceneVerdict verdict_of(
    const PlantedFault& fault, Planting planting, const std::string& scene, const Effort& effort);
// bug: its name, which is left out where subsystems are named.
[[nodiscard]] Trial trial_of(
    const SceneVerdict& verdict, Planting planting, const std::string& scene, std::string_view bug = {});

}  // namespace tandem::test
