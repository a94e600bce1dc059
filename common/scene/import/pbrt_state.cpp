#include "common/scene/import/pbrt_state.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "common/text.h"

namespace tandem::scene_import {

bool PbrtState::transform_directive(const std::string& name) {
    glm::dmat4 step(1.0);
    const auto moves_more = [this] {
        refuse(
            "moves a body by more than a displacement to its EndTime", "write Translate under ActiveTransform EndTime");
    };
    if (name == "Identity" || name == "Transform") {
        if (state_.active != "All") moves_more();
        state_.transform = name == "Identity" ? world_ : world_ * matrix();
        state_.end_motion = glm::dvec3(0.0);
        return true;
    }
    if (name == "ActiveTransform") {
        state_.active = next("All, StartTime or EndTime").text;
        return true;
    }
    if (name == "Translate")
        step = glm::translate(step, point());
    else if (name == "Scale")
        step = glm::scale(step, point());
    else if (name == "Rotate") {
        const double degrees = number();
        step = glm::rotate(step, glm::radians(degrees), glm::normalize(point()));
    } else if (name == "ConcatTransform")
        step = matrix();
    else if (name == "LookAt") {
        const glm::dvec3 eye = point(), target = point(), up = point();
        const glm::dvec3 forward = glm::normalize(target - eye),
                         right = glm::normalize(glm::cross(glm::normalize(up), forward));
        const glm::dvec3 above = glm::cross(forward, right);
        step = glm::inverse(
            glm::dmat4(glm::dvec4(right, 0), glm::dvec4(above, 0), glm::dvec4(forward, 0), glm::dvec4(eye, 1)));
    } else
        return false;
    if (state_.active == "All") {
        state_.transform *= step;
        return true;
    }
    // Both ends of the shutter are the same but for a displacement, the only motion that Tandem's bodies have.
    if (state_.active != "EndTime" || glm::dmat3(step) != glm::dmat3(1.0)) moves_more();
    state_.end_motion += glm::dmat3(state_.transform) * glm::dvec3(step[3]);
    return true;
}

bool PbrtState::state_directive(const std::string& name) {
    if (name == "AttributeBegin" || name == "TransformBegin") {
        states_.emplace_back(state_, name);
    } else if (name == "AttributeEnd" || name == "TransformEnd") {
        if (states_.empty() || states_.back().second.substr(0, 4) != name.substr(0, 4))
            refuse(name + " without its begin", "remove it");
        const State outer = states_.back().first;
        if (name == "TransformEnd") {
            state_.transform = outer.transform;
            state_.end_motion = outer.end_motion;
            state_.active = outer.active;
        } else {
            state_ = outer;
        }
        states_.pop_back();
    } else if (name == "ReverseOrientation") {
        state_.reverse = !state_.reverse;
    } else if (name == "CoordinateSystem" || name == "CoordSysTransform") {
        const std::string system = text("a name");
        if (state_.end_motion != glm::dvec3(0.0)) refuse("names a space that moves", "do so before ActiveTransform");
        if (name == "CoordinateSystem")
            named_systems_[system] = state_.transform;
        else if (named_systems_.contains(system))
            state_.transform = named_systems_[system];
        else
            refuse("knows no coordinate system \"" + printable(system) + "\"", "name one first");
    } else {
        return false;
    }
    return true;
}

glm::dmat4 PbrtState::outer_system() const { return states_.empty() ? world_ : states_.back().first.transform; }

}  // namespace tandem::scene_import
