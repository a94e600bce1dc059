// Where submissions run: a process of its own, with limits of memory, time and files, which compiles and runs the
// shader.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/error.h"

namespace tandem {

// What the backend offers: SPIR-V on a list of numbers (vulkan/framework/list_shader.h).
using RunListShader = std::vector<float> (*)(
    std::span<const std::uint32_t> code, std::span<const float> arguments, std::uint32_t count, std::uint32_t results);

// The submission does not compile, does not end or crashes. what() begins with a verb: "does not compile".
class SubmissionFailure : public Error {
public:
    SubmissionFailure(const std::string& what, std::vector<std::string> log) : Error(what), log_(std::move(log)) {}
    [[nodiscard]] const std::vector<std::string>& log() const { return log_; }  // of the compiler

private:
    std::vector<std::string> log_;
};

// The shader's answers: `results` numbers for each of `count` lists of arguments. Throws SubmissionFailure; DeviceError
// where there is no device; Error where the machine is to blame.
[[nodiscard]] std::vector<float> run_apart(
    const std::string& shader, std::span<const float> arguments, std::uint32_t count, std::uint32_t results);

// The process's own part: `tandem exercise inside FOLDER`. Returns its exit status.
[[nodiscard]] int run_inside(const std::filesystem::path& folder, RunListShader run);

}  // namespace tandem
