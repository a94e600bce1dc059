#include "common/scene/materials.h"

#include <array>
#include <glm/common.hpp>
#include <numbers>

#include "common/render/effects.h"

namespace tandem {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double greatest_radiance = 1e18;  // common/scene/loader/parts.h says why
constexpr std::int32_t greatest_priority = 1'000'000;
constexpr std::string_view sides_names[] = {"both", "front"}, fresnel_names[] = {"exact", "schlick"};

constexpr MaterialField colour{.key = "colour", .member = &Material::colour, .texture = &Material::colour_texture},
    radiance{.key = "radiance", .member = &Material::radiance, .greatest = greatest_radiance},
    sides{.key = "sides", .member = &Material::sides, .choices = sides_names},
    translucent{.key = "translucent", .member = &Material::translucent},
    alpha{.key = "alpha", .member = &Material::alpha}, fuzz{.key = "fuzz", .member = &Material::fuzz},
    // Beyond these no medium lies, and single precision loses the squared ratio.
    refractive_index{.key = "refractive_index", .member = &Material::refractive_index, .least = 1e-3, .greatest = 1e3},
    fresnel{.key = "fresnel", .member = &Material::fresnel, .choices = fresnel_names},
    // Below the least the lobe of GGX overflows single precision.
    roughness{.key = "roughness",
        .member = &Material::roughness,
        .least_positive = 0.03,
        .too_small = "is too sharp a lobe for single precision"},
    slope_deviation{.key = roughness.key, .member = &Material::roughness},
    // Between these lie all metals; single precision keeps the fourth powers of section 7.6.
    eta{.key = "eta", .member = &Material::eta, .least = 1e-3, .greatest = 1e3},
    k{.key = "k", .member = &Material::k, .greatest = 1e3}, interior{.key = "interior", .member = &Material::interior},
    priority{
        .key = "priority", .member = &Material::priority, .least = -greatest_priority, .greatest = greatest_priority};

constexpr std::array<std::string_view, 14> keys{"kind", colour.key, radiance.key, sides.key, translucent.key, alpha.key,
    fuzz.key, refractive_index.key, fresnel.key, roughness.key, eta.key, k.key, interior.key, priority.key};

using Action = FieldRule::Action;
using When = FieldRule::When;
using Fields = FieldRule::Fields;

FieldRule need(Fields fields, When when = When::always) { return {Action::need, std::move(fields), "", "", when}; }
FieldRule take(Fields fields) { return {Action::take, std::move(fields)}; }
FieldRule refuse(
    Fields fields, std::string_view reason, When when = When::always, const MaterialField* other = nullptr) {
    return {Action::refuse, std::move(fields), reason, "remove it", when, other};
}

const Fields& of_translucent() {
    static const Fields fields{alpha, refractive_index, fresnel, interior, priority};
    return fields;
}
FieldRule no_complex_index() { return refuse({eta, k}, "only a conductor has a complex index"); }
FieldRule opaque_has_none() {
    return refuse(of_translucent(), "an opaque material has none, and would ignore it", When::opaque);
}
FieldRule sides_of_light_alone() {
    return refuse(
        {sides}, "without \"radiance\" there is nothing to emit to one side or both", When::without, &radiance);
}

glm::dvec3 greatest_colour(const Material& material) {
    return material.colour_texture == no_index ? material.colour : glm::dvec3(1.0);
}

MaterialRow diffuse_row() {
    return {.name = "diffuse",
        .rules = {no_complex_index(), refuse({translucent}, "a diffuse material is always opaque"),
            refuse({fuzz, roughness}, "a diffuse material has no lobe to blur"),
            refuse(of_translucent(), "a diffuse material is opaque, and would ignore it"), need({colour}),
            sides_of_light_alone(), take({radiance, sides})},
        .smooth = Effect::diffuse,
        .rough = Effect::diffuse,
        .receives = Receives::always,
        .greatest_scattering = [](const Material& material) { return greatest_colour(material) / pi; }};
}

MaterialRow specular_row() {
    return {.name = "specular",
        .rules = {no_complex_index(),
            refuse({radiance, sides}, "a specular material does not emit; an emissive translucent one does both"),
            need({colour}), take({translucent}), opaque_has_none(), take(of_translucent()),
            refuse({roughness}, "an opaque specular material blurs by \"fuzz\", and would ignore it", When::opaque),
            refuse({roughness}, "fuzz and roughness blur the same lobe", When::with, &fuzz), take({fuzz, roughness})},
        .smooth = Effect::specular,
        .rough = Effect::specular};
}

MaterialRow emissive_row() {
    return {.name = "emissive",
        .rules = {no_complex_index(), need({radiance}), take({sides, translucent}), opaque_has_none(),
            take(of_translucent()),
            refuse({roughness}, "an emissive material blurs by \"fuzz\" if at all, and would ignore it"),
            refuse({colour, fuzz}, "an opaque emissive material reflects nothing, and would ignore it", When::opaque),
            need({colour}, When::translucent), take({fuzz})}};
}

MaterialRow conductor_row() {
    return {.name = "conductor",
        .rules = {refuse({radiance, sides}, "a conductor does not emit"),
            refuse(of_translucent(), "a conductor is opaque, and would ignore it"),
            refuse({translucent}, "a conductor is always opaque"),
            refuse({colour}, "a conductor has its colour from \"eta\" and \"k\""),
            refuse({fuzz}, "a conductor blurs by \"roughness\""), need({eta, k}), take({roughness})},
        .smooth = Effect::smooth_conductor,
        .rough = Effect::rough_conductor,
        .receives = Receives::where_rough,
        // From D <= 1/(pi alpha^2) and G_2 <= G_1 <= 2 i_z/alpha.
        .greatest_scattering = [](const Material& material) {
            const double a = material.roughness * material.roughness;
            return glm::dvec3(1.0 / (2.0 * pi * a * a * a));
        }};
}

MaterialRow boundary_row() {
    return {.name = "boundary",
        .rules = {no_complex_index(),
            refuse({colour, radiance, sides, translucent, alpha, fuzz, refractive_index, fresnel, roughness},
                "a boundary changes nothing but the medium"),
            {Action::need_any, {interior, priority}, "a boundary without interior or priority does nothing",
                "name the medium inside"},
            take({interior, priority})},
        .smooth = Effect::boundary,
        .rough = Effect::boundary};
}

MaterialRow rough_diffuse_row() {
    return {.name = "rough-diffuse",
        .rules = {no_complex_index(), refuse({translucent}, "a rough-diffuse material is always opaque"),
            refuse({fuzz}, "a rough-diffuse material blurs by \"roughness\""),
            refuse(of_translucent(), "a rough-diffuse material is opaque, and would ignore it"), need({colour}),
            sides_of_light_alone(), take({radiance, sides, slope_deviation})},
        .smooth = Effect::rough_diffuse,
        .rough = Effect::rough_diffuse,
        .receives = Receives::always,
        // f cos <= C/pi (a cos theta_o + b sin theta_i sin theta_o), and sqrt(a^2 + b^2) <= 1 (MODEL.md section 7.9).
        .greatest_scattering = [](const Material& material) { return greatest_colour(material) / pi; },
        // C (a + b sin alpha tan beta), and beta is the smaller angle.
        .greatest_weight =
            [](const Material& material, double tangent) {
                const double square = material.roughness * material.roughness;
                const double a = 1.0 - square / (2.0 * (square + 0.33)), b = 0.45 * square / (square + 0.09);
                return greatest_colour(material) * (a + b * tangent);
            }};
}

}  // namespace

std::span<const MaterialRow> material_rows() {
    static const std::array rows{
        diffuse_row(), specular_row(), emissive_row(), conductor_row(), boundary_row(), rough_diffuse_row()};
    return rows;
}

const MaterialRow& row_of(MaterialKind kind) { return material_rows()[static_cast<std::size_t>(kind)]; }

std::span<const std::string_view> material_keys() { return keys; }

std::optional<Effect> called_effect(const Material& material) {
    const MaterialRow& row = row_of(material.kind);
    return material.roughness > 0.0 ? row.rough : row.smooth;
}

bool receives_light(const Material& material) {
    const Receives receives = row_of(material.kind).receives;
    return receives == Receives::always || (receives == Receives::where_rough && material.roughness > 0.0);
}

}  // namespace tandem
