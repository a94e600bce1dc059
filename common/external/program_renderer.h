// Any program as a Renderer: `tandem verify SCENE --candidate 'exec:COMMAND'`. README.md, Validate your renderer.
#pragma once

#include <filesystem>
#include <string>

#include "common/external/program.h"
#include "common/render/renderer.h"

namespace tandem {

// Begins the name of a renderer that is a command.
inline constexpr std::string_view command_prefix = "exec:";
[[nodiscard]] inline bool is_command(std::string_view name) { return name.starts_with(command_prefix); }

struct ProgramOptions {
    double limit_seconds = 120.0;  // of one request
    // It draws the numbers of MODEL.md section 3. A program that stays up says so itself.
    bool follows_numbers = false;
    // It renders spectra, whose noise may make colours negative. A program that stays up says so itself.
    bool may_be_negative = false;
};

// Estimates stand on variance channels (or second moments) of the program's images. Without any, each render() draws
// `images_a_call` images of independent seeds, and their scatter gives the variance (common/render/foreign_job.h).
class ProgramRenderer final : public Renderer {
public:
    static constexpr std::uint64_t images_a_call = 4;

    // `name` begins with `command_prefix`. Throws InputError, and ProgramFailure where it cannot be started.
    ProgramRenderer(const std::string& name, const ProgramOptions& options);

    // The file of the scene that jobs are prepared for from now on: a Scene does not know its own.
    void set_scene_file(const std::filesystem::path& file) { scene_file_ = std::filesystem::absolute(file); }

    [[nodiscard]] RendererInfo info() const override;
    // Throws UnsupportedError for settings that differ from those of the scene's file and that the command is not told.
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override;

private:
    void check(const Scene& scene, const RenderSettings& settings) const;

    ExternalProgram program_;
    bool follows_numbers_, may_be_negative_;
    std::filesystem::path scene_file_;
};

}  // namespace tandem
