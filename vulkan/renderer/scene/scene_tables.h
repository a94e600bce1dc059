// The large tables of a scene: texels, the distribution of the background's image, texture coordinates, densities. All
// lie in one array of floats on the device (shaders/material/tables.glsl). Textures and media hold the places where
// theirs begin.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/render/effects.h"
#include "vulkan/renderer/scene/gpu_layout.h"

namespace tandem {

struct SceneTables {
    struct Part {
        std::string name;
        std::size_t floats = 0;
    };
    std::vector<float> numbers;
    std::vector<Part> parts;
    std::vector<gpu::Texture> textures;
    std::vector<gpu::Medium> media;
    gpu::Environment environment;
    std::uint32_t texture_coordinates = 0;          // where they begin
    std::uint32_t shading_normals = gpu::no_index;  // where they begin; or none
};

// Those that the `needed` effects use. triangles: those of entities by slot, and those of meshes, in object space.
struct TabledTriangles {
    std::span<const gpu::PrimitiveSource> placed, of_meshes;
};
[[nodiscard]] SceneTables make_scene_tables(const Scene& scene, EffectSet needed, const TabledTriangles& triangles);

// Appends numbers as a part of that name and returns where they begin. Throws UnsupportedError beyond 2^32 numbers.
std::uint32_t append_numbers(SceneTables& tables, const std::string& name, std::span<const float> numbers);

}  // namespace tandem
