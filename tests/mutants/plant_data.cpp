#include "tests/mutants/plant_data.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <utility>

#include "tests/mutants/plant_film.h"

namespace tandem::test {

namespace {

using Bug = PlantedBug;
using glm::dvec3;

// Where entities share primitives, each gets its own; ids stay.
void unshare_primitives(Scene& scene) {
    std::vector<Primitive> primitives;
    for (Entity& entity : scene.entities) {
        const auto first = scene.primitives.begin() + entity.first_primitive;
        entity.first_primitive = static_cast<std::uint32_t>(primitives.size());
        primitives.insert(primitives.end(), first, first + entity.primitive_count);
    }
    scene.primitives = std::move(primitives);
}

// The diagonal of a box around the places that primitives stand on, and around spheres.
double size_of(const Scene& scene) {
    dvec3 low(std::numeric_limits<double>::max()), high = -low;
    for (const Entity& entity : scene.entities)
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& primitive = scene.primitives[entity.first_primitive + i];
            for (std::size_t corner = 0; corner < (primitive.kind == PrimitiveKind::triangle ? 3u : 2u); ++corner) {
                const bool sphere = primitive.kind == PrimitiveKind::sphere;
                dvec3 place = scene.vertices[primitive.index[sphere ? 0 : corner]];
                if (sphere) place += dvec3(corner == 0 ? primitive.radius : -primitive.radius);
                place = dvec3(entity.object_to_world * glm::dvec4(place, 1.0));
                low = glm::min(low, place);
                high = glm::max(high, place);
            }
        }
    return glm::length(glm::max(high - low, dvec3(0.0)));
}

// Triangles without area, spheres too small for any ray.
void lose_primitives(Scene& scene) {
    unshare_primitives(scene);
    for (std::size_t id = 9; id < scene.primitives.size(); id += 64) {
        Primitive& primitive = scene.primitives[id];
        if (primitive.kind == PrimitiveKind::triangle) primitive.index.fill(primitive.index[0]);
        if (primitive.kind == PrimitiveKind::sphere) primitive.radius *= 1e-6;
    }
}

void turn_mirrored_triangles(Scene& scene) {
    unshare_primitives(scene);
    for (const Entity& entity : scene.entities) {
        if (glm::determinant(glm::dmat3(entity.object_to_world)) >= 0.0) continue;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            Primitive& primitive = scene.primitives[entity.first_primitive + i];
            if (primitive.kind == PrimitiveKind::triangle) std::swap(primitive.index[1], primitive.index[2]);
        }
    }
}

// Vertex normals of triangles, a vertex a corner, as `change(entity, the three)` makes them.
template <class Change>
void change_normals(Scene& scene, Change change) {
    if (scene.normals.empty()) return;
    unshare_primitives(scene);
    for (const Entity& entity : scene.entities)
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            Primitive& primitive = scene.primitives[entity.first_primitive + i];
            if (primitive.kind != PrimitiveKind::triangle) continue;
            std::array<glm::dvec3, 3> normals;
            for (std::size_t corner = 0; corner < 3; ++corner) normals[corner] = scene.normals[primitive.index[corner]];
            change(entity, normals);
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const std::uint32_t from = primitive.index[corner];
                primitive.index[corner] = static_cast<std::uint32_t>(scene.vertices.size());
                scene.vertices.push_back(glm::dvec3(scene.vertices[from]));
                scene.normals.push_back(normals[corner]);
                if (!scene.texture_coordinates.empty())
                    scene.texture_coordinates.push_back(glm::dvec2(scene.texture_coordinates[from]));
            }
        }
}

void keep_normals_of_corners(Scene& scene) {
    change_normals(scene, [](const Entity&, std::array<glm::dvec3, 3>& normals) { normals.fill(normals[0]); });
}

