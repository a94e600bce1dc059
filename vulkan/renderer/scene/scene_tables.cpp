#include "vulkan/renderer/scene/scene_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <map>
#include <memory>
#include <numbers>
#include <span>

#include "common/error.h"

namespace tandem {

std::uint32_t append_numbers(SceneTables& tables, const std::string& name, std::span<const float> numbers) {
    const std::size_t first = tables.numbers.size();
    if (first + numbers.size() > 0xffffffffu)
        throw UnsupportedError("the scene's images and grids hold more than 2^32 numbers; use smaller ones");
    tables.numbers.insert(tables.numbers.end(), numbers.begin(), numbers.end());
    const auto same = std::ranges::find(tables.parts, name, &SceneTables::Part::name);
    if (same == tables.parts.end())
        tables.parts.push_back({name, numbers.size()});
    else
        same->floats += numbers.size();
    return static_cast<std::uint32_t>(first);
}

namespace {

class TableBuilder {
public:
    std::uint32_t append(const std::string& name, std::span<const float> numbers) {
        return append_numbers(tables, name, numbers);
    }

    SceneTables tables;
};

gpu::Texture flatten(const Texture& texture) {
    gpu::Texture result;
    result.first = gpu::rounded<float>(texture.first);
    result.second = gpu::rounded<float>(texture.second);
    result.frequency = gpu::rounded<float>(texture.frequency);
    result.kind = static_cast<std::uint32_t>(texture.kind);
    result.space = static_cast<std::uint32_t>(texture.space);
    result.style = static_cast<std::uint32_t>(texture.style);
    result.octaves = texture.octaves;
    result.seed = texture.seed;
    result.amount = static_cast<float>(texture.amount);
    return result;
}

void add_textures(const Scene& scene, EffectSet needed, TableBuilder& builder) {
    std::map<const Pixels*, std::uint32_t> known;  // images that several textures share are kept once
    for (const Texture& texture : scene.textures) {
        gpu::Texture result = flatten(texture);
        if (texture.kind == TextureKind::image && texture.image && needed.has(Effect::image_texture)) {
            const Pixels& image = *texture.image;
            if (!known.contains(&image)) known[&image] = builder.append("image-texels", image.rgb);
            result.texels = known[&image];
            result.width = image.width;
            result.height = image.height;
        }
        builder.tables.textures.push_back(result);
    }
}

void add_media(const Scene& scene, EffectSet needed, TableBuilder& builder) {
    std::map<const DensityGrid*, std::uint32_t> known;
    for (const Medium& medium : scene.media) {
        gpu::Medium result;
        result.absorption = gpu::rounded<float>(medium.absorption);
        result.scattering = gpu::rounded<float>(medium.scattering);
        result.anisotropy = static_cast<float>(medium.anisotropy);
        if (medium.grid && needed.has(Effect::density_grid)) {
            const DensityGrid& grid = *medium.grid;
            if (!known.contains(&grid)) known[&grid] = builder.append("density-grid", grid.density);
            result.densities = known[&grid];
            result.low = gpu::rounded<float>(grid.low);
            result.high = gpu::rounded<float>(grid.high);
            result.cells_x = grid.cells[0];
            result.cells_y = grid.cells[1];
            result.cells_z = grid.cells[2];
        }
        builder.tables.media.push_back(result);
    }
}

// Three pairs a triangle; without a model's own, those of MODEL.md section 5.1.
void add_texture_coordinates(const Scene& scene, const TabledTriangles& triangles, TableBuilder& builder) {
    std::vector<float> pairs;
    const auto add = [&](const glm::dvec2& uv) {
        pairs.insert(pairs.end(), {static_cast<float>(uv.x), static_cast<float>(uv.y)});
    };
    for (const std::span<const gpu::PrimitiveSource> sources : {triangles.placed, triangles.of_meshes})
        for (const gpu::PrimitiveSource& source : sources) {
            if (scene.texture_coordinates.empty()) {
                for (const glm::dvec2& uv : {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(0, 1)}) add(uv);
                continue;
            }
            for (const std::uint32_t index : {source.index0, source.index1, source.index2})
                add(scene.texture_coordinates[index]);
        }
    builder.tables.texture_coordinates = builder.append("texture-coordinates", pairs);
}

// Three vectors a triangle, in the world, but of meshes in object space; those of a triangle times one factor, which
// keeps them within singles.
void add_shading_normals(const Scene& scene, const TabledTriangles& triangles, TableBuilder& builder) {
    std::vector<float> vectors;
    const auto add = [&](const gpu::PrimitiveSource& source, const glm::dmat3& normal_to_world) {
        std::array<glm::dvec3, 3> normals;
        double longest = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t index = std::array{source.index0, source.index1, source.index2}[i];
            normals[i] = normal_to_world * scene.normals[index];
            longest = std::max(longest, glm::length(normals[i]));
        }
        for (const glm::dvec3& normal : normals) {
            const gpu::Vec3 scaled = gpu::rounded<float>(longest > 0.0 ? normal / longest : normal);
            vectors.insert(vectors.end(), {scaled.x, scaled.y, scaled.z});
        }
    };
    for (const gpu::PrimitiveSource& source : triangles.placed) {
        const glm::dmat3 to_world(scene.entities[source.entity].object_to_world);
        add(source, glm::transpose(glm::inverse(to_world)));
    }
    for (const gpu::PrimitiveSource& source : triangles.of_meshes) add(source, glm::dmat3(1.0));
    builder.tables.shading_normals = builder.append("shading-normals", vectors);
}

// The cumulative shares of `weights`, exactly 1 from the last positive one on.
std::vector<float> cumulative_shares(std::span<const double> weights) {
    double total = 0.0, before = 0.0;
    std::size_t last = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        total += weights[i];
        if (weights[i] > 0.0) last = i;
    }
    std::vector<float> shares;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        before += weights[i];
        shares.push_back(i >= last || total == 0.0 ? 1.0f : static_cast<float>(before / total));
    }
    return shares;
}

