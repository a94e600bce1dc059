// What the fuzzers feed: each target takes the bytes of one hostile file, as a scene's reader meets it. Returning means
// that the file was read into a sound scene, or refused in one clear line; anything else aborts the program.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace tandem::fuzz {

using Bytes = std::span<const std::byte>;

struct Target {
    std::string_view name;
    void (*run)(Bytes);
};

void scene(Bytes bytes);   // a scene file, beside models, images and volumes that are sound
void obj(Bytes bytes);     // models of a scene that is sound, with its materials and with their own
void mtl(Bytes bytes);     // materials of such a model
void gltf(Bytes bytes);    // JSON, or binary where it begins so; as obj
void volume(Bytes bytes);  // a density grid
void image(Bytes bytes);   // a portable float map, or what the image library reads, as texture, sky and picture

inline constexpr std::array<Target, 6> targets{
    {{"scene", scene}, {"obj", obj}, {"mtl", mtl}, {"gltf", gltf}, {"volume", volume}, {"image", image}}};

}  // namespace tandem::fuzz
