// The graphics state of pbrt's scene text. It holds the transform and the material of the next shape or light, and the
// blocks of attributes around it.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/import/pbrt_text.h"

namespace tandem::scene_import {

class PbrtState : protected PbrtText {
protected:
    using PbrtText::PbrtText;

    struct State {
        glm::dmat4 transform{1.0};
        glm::dvec3 end_motion{0.0};  // what the transform at the shutter's closing adds
        std::string material, inside, outside;
        std::optional<nlohmann::json> emission;
        bool reverse = false;
        std::string active = "All";  // the ends of the shutter that transforms act on
    };

    // Reads the rest of a directive that changes the transform, or blocks and names of states. False if `name` is none.
    bool transform_directive(const std::string& name);
    bool state_directive(const std::string& name);

    // The space around what stands here, in which an export lays out a shape.
    [[nodiscard]] glm::dmat4 outer_system() const;

    glm::dmat4 world_{1.0};  // from pbrt's world to the scene's: mirrored, or as it is
    State state_;
    std::vector<std::pair<State, std::string>> states_;  // of the blocks around, and the directives that began them
    std::map<std::string, glm::dmat4> named_systems_;
};

}  // namespace tandem::scene_import
