// `tandem export`: scenes in the formats of other renderers. features.h says what each format can express.
#pragma once

#include <string>
#include <vector>

#include "common/scene/export/features.h"
#include "common/scene/scene.h"

namespace tandem::scene_export {

struct ExportedFile {
    std::string name;  // beside the export; the export itself is the first
    std::string bytes;
};

struct ExportOptions {
    std::string name;     // of the file to write; the ending says which of a target's forms
    bool strict = false;  // nothing that `tandem import` alone would read
};

// Throws InputError for what the target cannot say.
[[nodiscard]] std::vector<ExportedFile> export_scene(const Scene& scene, Target target, const ExportOptions& options);

[[nodiscard]] std::vector<ExportedFile> to_gltf(const Scene& scene, const ExportOptions& options);
[[nodiscard]] std::vector<ExportedFile> to_pbrt(const Scene& scene, const ExportOptions& options);
[[nodiscard]] std::vector<ExportedFile> to_mitsuba(const Scene& scene, const ExportOptions& options);
[[nodiscard]] std::vector<ExportedFile> to_blender(const Scene& scene, const ExportOptions& options);

// "glass.gltf" and ".sky.pfm" to "glass.sky.pfm".
[[nodiscard]] std::string beside(const std::string& file, const std::string& ending);

}  // namespace tandem::scene_export
