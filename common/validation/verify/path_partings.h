// What differs first where two renderers' paths for the same random numbers part, counted over many paths. One path
// tells where it parts, many tell what kind of fault parts them (explanation/signature.h).
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/path_trace.h"
#include "common/render/renderer.h"
#include "common/validation/verdict/tile_grid.h"
#include "common/validation/verify/number_uses.h"

namespace tandem {

// Figures of the vertex at which a path parts, in the order of causes. Those up to `throughput` arrive with the ray;
// where one of them differs, what follows from it is not looked at.
enum class PartsBy : std::uint32_t {
    camera,   // the ray of the camera
    spawned,  // the origin of a later ray, from one point
    met,      // what it meets
    place,    // where it meets it
    normal,
    shading_normal,
    throughput,       // dimmed on its way
    light_direction,  // next event: the point of the light, or whether any is aimed at
    light_radiance,
    light_density,
    light_response,       // the BSDF for it
    light_transmittance,  // of the way to it
    light_weight,         // against scattering
    shadow,               // whether it is seen, from the same point
    light,                // what it brings
    found_weight,         // of light that the ray itself has found, against next events
    emission,             // found by the ray itself
    end,                  // whether the path goes on
    direction,
    density,
    weight,    // of scattering
    survival,  // the chance that roulette left it
    sum,       // of the path, though all vertices are the same
    count
};
enum class Meeting : std::uint32_t {
    nothing,
    medium,
    emitter,
    diffuse,
    rough_diffuse,
    mirror,
    dielectric,
    conductor,
    boundary,
    count
};
inline constexpr std::size_t depth_classes = 6;  // vertex 0, 1, 2, 3 to 4, 5 to 8, later

// What parts two paths. Several figures of one vertex may differ at a time.
struct Parting {
    std::array<bool, static_cast<std::size_t>(PartsBy::count)> by{};
    std::size_t vertex = 0;
    std::uint32_t material = no_index;  // met there, by the reference
    std::uint32_t primitive = no_index;
    bool in_medium = false;
    bool by_roulette = false;  // one path alone is ended by roulette
    // log2 of candidate over reference, of the first of light, emission, weight, throughput and sum that differs; by
    // channel where both are above 0.
    std::array<std::optional<double>, 3> ratio{};
};
[[nodiscard]] std::optional<Parting> parting_of(const PathTrace& reference, const PathTrace& candidate);

struct PathPartings {
    std::uint64_t paths = 0, parted = 0;
    std::vector<glm::uvec2> pixels;  // that were traced
    // Shares of the parted paths.
    std::array<double, static_cast<std::size_t>(PartsBy::count)> by{};
    std::array<double, static_cast<std::size_t>(Meeting::count)> at{};
    std::array<double, 3> shape{};  // of PrimitiveKind
    double textured = 0.0;
    bool punctual_lights = false;  // the scene has some
    double by_roulette = 0.0;      // one path alone is ended by roulette
    double at_limit = 0.0;  // one path ends at the last scattering event that the settings allow, or just after it
    std::array<double, depth_classes> depth{};
    // Log2 ratios: their mean size, their spread about the mean, the spread of their channels.
    double ratio = 0.0, ratio_spread = 0.0, ratio_colour = 0.0;
    double touched = 0.0;     // share of all pixels whose block sums differ
    double film_apart = 0.0;  // share of the traced pixels whose film is not the sum of the traced paths, on a side
    bool pattern = false;     // the touched pixels lie in a pattern (pixel_pattern.h)
    // How far apart the two sides' draws are where they differ, relative to one side's draws for different samples. 1
    // for other random numbers, near 0 for the same ones turned into something else. 0: too few draws differ.
    double independence = 0.0;
    std::string frames;      // at which normals alone new directions differ (parting_patterns.h)
    std::string primitives;  // at which primitives alone paths part (parting_patterns.h)
    NumberUses numbers;      // at the vertex where most paths part; `same` where a side cannot tell
};

// What random numbers decided at a vertex: a light's point, a new direction, or how far to go in a medium.
class Draws {
public:
    // Both sides' paths of a pixel, and what parts them.
    void add(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate,
        const std::vector<std::optional<Parting>>& partings);
    [[nodiscard]] double independence() const;  // as in PathPartings

private:
    double between_sides_ = 0.0, between_samples_ = 0.0;  // sums of squared distances
    std::size_t pairs_ = 0;
};

// The counts over a list, without what needs the film. `bounces`: of the settings.
[[nodiscard]] PathPartings counted(
    const Scene& scene, std::uint32_t bounces, const std::vector<std::optional<Parting>>& paths);

struct PartingsQuestion {
    const Scene& scene;
    RenderSettings settings;  // the seed is that of both sides
    Renderer& reference;
    Renderer& candidate;
    std::optional<Rectangle> region;  // where they differ
    std::stop_token stop;
};

// Traces the first block of samples of some pixels whose sums differ. Nothing where a side cannot trace paths, or was
// stopped.
[[nodiscard]] std::optional<PathPartings> partings_of_paths(const PartingsQuestion& question);

}  // namespace tandem
