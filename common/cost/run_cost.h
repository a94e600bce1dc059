// The whole of `tandem cost` on one scene and backend: the reference, a short stage, then the stages of the schedule.
// The short stage has all arms, and the best of them together.
#pragma once

#include <filesystem>

#include "common/cost/cost.h"
#include "common/error.h"
#include "common/files/write_file.h"

namespace tandem {

struct CostRequest {
    std::string scene_file;   // as a command names it
    std::string scene_bytes;  // the content of all files that were read, or hashes of it, for the reference's key
    std::string program;      // version, likewise
    ArmSettings baseline;
    std::vector<std::pair<std::string, std::string>> given;  // the options of `tandem render` that make the baseline
    std::string backend, reference_backend;
    MakeRenderer make, make_reference;
    std::vector<std::string> knobs;    // only these; empty: all
    std::filesystem::path references;  // folder of cached references, made if it is not there; empty: none
    // Told why a file there can be neither read nor written, which is then done without. Empty: it is thrown.
    std::function<void(const InputError&)> cache_fault = {};
    std::filesystem::path reference_file;  // one that was rendered before, maybe elsewhere; empty: none
    const FilesRead* read = nullptr;       // that are not to be replaced
    double seconds = 120.0;                // for everything, as planned; a stop cuts
    std::uint64_t seed = 1;
    unsigned threads = 0;                         // that denoise; 0: as many as the machine has
    std::optional<CostSamples> earlier;           // a measurement to continue
    std::function<void(const CostReport&)> keep;  // what is known after a stage
};

// The options of two command lines in one. What both say is said once, as `more` has it.
[[nodiscard]] std::string with_options(const std::string& before, const std::string& more);

// The single arms of a request, and those that cannot matter. `renderer`: the baseline's. `mean` of the image, 0: not
// known yet.
[[nodiscard]] std::vector<CostArm> single_arms(const Scene& scene, const CostRequest& request,
    const RendererInfo& renderer, double mean, std::vector<SkippedArm>& skipped);

// Throws InputError for knobs that there are not, an earlier measurement of something else, a black image. Throws
// StoppedError where a stop came before anything was known.
[[nodiscard]] CostReport run_cost(const Scene& scene, CostRequest request, const CostControl& control);

}  // namespace tandem
