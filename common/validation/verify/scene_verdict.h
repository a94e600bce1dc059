// Everything that a report says of one scene, or of one comparison of images: plain data.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/render/binned_film.h"
#include "common/render/renderer.h"
#include "common/scene/export/misreading.h"
#include "common/validation/explanation/explanation.h"
#include "common/validation/explanation/likeness.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/verdict/verdict.h"
#include "common/validation/verify/convergence.h"
#include "common/validation/verify/oracle_opinion.h"
#include "common/validation/verify/worst_pixel.h"

namespace tandem {

// One row of the history of looks.
struct Look {
    std::uint64_t samples = 0;  // a pixel and side
    std::uint64_t paired_samples = 0;
    LookShare share;
    Verdict verdict = Verdict::undecided;
    double least_p = 1.0;      // over levels, each corrected for its own tests
    double image_bound = 0.0;  // relative
    double tile_bound = 0.0;
    double seconds = 0.0;  // since the start
};

// Everything that a report says of one scene (or of one comparison of images).
struct SceneVerdict {
    std::string scene;
    Verdict verdict = Verdict::undecided;
    std::string sentence;
    std::string failure;             // why one side is no image to judge: a program that crashed; empty: both are
    std::vector<std::string> notes;  // what a reader must know of the images that were compared
    Judgement judgement;             // of the last look
    PairedResult paired;
    std::vector<Look> looks;
    // Exact check beside the levels, where there are four batches a side: permutation of batches, greatest |t| over
    // tiles and channels. It gates nothing (its least p, 1/1000, is too coarse).
    std::optional<double> permutation_p;
    std::vector<Explanation> explanations;          // looked for where the sides disagree
    std::optional<Signature> signature;             // ... and the paths of both can be traced
    std::optional<Likeness> likeness;               // to planted bugs, where any is near
    std::optional<PathPartings> partings;           // of the traced paths, with the signature
    FaultPlace fault_place;                         // where the sides disagree
    std::optional<PrecisionTrial> precision_trial;  // ... and a side is right in double precision
    std::optional<DataTrial> data_trial;            // ... and a side has wrong data of the scene
    std::optional<Elimination> elimination;         // ... from each other
    std::optional<MissedForm> missed_form;          // where both miss the closed form alike
    std::vector<Suspect> suspects;                  // likeliest first; of a disagreement, where anything is known
    std::optional<PartRanking> ranking;             // what they follow from, where the sides differ
    std::vector<SceneFeature> features;             // of the scene
    ClosedFormUse closed_form;                      // of the scene, at these settings
    std::optional<OracleOpinion> oracle;            // asked where the sides disagree
    std::optional<ConvergenceReport> convergence;   // where it was asked for; it gates nothing
    std::optional<Misreading> misreading;           // what was loaded otherwise than the scene's file says
    Outvoted outvoted = Outvoted::nobody;           // by the closed form, else by the oracle
    std::optional<WorstPixel> worst;                // where there were looks at two renderers
    std::string reference_name, candidate_name;
    RendererInfo reference_info, candidate_info;
    RenderSettings settings;
    std::optional<FilmSize> film;  // of which settings.width x settings.height bins were judged; empty: settings' own
    Criteria criteria;
    std::uint64_t reference_seed = 0, candidate_seed = 0;
    SampledImage reference, candidate;
    double reference_seconds = 0.0, candidate_seconds = 0.0;  // rendering, paired samples included
    double seconds = 0.0;                                     // all
    bool stopped = false;
    std::optional<double> forecast_seconds;  // that an undecided scene would take (total_budget.h)
};

// Whether the sides differ from each other, not only from the closed form.
[[nodiscard]] bool sides_differ(const SceneVerdict& verdict);

// Row of the history for a judgement on `samples` a pixel and side, made `seconds` after the start.
[[nodiscard]] Look look_of(const Judgement& judgement, std::uint64_t samples, const LookShare& share, double seconds);

// The sides do not differ, and both miss the scene's closed form.
[[nodiscard]] bool misses_on_both_sides(const SceneVerdict& verdict);

// Where a scene has closed forms against both sides, those of its features are suspected first that none of the scenes
// has which meet theirs. Whether there is such a scene, and one that meets its own.
bool compare_misses(std::span<SceneVerdict> verdicts);

// Sets the verdict, its sentence, the permutation check and, where the sides disagree, the explanations, all from
// the judgement and the two sides at hand. A misreading of the scene is a disagreement whatever the sides show.
void conclude(SceneVerdict& verdict);

}  // namespace tandem
