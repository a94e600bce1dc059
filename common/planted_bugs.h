// Faults that test builds can plant in a backend to prove that the verdict notices them (VALIDATION 6). Release builds
// of the backends hold no trace of them and refuse any but `none`.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem {

enum class PlantedBug : std::uint32_t {
    none = 0,
    cosine_dropped,        // next event: f without the receiver's cosine
    inverse_pi_dropped,    // next event: f without 1/pi
    roulette_not_divided,  // survivors keep their throughput
    one_bounce_more,
    one_bounce_fewer,
    relative_index_inverted,
    pdf_not_of_sampler,      // uniform hemisphere directions weighted as cosine ones
    mis_weights_unequal,     // light sampling takes half of its weight where there is more than one light
    jacobian_missing,        // light pdf left in area measure
    light_from_behind,       // one-sided emitters emit on both sides
    dimension_reused,        // the second number of a scattering direction is the first again
    half_pixel_shift,        // film samples centred on pixel corners
    albedo_off_3_percent,    // diffuse colour times 1.03
    albedo_off_1_percent,    // diffuse colour times 1.01
    self_hit_not_excluded,   // rays start on the surface with no offset
    epsilon_too_large,       // rays start 1/100 of the scene off the surface
    total_reflection_lost,   // beyond the critical angle the path ends
    normal_transform_wrong,  // normals through the matrix instead of its inverse transpose
    radiance_clamped,        // a sample's radiance is cut at 1
    lens_radius_doubled,     // diameter for radius
    alpha_ignored,           // translucent absorption as if alpha were 1
    count
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(PlantedBug::count)> planted_bug_names{"none",
    "cosine-dropped", "inverse-pi-dropped", "roulette-not-divided", "one-bounce-more", "one-bounce-fewer",
    "relative-index-inverted", "pdf-not-of-sampler", "mis-weights-unequal", "jacobian-missing", "light-from-behind",
    "dimension-reused", "half-pixel-shift", "albedo-off-3-percent", "albedo-off-1-percent", "self-hit-not-excluded",
    "epsilon-too-large", "total-reflection-lost", "normal-transform-wrong", "radiance-clamped", "lens-radius-doubled",
    "alpha-ignored"};

}  // namespace tandem