// The inverse transpose of M takes MᵀM n where M takes n.
void transform_normals_as_points(Scene& scene) {
    change_normals(scene, [](const Entity& entity, std::array<glm::dvec3, 3>& normals) {
        const glm::dmat3 m(entity.object_to_world);
        for (glm::dvec3& normal : normals) normal = glm::transpose(m) * (m * normal);
    });
}

// Corners on a grid of so many bits over each entity's bounds.
void put_corners_on_grid(Scene& scene, double bits) {
    unshare_primitives(scene);
    const double steps = std::exp2(bits) - 1.0;
    for (const Entity& entity : scene.entities) {
        dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
        const auto each_corner = [&](auto change) {
            for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
                Primitive& primitive = scene.primitives[entity.first_primitive + i];
                if (primitive.kind != PrimitiveKind::triangle) continue;
                for (std::uint32_t& corner : primitive.index) change(corner);
            }
        };
        each_corner([&](std::uint32_t& corner) {
            low = glm::min(low, scene.vertices[corner]);
            high = glm::max(high, scene.vertices[corner]);
        });
        const dvec3 size = glm::max(high - low, dvec3(std::numeric_limits<double>::min()));
        each_corner([&](std::uint32_t& corner) {
            const std::uint32_t from = std::exchange(corner, static_cast<std::uint32_t>(scene.vertices.size()));
            const dvec3 place = scene.vertices[from];
            scene.vertices.push_back(low + size * (glm::round((place - low) / size * steps) / steps));
            if (!scene.texture_coordinates.empty())
                scene.texture_coordinates.push_back(glm::dvec2(scene.texture_coordinates[from]));
            if (!scene.normals.empty()) scene.normals.push_back(dvec3(scene.normals[from]));
        });
    }
}

void take_next_vertices(Scene& scene) {
    unshare_primitives(scene);
    for (const Entity& entity : scene.entities) {
        if (entity.primitive_count == 0) continue;
        Primitive& last = scene.primitives[entity.first_primitive + entity.primitive_count - 1];
        if (last.kind == PrimitiveKind::triangle)
            last.index[0] = static_cast<std::uint32_t>((last.index[0] + 1) % scene.vertices.size());
    }
}

// The image whose texel (x, y) is `texel_of(x, y)` of the old one, an index.
template <class TexelOf>
std::shared_ptr<const Pixels> rearranged(
    const Pixels& image, std::uint32_t width, std::uint32_t height, TexelOf texel_of) {
    Pixels result{width, height, {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const auto first = image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * std::size_t{texel_of(x, y)});
            result.rgb.insert(result.rgb.end(), first, first + 3);
        }
    return std::make_shared<const Pixels>(std::move(result));
}

std::shared_ptr<const Pixels> upside_down(const Pixels& image) {
    return rearranged(image, image.width, image.height,
        [&](std::uint32_t x, std::uint32_t y) { return (image.height - 1 - y) * image.width + x; });
}

std::shared_ptr<const Pixels> mirrored(const Pixels& image) {
    return rearranged(image, image.width, image.height,
        [&](std::uint32_t x, std::uint32_t y) { return y * image.width + image.width - 1 - x; });
}

// u for v: rows count from the top, v from the bottom.
std::shared_ptr<const Pixels> transposed(const Pixels& image) {
    return rearranged(image, image.height, image.width,
        [&](std::uint32_t x, std::uint32_t y) { return (image.height - 1 - x) * image.width + image.width - 1 - y; });
}

// Read with a row's length that is one texel too long.
std::shared_ptr<const Pixels> with_long_rows(const Pixels& image) {
    return rearranged(image, image.width, image.height,
        [&](std::uint32_t x, std::uint32_t y) { return (y * (image.width + 1) + x) % (image.width * image.height); });
}

template <class Change>
std::shared_ptr<const Pixels> changed(const Pixels& image, Change change) {
    Pixels result = image;
    for (std::size_t i = 0; i < result.rgb.size(); i += 3) change(&result.rgb[i]);
    return std::make_shared<const Pixels>(std::move(result));
}

