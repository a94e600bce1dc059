// What host and shaders exchange, as the shaders lay it out (shaders/scene_set.glsl, camera.glsl, settings.glsl). The
// build reads offsets and strides back out of the SPIR-V and checks them against these structs (gpu_layout.cpp).
#pragma once

#include <array>
#include <cstdint>

namespace tandem::gpu {

struct alignas(16) Vec4 {
    float x = 0, y = 0, z = 0, w = 0;
};
struct Vec3 {
    float x = 0, y = 0, z = 0;
};

struct PrimitiveSource {
    std::uint32_t kind = 0, index0 = 0, index1 = 0, index2 = 0, entity = 0;
    float radius = 0;
};

struct EntityTransform {
    Vec4 to_world0, to_world1, to_world2;
    alignas(16) Vec3 to_object0;
    float determinant_sign = 1;
    alignas(16) Vec3 to_object1;
    alignas(16) Vec3 to_object2;
    alignas(16) Vec3 motion;
};

struct Placed {
    std::uint32_t id = 0, material = 0, entity = 0, light = 0;
};
inline constexpr std::uint32_t no_light = 0xffffffffu;

struct Triangle {
    Vec4 corner0, corner1, corner2;
};

struct Convex {
    Vec4 to_unit0, to_unit1, to_unit2, to_world0, to_world1, to_world2;
};

// The world primitives in double (shaders/ray_batch_double.comp).
struct alignas(32) DoubleVec4 {
    double x = 0, y = 0, z = 0, w = 0;
};
struct DoubleTriangle {
    DoubleVec4 corner0, corner1, corner2;
};
struct DoubleConvex {
    DoubleVec4 to_unit0, to_unit1, to_unit2, to_world0, to_world1, to_world2;
};

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

struct alignas(16) Material {
    Vec3 colour;
    float alpha = 1;
    Vec3 radiance;
    float fuzz = 0;
    float refractive_index = 1;
    std::uint32_t kind = 0, flags = 0, colour_texture = no_index;
    Vec3 eta;
    float roughness = 0;
    Vec3 k;
    std::int32_t priority = 0;
    std::uint32_t interior = no_index;
};
inline constexpr std::uint32_t flag_translucent = 1, flag_schlick = 2, flag_front_only = 4, flag_tracked = 8;

struct alignas(16) Texture {
    Vec3 first;
    std::uint32_t kind = 0;
    Vec3 second;
    std::uint32_t space = 0;
    Vec3 frequency;
    std::uint32_t style = 0, octaves = 0, seed = 0;
    float amount = 0;
    std::uint32_t texels = 0, width = 0, height = 0;
};

struct alignas(16) Medium {
    Vec3 absorption;
    float anisotropy = 0;
    Vec3 scattering;
    std::uint32_t densities = no_index;
    Vec3 low;
    std::uint32_t cells_x = 0;
    Vec3 high;
    std::uint32_t cells_y = 0, cells_z = 0;
};

struct alignas(16) Light {
    std::uint32_t slot = 0, kind = 0;
    float cumulative = 1, probability = 1;
    Vec3 centre;
    float radius = 0, area = 0;
    float face0 = 0, face1 = 0, face2 = 0, face3 = 0, face4 = 0;
    alignas(16) Vec3 axis;
    float outer = 0;
    Vec3 intensity;
    float inner = 0;
};
// After the kinds of primitives.
inline constexpr std::uint32_t kind_point = 3, kind_spot = 4, kind_sun = 5, kind_background = 6, kind_ellipsoid = 7;

struct alignas(16) Environment {
    std::array<std::uint32_t, 2> size{};
    std::uint32_t texels = 0, density = 0, rows = 0, columns = 0;
    std::array<float, 2> rotation{1, 0};
};

struct SceneHeader {
    alignas(16) Vec3 background_down;
    float extent = 0;
    alignas(16) Vec3 background_up;
    float background_probability = 0;
    Environment environment;
    std::uint32_t medium = no_index, texture_coordinates = 0;
};

struct Camera {
    alignas(16) Vec3 position;
    float lens_radius = 0;
    alignas(16) Vec3 forward;
    float focus_distance = 0;
    alignas(16) Vec3 film_right;
    float film_width = 0;
    alignas(16) Vec3 film_up;
    float film_height = 0;
    alignas(16) Vec3 right;
    std::uint32_t moves = 0;
    alignas(16) Vec3 up;
    alignas(16) Vec3 view;
    alignas(16) Vec3 scene_up;
    alignas(16) Vec3 position_motion;
    alignas(16) Vec3 view_motion;
};

struct Settings {
    std::array<std::uint32_t, 2> seed{}, sample_index{};
    std::uint32_t width = 0, height = 0, first_pixel = 0, pixel_count = 0;
    std::uint32_t segment = 0, bounces = 0, roulette_start = 0, light_count = 0;
    std::uint32_t triangle_count = 0, sphere_count = 0, cuboid_count = 0;
    float ray_min = 0, ray_max = 0;
    std::uint32_t direct_only = 0, sample_count = 0, first_invocation = 0, invocations = 0;
};
static_assert(sizeof(Settings) <= 128, "every Vulkan device offers 128 bytes of push constants, few offer more");

}  // namespace tandem::gpu
