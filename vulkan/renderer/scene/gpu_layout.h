// The structs that host and shaders exchange, in the shaders' layout (shaders/scene/scene_set.glsl, camera.glsl,
// settings.glsl). The build reads offsets and strides back out of the SPIR-V and checks them against these structs
// (gpu_layout.cpp).
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

namespace tandem::gpu {

// What says where things are and what they are made of is there in float and in double (shaders/arithmetic/real.glsl).
template <class Real>
struct alignas(4 * sizeof(Real)) Vec4Of {
    Real x = 0, y = 0, z = 0, w = 0;
};
template <class Real>
struct Vec3Of {
    Real x = 0, y = 0, z = 0;
};
using Vec4 = Vec4Of<float>;
using Vec3 = Vec3Of<float>;
using DoubleVec4 = Vec4Of<double>;

template <class Real>
[[nodiscard]] Vec3Of<Real> rounded(const glm::dvec3& v) {
    return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)};
}

struct PrimitiveSource {
    std::uint32_t kind = 0, index0 = 0, index1 = 0, index2 = 0, entity = 0;
    float radius = 0;
};

template <class Real>
struct EntityTransformOf {
    Vec4Of<Real> to_world0, to_world1, to_world2;
    alignas(4 * sizeof(Real)) Vec3Of<Real> to_object0;
    Real determinant_sign = 1;
    alignas(4 * sizeof(Real)) Vec3Of<Real> to_object1;
    alignas(4 * sizeof(Real)) Vec3Of<Real> to_object2;
    alignas(4 * sizeof(Real)) Vec3Of<Real> motion;
};
using EntityTransform = EntityTransformOf<float>;
using DoubleEntityTransform = EntityTransformOf<double>;

struct Placed {
    std::uint32_t id = 0, material = 0, entity = 0, light = 0;
};
inline constexpr std::uint32_t no_light = 0xffffffffu;

template <class Real>
struct TriangleOf {
    Vec4Of<Real> corner0, corner1, corner2;
};
using Triangle = TriangleOf<float>;
using DoubleTriangle = TriangleOf<double>;

template <class Real>
struct ConvexOf {
    Vec4Of<Real> to_unit0, to_unit1, to_unit2, to_world0, to_world1, to_world2;
};
using Convex = ConvexOf<float>;
using DoubleConvex = ConvexOf<double>;

struct BvhNode {
    alignas(16) Vec3 centre0;
    std::uint32_t child0 = 0;
    alignas(16) Vec3 half0;
    std::uint32_t child1 = 0;
    alignas(16) Vec3 centre1;
    std::uint32_t unused0 = 0;
    alignas(16) Vec3 half1;
    std::uint32_t unused1 = 0;
};

inline constexpr std::uint32_t no_index = 0xffffffffu;

template <class Real>
struct alignas(4 * sizeof(Real)) MaterialOf {
    alignas(4 * sizeof(Real)) Vec3Of<Real> colour;
    Real alpha = 1;
    alignas(4 * sizeof(Real)) Vec3Of<Real> radiance;
    Real fuzz = 0;
    Real refractive_index = 1;
    std::uint32_t kind = 0, flags = 0, colour_texture = no_index;
    alignas(4 * sizeof(Real)) Vec3Of<Real> eta;
    Real roughness = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> k;
    std::int32_t priority = 0;
    std::uint32_t interior = no_index, bodies = 0;
};
using Material = MaterialOf<float>;
using DoubleMaterial = MaterialOf<double>;
inline constexpr std::uint32_t flag_translucent = 1, flag_schlick = 2, flag_front_only = 4, flag_tracked = 8;

template <class Real>
struct alignas(4 * sizeof(Real)) TextureOf {
    alignas(4 * sizeof(Real)) Vec3Of<Real> first;
    std::uint32_t kind = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> second;
    std::uint32_t space = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> frequency;
    std::uint32_t style = 0, octaves = 0, seed = 0;
    Real amount = 0;
    std::uint32_t texels = 0, width = 0, height = 0;
};
using Texture = TextureOf<float>;
using DoubleTexture = TextureOf<double>;

template <class Real>
struct alignas(4 * sizeof(Real)) MediumOf {
    alignas(4 * sizeof(Real)) Vec3Of<Real> absorption;
    Real anisotropy = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> scattering;
    std::uint32_t densities = no_index;
    alignas(4 * sizeof(Real)) Vec3Of<Real> low;
    std::uint32_t cells_x = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> high;
    std::uint32_t cells_y = 0, cells_z = 0;
};
using Medium = MediumOf<float>;
using DoubleMedium = MediumOf<double>;

template <class Real>
struct alignas(4 * sizeof(Real)) LightOf {
    std::uint32_t slot = 0, kind = 0;
    Real cumulative = 1, probability = 1;
    alignas(4 * sizeof(Real)) Vec3Of<Real> centre;
    Real radius = 0, area = 0;
    Real face0 = 0, face1 = 0, face2 = 0, face3 = 0, face4 = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> axis;
    Real outer = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> intensity;
    Real inner = 0;
};
using Light = LightOf<float>;
using DoubleLight = LightOf<double>;
// After the kinds of primitives.
inline constexpr std::uint32_t kind_point = 3, kind_spot = 4, kind_sun = 5, kind_background = 6, kind_ellipsoid = 7;

struct alignas(16) Environment {
    std::array<std::uint32_t, 2> size{};
    std::uint32_t texels = 0, density = 0, rows = 0, columns = 0;
    std::array<float, 2> rotation{1, 0};
};

template <class Real>
struct SceneHeaderOf {
    alignas(4 * sizeof(Real)) Vec3Of<Real> background_down;
    Real extent = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> background_up;
    Real background_probability = 0;
    Environment environment;
    std::uint32_t medium = no_index, texture_coordinates = 0, shading_normals = no_index;
};
using SceneHeader = SceneHeaderOf<float>;
using DoubleSceneHeader = SceneHeaderOf<double>;

template <class Real>
struct CameraOf {
    alignas(4 * sizeof(Real)) Vec3Of<Real> position;
    Real lens_radius = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> forward;
    Real focus_distance = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> film_right;
    Real film_width = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> film_up;
    Real film_height = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> right;
    std::uint32_t moves = 0;
    alignas(4 * sizeof(Real)) Vec3Of<Real> up;
    alignas(4 * sizeof(Real)) Vec3Of<Real> view;
    alignas(4 * sizeof(Real)) Vec3Of<Real> scene_up;
    alignas(4 * sizeof(Real)) Vec3Of<Real> position_motion;
    alignas(4 * sizeof(Real)) Vec3Of<Real> view_motion;
};
using Camera = CameraOf<float>;
using DoubleCamera = CameraOf<double>;

struct Settings {
    std::array<std::uint32_t, 2> seed{}, sample_index{};
    std::uint32_t width = 0, height = 0, first_pixel = 0, pixel_count = 0;
    std::uint32_t segment = 0, bounces = 0, roulette_start = 0, light_count = 0;
    std::uint32_t triangle_count = 0, sphere_count = 0, cuboid_count = 0;
    float ray_min = 0, ray_max = 0;
    std::uint32_t direct_only = 0, sample_count = 0, first_invocation = 0, invocations = 0;
    std::uint32_t keeps_sums = 0, changed_block = no_index, changed_number = 0, listed = 0;
};
static_assert(sizeof(Settings) <= 128, "every Vulkan device offers 128 bytes of push constants, few offer more");

}  // namespace tandem::gpu