// Cells looked up with x and y exchanged, and held to the grid.
std::shared_ptr<const DensityGrid> axes_swapped(const DensityGrid& grid) {
    DensityGrid result = grid;
    const auto [nx, ny, nz] = grid.cells;
    for (std::uint32_t z = 0; z < nz; ++z)
        for (std::uint32_t y = 0; y < ny; ++y)
            for (std::uint32_t x = 0; x < nx; ++x)
                result.density[(std::size_t{z} * ny + y) * nx + x] =
                    grid.density[(std::size_t{z} * ny + std::min(x, ny - 1)) * nx + std::min(y, nx - 1)];
    return std::make_shared<const DensityGrid>(std::move(result));
}

bool plant_in_material(const PlantedFault& fault, Material& material) {
    const double scale = 1.0 + fault.amount;
    switch (fault.bug) {
        case Bug::albedo_scaled:
            if (material.kind == MaterialKind::diffuse) material.colour *= scale;
            return true;
        case Bug::albedo_twice:
            if (material.kind == MaterialKind::diffuse) material.colour *= material.colour;
            return true;
        case Bug::emission_scaled:
            material.radiance *= scale;
            return true;
        case Bug::alpha_ignored:
            material.alpha = 1.0;
            return true;
        case Bug::layouts_apart:
            material.alpha = material.fuzz;
            return true;
        case Bug::fuzz_scaled:
            material.fuzz *= scale;
            return true;
        case Bug::index_scaled:
            material.refractive_index *= scale;
            return true;
        case Bug::relative_index_inverted:
            material.refractive_index = 1.0 / material.refractive_index;
            return true;
        case Bug::schlick_for_exact:
            material.fresnel = Fresnel::schlick;
            return true;
        case Bug::conductor_fresnel_dropped:
            // An imaginary index reflects all light, whatever its direction.
            material.eta = glm::dvec3(0.0);
            material.k = glm::dvec3(1.0);
            return true;
        case Bug::roughness_scaled:
            if (material.kind != MaterialKind::rough_diffuse) material.roughness *= scale;
            return true;
        case Bug::roughness_not_squared:
            if (material.kind != MaterialKind::rough_diffuse) material.roughness = std::sqrt(material.roughness);
            return true;
        case Bug::boundary_refracts:
            if (material.kind == MaterialKind::boundary) {
                material.kind = MaterialKind::specular;
                material.translucent = true;
                material.refractive_index = 1.1;
            }
            return true;
        case Bug::priority_ignored:
            if (material.priority) material.priority = 0;
            return true;
        case Bug::light_from_behind:
            material.sides = EmittingSides::both;
            return true;
        default:
            return false;
    }
}

bool plant_in_texture(const PlantedFault& fault, Texture& texture) {
    switch (fault.bug) {
        case Bug::coordinates_swapped:
            if (texture.image) texture.image = transposed(*texture.image);
            if (texture.space == TextureSpace::coordinates) std::swap(texture.frequency.x, texture.frequency.y);
            return true;
        case Bug::coordinates_flipped:
            if (texture.image) texture.image = upside_down(*texture.image);
            return true;
        case Bug::checker_shifted:
            if (texture.kind == TextureKind::checker) std::swap(texture.first, texture.second);
            return true;
        case Bug::octave_missing:
            --texture.octaves;
            return true;
        case Bug::noise_seed_ignored:
            texture.seed = 0;
            return true;
        case Bug::pitch_wrong:
            if (texture.image) texture.image = with_long_rows(*texture.image);
            return true;
        case Bug::texture_channels_swapped:
            if (texture.image) texture.image = changed(*texture.image, [](float* c) { std::swap(c[0], c[2]); });
            return true;
        case Bug::gamma_twice:
            if (texture.image)
                texture.image = changed(*texture.image,
                    [](float* c) { std::transform(c, c + 3, c, [](float v) { return std::pow(v, 2.2F); }); });
            return true;
        case Bug::texture_short:
            if (texture.image)
                texture.image = changed(*texture.image, [](float* c) {
                    std::transform(c, c + 3, c, [](float v) { return std::round(v * 255.0F) / 255.0F; });
                });
            return true;
        default:
            return false;
    }
}

