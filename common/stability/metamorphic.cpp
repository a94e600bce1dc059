#include "common/stability/metamorphic.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "common/stopwatch.h"

namespace tandem::stability {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

constexpr double length_factor = 0x1p10;

void scale_textures_and_media(Scene& scene, double k) {
    for (Texture& texture : scene.textures)
        if (texture.space == TextureSpace::object && texture.kind != TextureKind::image) texture.frequency /= k;
    for (Medium& medium : scene.media) {
        medium.absorption /= k;
        medium.scattering /= k;
        if (!medium.grid) continue;
        DensityGrid grid = *medium.grid;
        grid.low *= k;
        grid.high *= k;
        medium.grid = std::make_shared<const DensityGrid>(std::move(grid));
    }
}

// Vertices and radii themselves, so that no transform takes part.
Scene scaled(Scene scene) {
    const double k = length_factor;
    for (dvec3& v : scene.vertices) v *= k;
    for (Primitive& primitive : scene.primitives) primitive.radius *= k;
    for (Entity& entity : scene.entities) {
        entity.object_to_world[3] = glm::dvec4(k * dvec3(entity.object_to_world[3]), 1.0);
        entity.motion *= k;
    }
    Camera& camera = scene.camera;
    for (dvec3* v : {&camera.position, &camera.target, &camera.position_motion, &camera.target_motion}) *v *= k;
    camera.lens_radius *= k;
    camera.focus_distance *= k;
    scene.defaults.ray_min *= k;
    scene.defaults.ray_max *= k;
    for (PunctualLight& light : scene.lights) {
        light.position *= k;
        if (light.kind != PunctualKind::sun) light.intensity *= k * k;
    }
    scale_textures_and_media(scene, k);
    return scene;
}

bool has_grid(const Scene& scene) {
    return std::ranges::any_of(scene.media, [](const Medium& medium) { return medium.grid != nullptr; });
}

// The world by an orthogonal map.
Scene moved(Scene scene, const dmat3& q) {
    for (Entity& entity : scene.entities) {
        entity.object_to_world = dmat4(q) * entity.object_to_world;
        entity.motion = q * entity.motion;
    }
    Camera& camera = scene.camera;
    for (dvec3* v : {&camera.position, &camera.target, &camera.position_motion, &camera.target_motion, &camera.up})
        *v = q * *v;
    for (PunctualLight& light : scene.lights) {
        light.position = q * light.position;
        light.direction = q * light.direction;
    }
    return scene;
}

bool even_sky(const Scene& scene) { return !scene.background.image && scene.background.down == scene.background.up; }

std::uint32_t middle_of(Scene& scene, std::uint32_t a, std::uint32_t b) {
    scene.vertices.push_back(0.5 * (scene.vertices[a] + scene.vertices[b]));
    if (!scene.texture_coordinates.empty())
        scene.texture_coordinates.push_back(0.5 * (scene.texture_coordinates[a] + scene.texture_coordinates[b]));
    if (!scene.normals.empty()) scene.normals.push_back(0.5 * (scene.normals[a] + scene.normals[b]));
    return static_cast<std::uint32_t>(scene.vertices.size() - 1);
}

// Entities may share their primitives, so each gets its own.
Scene split(Scene scene) {
    const std::vector<Primitive> before = std::move(scene.primitives);
    scene.primitives.clear();
    for (Entity& entity : scene.entities) {
        const std::uint32_t first =
            std::exchange(entity.first_primitive, static_cast<std::uint32_t>(scene.primitives.size()));
        const std::uint32_t end = first + entity.primitive_count;
        for (std::uint32_t i = first; i < end; ++i) {
            const Primitive& primitive = before[i];
            if (primitive.kind != PrimitiveKind::triangle) {
                scene.primitives.push_back(primitive);
                continue;
            }
            const auto length = [&](std::size_t side) {
                return glm::distance(
                    scene.vertices[primitive.index[side]], scene.vertices[primitive.index[(side + 1) % 3]]);
            };
            const std::size_t side = length(0) >= length(1) && length(0) >= length(2) ? 0
                                     : length(1) >= length(2)                         ? 1
                                                                                      : 2;
            const std::uint32_t a = primitive.index[side], b = primitive.index[(side + 1) % 3],
                                c = primitive.index[(side + 2) % 3], m = middle_of(scene, a, b);
            scene.primitives.push_back({PrimitiveKind::triangle, {a, m, c}, 0.0});
            scene.primitives.push_back({PrimitiveKind::triangle, {m, b, c}, 0.0});
        }
        entity.primitive_count = static_cast<std::uint32_t>(scene.primitives.size()) - entity.first_primitive;
    }
    return scene;
}

bool only_triangles(const Scene& scene, const Entity& entity) {
    for (std::uint32_t i = 0; i < entity.primitive_count; ++i)
        if (scene.primitives[entity.first_primitive + i].kind != PrimitiveKind::triangle) return false;
    return entity.primitive_count > 0;
}

// A mirrored triangle keeps its front by turning its corners round; textures in object space stay behind.
bool bake(Scene& scene) {
    bool any = false;
    for (Entity& entity : scene.entities) {
        const Material& material = scene.materials[entity.material];
        if (entity.object_to_world == dmat4(1.0) || material.colour_texture != no_index ||
            !only_triangles(scene, entity))
            continue;
        any = true;
        const bool mirrored = glm::determinant(dmat3(entity.object_to_world)) < 0.0;
        const dmat3 normal_to_world = glm::transpose(glm::inverse(dmat3(entity.object_to_world)));
        const auto first = static_cast<std::uint32_t>(scene.primitives.size());
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            Primitive primitive = scene.primitives[entity.first_primitive + i];
            for (std::uint32_t& index : primitive.index) {
                scene.vertices.push_back(dvec3(entity.object_to_world * glm::dvec4(scene.vertices[index], 1.0)));
                if (!scene.texture_coordinates.empty())
                    scene.texture_coordinates.push_back(glm::dvec2(scene.texture_coordinates[index]));
                if (!scene.normals.empty()) scene.normals.push_back(normal_to_world * dvec3(scene.normals[index]));
                index = static_cast<std::uint32_t>(scene.vertices.size() - 1);
            }
            if (mirrored) std::swap(primitive.index[1], primitive.index[2]);
            scene.primitives.push_back(primitive);
        }
        entity.first_primitive = first;
        entity.object_to_world = dmat4(1.0);
    }
    return any;
}

