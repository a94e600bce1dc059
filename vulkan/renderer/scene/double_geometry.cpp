#include "vulkan/renderer/scene/double_geometry.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "common/rounding.h"
#include "vulkan/renderer/scene/light_table.h"

namespace tandem {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;

gpu::DoubleVec4 row(const dvec3& v, double w) { return {v.x, v.y, v.z, w}; }

dvec3 point_by(const dmat4& m, const dvec3& p) { return dvec3(m * glm::dvec4(p, 1.0)); }

// MODEL.md section 6: front sides follow the object's, mirrored or not.
gpu::DoubleTriangle triangle(const dmat4& m, const std::array<dvec3, 3>& corners) {
    const dvec3 a = point_by(m, corners[0]), b = point_by(m, corners[1]), c = point_by(m, corners[2]);
    const dvec3 normal = (glm::determinant(dmat3(m)) < 0.0 ? -1.0 : 1.0) * glm::cross(b - a, c - a);
    return {row(a, normal.x), row(b, normal.y), row(c, normal.z)};
}

// The image of the unit sphere or of the cube [-extent, extent] (shaders/scene/scene_structs.glsl).
gpu::DoubleConvex convex(const dmat4& m, const dvec3& centre, const dvec3& half_size) {
    dvec3 scale = half_size, extent(1.0);
    for (int axis = 0; axis < 3; ++axis)
        if (half_size[axis] == 0.0) {  // flat: seen from the world the axis has the object's unit
            scale[axis] = 1.0;
            extent[axis] = 0.0;
        }
    const dvec3 c = point_by(m, centre);
    const dmat3 to_world = glm::transpose(dmat3(m)), to_object = glm::transpose(glm::inverse(dmat3(m)));  // rows
    return {row(to_object[0] / scale.x, c.x), row(to_object[1] / scale.y, c.y), row(to_object[2] / scale.z, c.z),
        row(to_world[0] * half_size, extent.x), row(to_world[1] * half_size, extent.y),
        row(to_world[2] * half_size, extent.z)};
}

gpu::Vec3Of<double> vec3(const dvec3& v) { return {v.x, v.y, v.z}; }

gpu::DoubleMedium medium(const Medium& described, const gpu::Medium& flattened) {
    gpu::DoubleMedium result;
    result.absorption = vec3(described.absorption);
    result.anisotropy = described.anisotropy;
    result.scattering = vec3(described.scattering);
    result.densities = flattened.densities;
    if (flattened.densities != gpu::no_index) {
        result.low = vec3(described.grid->low);
        result.high = vec3(described.grid->high);
    }
    result.cells_x = flattened.cells_x;
    result.cells_y = flattened.cells_y;
    result.cells_z = flattened.cells_z;
    return result;
}

gpu::DoubleMaterial material(const Material& described, const gpu::Material& flattened) {
    gpu::DoubleMaterial result;
    result.colour = vec3(described.colour);
    result.alpha = described.alpha;
    result.radiance = vec3(described.radiance);
    result.fuzz = described.fuzz;
    result.refractive_index = described.refractive_index;
    result.kind = flattened.kind;
    result.flags = flattened.flags;
    result.colour_texture = flattened.colour_texture;
    result.eta = vec3(described.eta);
    result.roughness = described.roughness;
    result.k = vec3(described.k);
    result.priority = flattened.priority;
    result.interior = flattened.interior;
    result.bodies = flattened.bodies;
    return result;
}

gpu::DoubleTexture texture(const Texture& described, const gpu::Texture& flattened) {
    gpu::DoubleTexture result;
    result.first = vec3(described.first);
    result.kind = flattened.kind;
    result.second = vec3(described.second);
    result.space = flattened.space;
    result.frequency = vec3(described.frequency);
    result.style = flattened.style;
    result.octaves = flattened.octaves;
    result.seed = flattened.seed;
    result.amount = described.amount;
    result.texels = flattened.texels;
    result.width = flattened.width;
    result.height = flattened.height;
    return result;
}

}  // namespace

DoubleGeometry place_in_double(
    const Scene& scene, const RenderSettings& settings, const SceneData& flattened, bool from_floats) {
    const PlacedPrimitives all = placed_primitives(scene);
    DoubleGeometry result;
    result.camera = flatten_camera<double>(scene.camera, settings);
    for (const Entity& entity : scene.entities) result.transforms.push_back(flatten_transform<double>(entity));
    if (!flattened.lights.empty())
        result.lights = make_light_table<double>(
            scene, flattened.placed, flattened.header.background_probability > 0.0F, settings.light_sampling)
                            .lights;
    for (std::size_t i = 0; i < flattened.tables.media.size(); ++i)
        result.media.push_back(medium(scene.media[i], flattened.tables.media[i]));
    for (const gpu::Placed& placed : flattened.placed) {
        const PlacedPrimitive place = all[placed.id];
        const Primitive& primitive = scene.primitives[place.primitive];
        dmat4 m = scene.entities[place.entity].object_to_world;
        std::array<dvec3, 3> p;
        for (std::size_t i = 0; i < 3; ++i) p[i] = scene.vertices[primitive.index[i]];
        double radius = primitive.radius;
        if (from_floats) {
            for (glm::length_t column = 0; column < 4; ++column)
                for (glm::length_t row = 0; row < 4; ++row) m[column][row] = rounded_to_single(m[column][row]);
            for (dvec3& corner : p) corner = rounded_to_single(corner);
            radius = rounded_to_single(radius);
        }
        if (primitive.kind == PrimitiveKind::triangle)
            result.triangles.push_back(triangle(m, p));
        else if (primitive.kind == PrimitiveKind::sphere)
            result.spheres.push_back(convex(m, p[0], dvec3(radius)));
        else
            result.cuboids.push_back(convex(m, 0.5 * (p[0] + p[1]), 0.5 * (p[1] - p[0])));
    }
    return result;
}

DoubleGeometry::Shading shading_in_double(
    const Scene& scene, const SceneData& flattened, const std::vector<gpu::DoubleLight>& lights) {
    DoubleGeometry::Shading result;
    result.header.background_down = vec3(scene.background.down);
    result.header.background_up = vec3(scene.background.up);
    result.header.extent = double{flattened.header.extent};
    if (flattened.header.background_probability > 0.0F)
        result.header.background_probability = lights.back().probability;
    result.header.environment = flattened.header.environment;
    result.header.medium = flattened.header.medium;
    result.header.texture_coordinates = flattened.header.texture_coordinates;
    result.header.shading_normals = flattened.header.shading_normals;
    for (std::size_t i = 0; i < flattened.materials.size(); ++i)
        result.materials.push_back(material(scene.materials[i], flattened.materials[i]));
    for (std::size_t i = 0; i < flattened.tables.textures.size(); ++i)
        result.textures.push_back(texture(scene.textures[i], flattened.tables.textures[i]));
    return result;
}

}  // namespace tandem