bool plant_in_medium(const PlantedFault& fault, Medium& medium) {
    switch (fault.bug) {
        case Bug::absorption_scattering_swapped:
            std::swap(medium.absorption, medium.scattering);
            return true;
        case Bug::extinction_scaled:
            medium.absorption *= 1.0 + fault.amount;
            medium.scattering *= 1.0 + fault.amount;
            return true;
        case Bug::phase_sign:
            medium.anisotropy = -medium.anisotropy;
            return true;
        case Bug::anisotropy_shifted:
            if (medium.anisotropy != 0.0) medium.anisotropy += fault.amount;
            return true;
        case Bug::medium_grey:
            for (dvec3* const coefficient : {&medium.absorption, &medium.scattering})
                *coefficient = dvec3((coefficient->x + coefficient->y + coefficient->z) / 3.0);
            return true;
        case Bug::grid_axes_swapped:
            if (medium.grid) medium.grid = axes_swapped(*medium.grid);
            return true;
        default:
            return false;
    }
}

bool plant_in_camera(const PlantedFault& fault, Camera& camera) {
    const double scale = 1.0 + fault.amount;
    switch (fault.bug) {
        case Bug::field_scaled:
            camera.vertical_field_degrees =
                2.0 * glm::degrees(std::atan(scale * std::tan(0.5 * glm::radians(camera.vertical_field_degrees))));
            return true;
        case Bug::lens_radius_scaled:
            camera.lens_radius *= scale;
            return true;
        case Bug::focus_scaled:
            camera.focus_distance *= scale;
            return true;
        case Bug::camera_stale:
            camera.position += fault.amount * (camera.position - camera.target);
            return true;
        case Bug::camera_motion_ignored:
            camera.position_motion = camera.target_motion = glm::dvec3(0.0);
            return true;
        default:
            return false;
    }
}

bool plant_in_settings(const PlantedFault& fault, RenderSettings& settings) {
    switch (fault.bug) {
        case Bug::one_bounce_more:
            ++settings.bounces;
            return true;
        case Bug::one_bounce_fewer:
            if (settings.bounces > 0) --settings.bounces;
            return true;
        case Bug::roulette_late:
            if (settings.roulette_start != no_roulette) ++settings.roulette_start;
            return true;
        case Bug::seed_high_word_ignored:
            settings.seed &= 0xFFFFFFFFu;
            return true;
        case Bug::radiance_clamped:
            settings.clamp = 1.0;
            return true;
        case Bug::self_hit_not_excluded:
            settings.intersection.guard = SelfIntersectionGuard::fixed_epsilon;
            settings.intersection.epsilon = std::numeric_limits<double>::denorm_min();  // 0 in single precision
            return true;
        default:
            return false;
    }
}

// Plants in each element, or in a fresh one where there is none: whether the fault is known must not depend on the
// scene.
template <class Element, class Plant>
bool plant_in_each(const PlantedFault& fault, std::vector<Element>& elements, Plant plant) {
    for (Element& element : elements) plant(fault, element);
    Element fresh;
    return plant(fault, fresh);
}

bool plant_in_light(const PlantedFault& fault, PunctualLight& light) {
    if (fault.bug != Bug::spot_outer_scaled) return false;
    const double inner = std::cos(glm::radians(light.inner_degrees)),
                 outer = std::cos(glm::radians(light.outer_degrees));
    light.outer_degrees = glm::degrees(std::acos(outer + fault.amount * (inner - outer)));
    return true;
}