Estimate render(Renderer& renderer, const Scene& scene, std::uint64_t samples, const std::stop_token& stop) {
    constexpr std::uint32_t longer_side = 24;
    return renderer.prepare(scene, with_longer_side(default_settings(scene), longer_side))
        ->render({0, samples}, {.stop = stop, .progress = {}})
        .estimate;
}

void compare_values(const Estimate& a, const Estimate& b, CaseResult& result) {
    const std::vector<double> one = mean_of(a), other = mean_of(b);
    for (std::size_t i = 0; i < one.size(); ++i)
        if (one[i] != other[i]) ++result.false_hits;
}

void compare_means(const Estimate& a, const Estimate& b, double ulp, double roundings, CaseResult& result) {
    const std::array<std::vector<double>, 2> mean{mean_of(a), mean_of(b)}, variance{variance_of(a), variance_of(b)};
    const auto pixels = static_cast<double>(a.pixel_count()), samples = static_cast<double>(a.count());
    for (std::size_t channel = 0; channel < channel_count; ++channel) {
        double difference = 0.0, sum = 0.0, squares = 0.0;
        for (std::size_t i = channel; i < mean[0].size(); i += channel_count) {
            difference += (mean[1][i] - mean[0][i]) / pixels;
            sum += mean[0][i] / pixels;
            squares += (variance[0][i] + variance[1][i]) / samples / (pixels * pixels);
        }
        if (!(sum > 0.0)) continue;
        const double error = std::abs(difference) / sum / ulp,
                     allowed = 6.0 * std::sqrt(squares) / sum / ulp + roundings;
        if (result.bound == 0.0 || error * result.bound > result.worst_ulp * allowed) {
            result.worst_ulp = error;
            result.bound = allowed;
        }
    }
}

}  // namespace

std::optional<Scene> changed(const Scene& scene, Change change) {
    // Columns are the images of x, y, z.
    const dmat3 quarter(dvec3(0, 0, -1), dvec3(0, 1, 0), dvec3(1, 0, 0)),
        mirror(dvec3(-1, 0, 0), dvec3(0, 1, 0), dvec3(0, 0, 1)), cycle(dvec3(0, 1, 0), dvec3(0, 0, 1), dvec3(1, 0, 0));
    switch (change) {
        case Change::scaled:
            return scaled(scene);
        case Change::turned:
        case Change::mirrored:
            if (scene.background.image || has_grid(scene)) return std::nullopt;
            return moved(scene, change == Change::turned ? quarter : mirror);
        case Change::permuted:
            if (!even_sky(scene) || has_grid(scene)) return std::nullopt;
            return moved(scene, cycle);
        case Change::split:
            return split(scene);
        case Change::baked: {
            Scene copy = scene;
            if (!bake(copy)) return std::nullopt;
            return copy;
        }
    }
    return std::nullopt;
}

void judge_change(const HardCase& hard_case, Renderer& renderer, Precision precision, double seconds,
    const std::stop_token& stop, CaseResult& result) {
    const auto change = static_cast<Change>(std::ranges::find(change_names, hard_case.change) - change_names.begin());
    const double ulp = precision == Precision::double_precision ? 0x1p-52 : 0x1p-23;
    const Stopwatch watch;
    std::size_t done = 0, apt = 0;
    result.bound = 0.0;
    for (const std::string& file : hard_case.scene_files) {
        if (stop.stop_requested() || (apt > 0 && watch.seconds() > seconds)) break;
        const Scene scene = load_scene(file);
        ++done;
        const std::optional<Scene> other = changed(scene, change);
        if (!other) continue;
        const Estimate a = render(renderer, scene, hard_case.samples, stop);
        const Estimate b = render(renderer, *other, hard_case.samples, stop);
        if (stop.stop_requested()) break;
        ++apt;
        result.rays += 2 * a.pixel_count() * a.count();
        if (b.invalid() > 0) result.false_hits += b.invalid();
        if (change == Change::scaled)
            compare_values(a, b, result);
        else
            compare_means(a, b, ulp, hard_case.bound, result);
    }
    result.nanoseconds_per_ray = result.rays > 0 ? 1e9 * watch.seconds() / static_cast<double>(result.rays) : 0.0;
    result.remark = std::to_string(apt) + " scenes changed, " + std::to_string(done) + " of " +
                    std::to_string(hard_case.scene_files.size()) + " looked at";
}

}  // namespace tandem::stability
