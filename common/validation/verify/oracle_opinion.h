// If two renderers disagree, the reference oracle decides which of them is wrong. The oracle is a third Renderer. Like
// the rest of the suite, this file knows Renderers only.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "common/render/renderer.h"
#include "common/validation/verdict/verdict.h"

namespace tandem {

// Which side the closed form or the oracle contradicts.
enum class Outvoted { nobody, reference, candidate, both };
[[nodiscard]] const char* name_of(Outvoted outvoted);

// The side that the levels against the closed form are against; nobody where there are none.
[[nodiscard]] Outvoted outvoted_by_closed_form(const Judgement& judgement);

// "the oracle sides with CPU: Vulkan is off by +1.2 % (image, red)"; `off` says by how much each side is.
[[nodiscard]] std::string vote_of(const std::string& judge, Outvoted outvoted, const std::string& reference_name,
    const std::string& candidate_name, const std::string& reference_off, const std::string& candidate_off);

struct OracleOpinion {
    std::string name;  // "oracle"
    RendererInfo info;
    RenderSettings settings;    // size and integrator that it was asked with
    std::uint64_t samples = 0;  // a pixel
    double seconds = 0.0, budget_seconds = 0.0;
    Outvoted outvoted = Outvoted::nobody;
    std::optional<Judgement> reference, candidate;  // each side against the oracle; empty where it was not asked
    std::string text;                               // its vote, or why there is none
};

struct OracleQuestion {
    const Scene& scene;
    RenderSettings settings;  // of the verdict; the seed is the reference's
    Renderer& reference;
    Renderer& candidate;
    Renderer& oracle;
    std::string reference_name, candidate_name;
    std::optional<Rectangle> tile;           // where the sides differ most surely: asked about first
    bool both_miss_the_closed_form = false;  // then a miss of the oracle's ends the question
    Criteria criteria;
    double seconds_per_sample = 0.0;  // of both sides together, at the verdict's size
    double budget_seconds = 0.0;
    std::uint64_t max_samples = 0;  // a pixel
    std::stop_token stop;
    std::function<void(const std::string& text)> progress;
};

// First the tile alone, where there is one and the oracle renders pixels alone. It has a seed of its own, as the tile
// was chosen by the noise of the others. It may take half of the budget and half of the declared false alarms, spread
// over looks that double. Then the film.
//
// All three render the same seed, and each side is judged against the oracle. So paired differences (paired.h) see far
// more than the noise would let through. The size is the verdict's, halved until 512 samples fit the budget, as the
// oracle's speed on a tiny film foretells. Looks double up to what fits, and the first that contradicts a side ends it.
// The sides share the declared false alarms, spread over the looks. An oracle that lacks next-event estimation takes
// the integrator `path`, whose mean is the same. Variances are then not compared. A side is contradicted only beyond
// what rare samples may bring (Criteria::greatest).
[[nodiscard]] OracleOpinion ask_oracle(const OracleQuestion& request);

}  // namespace tandem