bool plant_in_scene(const PlantedFault& fault, Scene& scene) {
    Background& background = scene.background;
    switch (fault.bug) {
        case Bug::background_scaled:
            background.down *= 1.0 + fault.amount;
            background.up *= 1.0 + fault.amount;
            background.image_scale *= 1.0 + fault.amount;
            return true;
        case Bug::background_inverted:
            std::swap(background.down, background.up);
            return true;
        case Bug::sky_mirrored:
            if (background.image) background.image = mirrored(*background.image);
            return true;
        case Bug::sky_rotated:
            background.rotation_degrees -= 360.0 * fault.amount;
            return true;
        case Bug::time_fixed:
            for (Entity& entity : scene.entities) entity.motion = glm::dvec3(0.0);
            scene.camera.position_motion = scene.camera.target_motion = glm::dvec3(0.0);
            return true;
        case Bug::motion_halved:
            for (Entity& entity : scene.entities) entity.motion *= 0.5;
            scene.camera.position_motion *= 0.5;
            scene.camera.target_motion *= 0.5;
            return true;
        case Bug::last_light_lost:
            if (!scene.lights.empty()) scene.lights.pop_back();
            return true;
        case Bug::material_wrong:
            if (scene.entities.size() > 1)
                scene.entities.back().material = scene.entities[scene.entities.size() - 2].material;
            return true;
        case Bug::base_vertex_wrong:
            take_next_vertices(scene);
            return true;
        case Bug::vertices_short:
            put_corners_on_grid(scene, fault.amount);
            return true;
        case Bug::normals_short:
            change_normals(scene, [](const Entity&, std::array<dvec3, 3>& normals) {
                for (dvec3& normal : normals) normal = glm::round(127.0 * normal) / 127.0;
            });
            return true;
        case Bug::determinant_ignored:
            turn_mirrored_triangles(scene);
            return true;
        case Bug::shading_normal_of_corner:
            keep_normals_of_corners(scene);
            return true;
        case Bug::shading_normal_transform_wrong:
            transform_normals_as_points(scene);
            return true;
        case Bug::primitive_lost:
            lose_primitives(scene);
            return true;
        default:
            return plant_in_each(fault, scene.materials, plant_in_material) ||
                   plant_in_each(fault, scene.textures, plant_in_texture) ||
                   plant_in_each(fault, scene.media, plant_in_medium) ||
                   plant_in_each(fault, scene.lights, plant_in_light) || plant_in_camera(fault, scene.camera);
    }
}

class EditingRenderer : public Renderer {
public:
    EditingRenderer(std::unique_ptr<Renderer> renderer, const PlantedFault& fault)
        : renderer_(std::move(renderer)), fault_(fault) {}

    [[nodiscard]] RendererInfo info() const override { return renderer_->info(); }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        Scene faulty = scene;
        RenderSettings faulty_settings = settings;
        plant_data(fault_, faulty, faulty_settings);
        return renderer_->prepare(faulty, faulty_settings);
    }

private:
    std::unique_ptr<Renderer> renderer_;
    PlantedFault fault_;
};

}  // namespace

bool plant_data(const PlantedFault& fault, Scene& scene, RenderSettings& settings) {
    if (fault.bug == Bug::epsilon_too_large) {
        settings.intersection.guard = SelfIntersectionGuard::fixed_epsilon;
        settings.intersection.epsilon = fault.amount * size_of(scene);
        return true;
    }
    return plant_in_settings(fault, settings) || plant_in_scene(fault, scene);
}

std::unique_ptr<Renderer> renderer_with(const Backend& backend, const PlantedFault& fault, BackendOptions options) {
    Scene scene;
    RenderSettings settings;
    if (is_fault_of_film(fault.bug)) return with_fault_of_film(backend.create(options), fault.bug);
    if (plant_data(fault, scene, settings)) return std::make_unique<EditingRenderer>(backend.create(options), fault);
    options.planted_bug = fault;
    return backend.create(options);
}

}  // namespace tandem::test
