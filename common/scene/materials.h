// The kinds of materials, a row each (MODEL.md section 7). A row has the name in the file format, the fields, the
// effects that a kind calls for and the bound on what it scatters. The backends implement the scattering itself.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

enum class Effect : std::uint32_t;  // common/render/effects.h

// A field of the file format. Its default is the member's own.
struct MaterialField {
    using Member = std::variant<double Material::*, glm::dvec3 Material::*, bool Material::*, EmittingSides Material::*,
        Fresnel Material::*, std::uint32_t Material::*, std::optional<std::int32_t> Material::*>;

    std::string_view key;
    Member member;
    double least = 0.0, greatest = 1.0;              // of numbers, and of each component of a vector
    double least_positive = 0.0;                     // the numbers between 0 and this are refused,
    std::string_view too_small = {};                 // for this reason
    std::span<const std::string_view> choices = {};  // of enumerations, by value
    std::uint32_t Material::*texture = nullptr;      // where a texture may take the place of the value
};

// What the loader does with fields of an object, one rule after the other, where the condition holds.
struct FieldRule {
    using Fields = std::vector<std::reference_wrapper<const MaterialField>>;
    enum class Action { need, take, refuse, need_any };
    enum class When { always, opaque, translucent, with, without };

    Action action = Action::take;
    Fields fields;
    std::string_view reason = {}, mend = {};  // of a refusal
    When when = When::always;
    const MaterialField* other = nullptr;  // with, without: this field
};

enum class Receives { never, where_rough, always };

struct MaterialRow {
    std::string_view name;  // in the file format
    std::vector<FieldRule> rules;
    std::optional<Effect> smooth = {}, rough = {};  // that it calls for, by its roughness
    Receives receives = Receives::never;            // next events are taken there
    // Upper bound of f cos θ at next events.
    glm::dvec3 (*greatest_scattering)(const Material&) = nullptr;
    // Bound of a scattering's weight, by the tangent of the angle between the arriving ray and the normal. For rough
    // materials it may exceed 1.
    glm::dvec3 (*greatest_weight)(const Material&, double tangent) = nullptr;
};

[[nodiscard]] const MaterialRow& row_of(MaterialKind kind);
[[nodiscard]] std::span<const MaterialRow> material_rows();  // in the order of MaterialKind

// The keys that a material of some kind takes, "kind" first.
[[nodiscard]] std::span<const std::string_view> material_keys();

[[nodiscard]] std::optional<Effect> called_effect(const Material& material);
[[nodiscard]] bool receives_light(const Material& material);

}  // namespace tandem
