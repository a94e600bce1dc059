#include "common/scene/export/export.h"

#include <filesystem>

#include "common/error.h"

namespace tandem::scene_export {

std::string beside(const std::string& file, const std::string& ending) {
    return std::filesystem::path(file).stem().string() + ending;
}

std::vector<ExportedFile> export_scene(const Scene& scene, Target target, const ExportOptions& options) {
    check_target(scene, target, options.strict);
    switch (target) {
        case Target::gltf:
            return to_gltf(scene, options);
        case Target::pbrt:
            return to_pbrt(scene, options);
        case Target::mitsuba:
            return to_mitsuba(scene, options);
        case Target::blender:
            return to_blender(scene, options);
    }
    return {};
}

}  // namespace tandem::scene_export
