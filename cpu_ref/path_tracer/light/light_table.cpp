#include "cpu_ref/path_tracer/light/light_table.h"

#include <algorithm>
#include <cmath>

#include "cpu_ref/path_tracer/vector_rows.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

namespace {

double brightness(const glm::dvec3& colour) { return colour.x + colour.y + colour.z; }

double cosine_of_degrees(double degrees) { return std::cos(glm::radians(degrees)); }

LightDraft punctual_draft(const PunctualLight& light) {
    LightDraft draft;
    draft.punctual = light;
    const double power = brightness(light.intensity);
    draft.low = draft.high = light.position;
    if (light.kind == PunctualKind::spot) draft.axis = light.direction;
    draft.strength = power;
    switch (light.kind) {
        case PunctualKind::point:
            draft.kind = LightKind::point;
            draft.weight = 4.0 * power;
            break;
        case PunctualKind::spot:
            draft.kind = LightKind::spot;
            draft.weight = 2.0 * (1.0 - cosine_of_degrees(light.outer_degrees)) * power;
            break;
        case PunctualKind::sun:
            draft.kind = LightKind::sun;
            break;
    }
    return draft;
}

std::vector<double> equal_probabilities(std::size_t count, std::vector<double>& cumulative) {
    for (std::size_t i = 1; i <= count; ++i) cumulative.push_back(static_cast<double>(i) / static_cast<double>(count));
    return std::vector<double>(count, 1.0 / static_cast<double>(count));
}

// Near lights share in proportion to their weights, far ones equally; both groups have one half where there are both.
std::vector<double> probabilities(const std::vector<LightDraft>& lights, std::vector<double>& cumulative) {
    double total = 0.0, running = 0.0, far_count = 0.0;
    for (const LightDraft& light : lights) {
        total += light.weight;
        if (is_far(light)) far_count += 1.0;
    }
    const double far_share = far_count == 0.0 ? 0.0 : total > 0.0 ? 0.5 : 1.0, near_share = 1.0 - far_share;
    std::vector<double> chances;
    double far_before = 0.0;
    for (const LightDraft& light : lights) {
        if (is_far(light)) {
            chances.push_back(far_share / far_count);
            far_before += 1.0;
        } else {
            running += light.weight;
            chances.push_back(near_share * (light.weight / total));
        }
        const double near_part = total > 0.0 ? near_share * (running / total) : 0.0;
        cumulative.push_back(far_before > 0.0 ? near_part + far_share * (far_before / far_count) : near_part);
    }
    return chances;
}

}  // namespace

std::vector<LightDraft> distant_lights(const Scene& scene, const ImageEnvironment* environment) {
    std::vector<LightDraft> lights;
    for (const bool suns : {false, true})
        for (const PunctualLight& light : scene.lights)
            if ((light.kind == PunctualKind::sun) == suns && brightness(light.intensity) > 0.0)
                lights.push_back(punctual_draft(light));
    const Background& background = scene.background;
    const bool black = environment != nullptr ? environment->black()
                                              : !(brightness(background.down) + brightness(background.up) > 0.0);
    if (background.sampled && !black) {
        LightDraft draft;
        draft.kind = LightKind::background;
        lights.push_back(draft);
    }
    return lights;
}

template <class Real>
std::vector<double> fill_light_table(
    LightTable<Real>& table, const std::vector<LightDraft>& lights, LightSampling sampling) {
    using Unsigned = UnsignedOf<Real>;
    std::vector<double> running;
    std::vector<double> chances = sampling == LightSampling::uniform ? equal_probabilities(lights.size(), running)
                                                                     : probabilities(lights, running);
    if (table.tree.count > 0) {
        const double share = table.tree.count < lights.size() ? 0.5 : 1.0;
        std::fill_n(chances.begin(), table.tree.count, share);
        table.near_share = static_cast<Real>(share);
    }
    std::vector<Unsigned> primitive, material, first_patch, sphere, kind;
    std::vector<Real> cumulative, chance, outer, range;
    VectorRows<Real> intensity, position, direction, motion;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const LightDraft& light = lights[i];
        primitive.push_back(light.primitive);
        material.push_back(light.material);
        first_patch.push_back(light.first_patch);
        sphere.push_back(light.sphere);
        kind.push_back(static_cast<Unsigned>(light.kind));
        cumulative.push_back(static_cast<Real>(running[i]));
        chance.push_back(static_cast<Real>(chances[i]));
        intensity.push_back(light.punctual.intensity);
        position.push_back(light.punctual.position);
        direction.push_back(light.punctual.direction);
        motion.push_back(light.motion);
        const double inner_cosine = cosine_of_degrees(light.punctual.inner_degrees);
        const double outer_cosine = cosine_of_degrees(light.punctual.outer_degrees);
        outer.push_back(static_cast<Real>(outer_cosine));
        range.push_back(static_cast<Real>(1.0 / (inner_cosine - outer_cosine)));
        table.any_sphere = table.any_sphere || light.kind == LightKind::sphere;
        table.any_cuboid = table.any_cuboid || light.kind == LightKind::cuboid;
        table.any_ellipsoid = table.any_ellipsoid || light.kind == LightKind::ellipsoid;
        table.any_moving = table.any_moving || light.motion != glm::dvec3(0.0);
        (light.kind <= LightKind::ellipsoid ? table.any_surface : table.any_distant) = true;
        if (light.kind == LightKind::background) table.background_chance = static_cast<Real>(chances[i]);
    }
    table.count = lights.size();
    table.cumulative_list = cumulative;
    table.primitive.assign(primitive);
    table.material.assign(material);
    table.first_patch.assign(first_patch);
    table.sphere.assign(sphere);
    table.kind.assign(kind);
    table.cumulative.assign(cumulative);
    table.chance.assign(chance);
    table.outer_cosine.assign(outer);
    table.inverse_cosine_range.assign(range);
    intensity.assign_to(table.intensity);
    position.assign_to(table.position);
    direction.assign_to(table.direction);
    motion.assign_to(table.motion);
    return chances;
}

template std::vector<double> fill_light_table<float>(LightTable<float>&, const std::vector<LightDraft>&, LightSampling);
template std::vector<double> fill_light_table<double>(
    LightTable<double>&, const std::vector<LightDraft>&, LightSampling);

}  // namespace tandem::cpu
