// The arguments of tandem bench, and what follows from them for all its ways to measure.
#pragma once

#include <string>
#include <vector>

#include "common/commands/command_time.h"
#include "common/experiment/campaign.h"

namespace tandem {

struct BenchArguments {
    std::string scene = "scenes/cornell-thesis.json", device;
    std::vector<std::string> families, arms, sizes;
    std::string resume, method = "paired", csv;
    std::string arm_library, call_note;  // the note's file: this process is the one that calls the library
    bool validation = false;
    std::vector<std::string> compare;
    double seconds = 120.0, narrow = 0.01;
    std::uint64_t seed = 1;
    unsigned processes = 1, replicates = 8;
    bool list = false, self_test = false;
};

// check_outputs of --json, which may go on in the file of --resume, and of --csv, which may not.
void check_outputs(
    const BenchArguments& arguments, const CommandContext& context, const std::vector<std::string>& inputs);

[[nodiscard]] CampaignOptions campaign_options(const BenchArguments& arguments, const CommandTime& time);

// The same command for a process of its own, for its part of the campaign. It goes on from the file `known`, if any,
// and writes `file`.
[[nodiscard]] std::vector<std::string> words_of(
    const BenchArguments& arguments, const CampaignPart& part, const std::string& known, const std::string& file);

// Prints, and writes what is asked for.
void tell_results(const BenchArguments& arguments, const CommandContext& context, const BenchResults& results,
    const std::vector<Claim>& claims);

}  // namespace tandem
