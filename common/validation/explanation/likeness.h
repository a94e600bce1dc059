// The planted bugs that resemble a difference: the nearest of the stored signatures (signature.h), and their
// subsystems. It also tells how often such a naming is right. If no signature is near, none is named.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/validation/explanation/signature.h"

namespace tandem {

// Where a fault lies, by the parts of a path tracer.
enum class Subsystem : std::uint32_t {
    light_sampling,
    mis_weights,
    emission,
    bsdf,
    dielectric,
    roulette,
    camera,
    random_numbers,
    textures,
    volumes,
    geometry,
    accumulation,
    indexing,
    scene_data,
    arithmetic,
    count
};
inline constexpr std::array<std::string_view, static_cast<std::size_t>(Subsystem::count)> subsystem_names{
    "light sampling", "MIS weights", "emission and background", "BSDF", "dielectrics and refraction",
    "roulette and path length", "camera, lens and time", "random numbers", "textures", "volumes",
    "intersection and geometry", "accumulation", "indexing and dispatch", "scene data", "arithmetic"};

// One row of the record: a bug that was planted in a backend, and what a scene showed of it.
struct PlantedSignature {
    std::string_view bug;
    std::string_view planting;  // "cpu" or "vulkan"
    Subsystem subsystem = Subsystem::count;
    Signature signature;
};

// The record, compiled in (planted_signatures.def).
[[nodiscard]] std::span<const PlantedSignature> planted_signatures();

struct Likeness {
    std::vector<std::string_view> bugs;  // the nearest of the first subsystem, at most two
    std::vector<Subsystem> subsystems;   // likeliest first, at most three
    double sureness = 0.0;               // the first one's share of all scores
    std::size_t right = 0, of = 0;       // of the planted bugs that were as sure, how often the first one was right
};

// The distance of two signatures: the sum of the figures' absolute differences, each times its weight.
[[nodiscard]] double distance(const Signature& a, const Signature& b);

// One for each subsystem.
using Scores = std::array<double, subsystem_names.size()>;
[[nodiscard]] inline std::string_view name_of(Subsystem subsystem) {
    return subsystem_names.at(static_cast<std::size_t>(subsystem));
}

// A subsystem's score is its share of the five nearest kinds' votes, each the inverse of a squared distance. To it
// comes what the figures say of the subsystem by themselves.
//
// The scores by the rows of bugs other than `left_out`; by the figures alone where there are none.
[[nodiscard]] Scores scores_of(
    const Signature& signature, std::span<const PlantedSignature> rows, std::string_view left_out = {});

// Likeness to the rows of bugs other than `left_out`, without what is known of how often it is right. Nothing where
// there are no rows.
[[nodiscard]] std::optional<Likeness> vote(
    const Signature& signature, std::span<const PlantedSignature> rows, std::string_view left_out = {});

// Likeness to the whole record, with that. Nothing where no row is near.
[[nodiscard]] std::optional<Likeness> likeness_of(
    const Signature& signature, std::span<const PlantedSignature> rows = planted_signatures());

// "errs like next-event-scaled (light sampling; else MIS weights): right for 40 of 45 planted bugs"; 25 words at most.
[[nodiscard]] std::string told(const Likeness& likeness);

}  // namespace tandem
