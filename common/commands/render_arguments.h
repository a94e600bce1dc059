// The arguments of `tandem render`: its options, what they mean together, and the files that it writes.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/commands/command.h"
#include "common/render/estimate.h"
#include "common/render/stopping.h"

namespace tandem {

inline constexpr std::uint64_t default_samples = 64;

struct RenderArguments {
    std::string scene, output, backend = "cpu", device, kernel, precision, target_error, range, resume, aov, every,
                               memory;
    std::optional<std::uint64_t> samples;
    std::optional<double> seconds;
    RenderOptions options;
    unsigned threads = 0;
    bool validation = false, has_generator = false;
    double exposure = 1.0, keep_seconds = 20.0;
};

void add_render_arguments(CLI::App& command, RenderArguments& arguments);

// Throws InputError for an error that is no fraction.
[[nodiscard]] StoppingRule stopping_rule(const RenderArguments& arguments);
// "2x": a power of two from 2 to a block's samples, so that each image goes on from the one before.
[[nodiscard]] std::uint64_t factor_from(const std::string& every);
// Throws InputError for a range that is none, or ends beyond --samples.
[[nodiscard]] SampleRange range_of(const RenderArguments& arguments);

// Throws InputError for a file that cannot hold sums.
void check_part_ending(const std::string& option, const std::string& file);
// Throws InputError for what --aov and --every cannot be combined with, or write.
void check_extra_images(const RenderArguments& arguments);

// "box.png", "albedo": "box.albedo.png".
[[nodiscard]] std::string name_beside(const std::string& output, std::string_view word);
// "box.png", 16: "box-000016.png".
[[nodiscard]] std::string name_in_film(const std::string& output, std::uint64_t samples);
// The files beside -o, as far as they are known before: a film by time may get more.
[[nodiscard]] std::vector<Output> extra_outputs(const RenderArguments& arguments, const StoppingRule& rule);

}  // namespace tandem
