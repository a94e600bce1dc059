// Small compute shaders run on the device, for tests of single shader functions and of the validation layer.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tandem::testing {

// Runs a shader that reads binding 0 and writes binding 1 over `invocations`; returns what it wrote.
[[nodiscard]] std::vector<std::uint32_t> run_probe(std::span<const std::uint32_t> code,
    std::span<const std::uint32_t> input, std::size_t output_words, std::uint32_t invocations);

// Two copies in a row, the second reading what the first wrote.
enum class Ordering { barrier, none_in_one_submit, none_across_submits };
// What the validation layer says about them.
[[nodiscard]] std::vector<std::string> messages_about_copies(Ordering ordering);

}  // namespace tandem::testing