// The greatest sum of channels among the 3 x 3 texels around each: columns repeat, rows are held (MODEL.md
// section 8.2).
std::vector<double> brightest_around(const Pixels& image) {
    const std::size_t width = image.width, height = image.height;
    const auto brightness = [&](std::size_t column, std::size_t row) {
        const float* texel = &image.rgb[3 * (row * width + column)];
        return double{texel[0]} + double{texel[1]} + double{texel[2]};
    };
    std::vector<double> result(width * height);
    for (std::size_t row = 0; row < height; ++row)
        for (std::size_t column = 0; column < width; ++column)
            for (const std::size_t y : {row == 0 ? 0 : row - 1, row, std::min(row + 1, height - 1)})
                for (const std::size_t x : {(column + width - 1) % width, column, (column + 1) % width})
                    result[row * width + column] = std::max(result[row * width + column], brightness(x, y));
    return result;
}

void add_environment(const Background& background, EffectSet needed, TableBuilder& builder) {
    const Pixels& image = *background.image;
    gpu::Environment& result = builder.tables.environment;
    const double turn = glm::radians(background.rotation_degrees);
    result.size = {image.width, image.height};
    result.rotation = {static_cast<float>(std::cos(turn)), static_cast<float>(std::sin(turn))};
    std::vector<float> texels;
    for (const float value : image.rgb) texels.push_back(static_cast<float>(value * background.image_scale));
    result.texels = builder.append("background-image", texels);
    if (!needed.has(Effect::sampled_background)) return;

    const std::vector<double> brightest = brightest_around(image);
    std::vector<double> rows(image.height);
    std::vector<float> columns;
    double total = 0.0;
    for (std::uint32_t row = 0; row < image.height; ++row) {
        const double upper = std::cos(std::numbers::pi * row / image.height);
        const double lower = std::cos(std::numbers::pi * (row + 1) / image.height);
        const double angle = 2.0 * std::numbers::pi / image.width * (upper - lower);  // of a cell
        const std::span cells(&brightest[std::size_t{row} * image.width], image.width);
        for (const double cell : cells) rows[row] += angle * cell;
        total += rows[row];
        const std::vector<float> shares = cumulative_shares(cells);
        columns.insert(columns.end(), shares.begin(), shares.end());
    }
    std::vector<float> density;
    for (const double cell : brightest) density.push_back(static_cast<float>(cell / total));
    result.density = builder.append("background-shares", density);
    result.rows = builder.append("background-shares", cumulative_shares(rows));
    result.columns = builder.append("background-shares", columns);
}

}  // namespace

SceneTables make_scene_tables(const Scene& scene, EffectSet needed, const TabledTriangles& triangles) {
    TableBuilder builder;
    if (needed.has(Effect::checker) || needed.has(Effect::noise) || needed.has(Effect::image_texture))
        add_textures(scene, needed, builder);
    if (needed.has(Effect::medium_absorption)) add_media(scene, needed, builder);
    if (needed.has(Effect::texture_coordinates)) add_texture_coordinates(scene, triangles, builder);
    if (needed.has(Effect::shading_normals)) add_shading_normals(scene, triangles, builder);
    if (needed.has(Effect::background_image)) add_environment(scene.background, needed, builder);
    return builder.tables;
}

}  // namespace tandem
