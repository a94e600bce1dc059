// Faults that test builds can plant in a backend to prove that the verdict notices them (VALIDATION 6). Release builds
// of the backends hold no trace of them and refuse any but `none`. Faults of data are planted in the scene or settings
// (tests/mutants/plant_data.cpp). Faults of the film are planted in the estimates of a job (plant_film.cpp). Faults of
// logic need hooks in the code: cpu_ref/planted.h and shaders/kernels/planted.glsl, with constants by
// shaders/tools/planted_bugs.py. Backends, amounts and scenes: tests/mutants/catalogue.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tandem {

// `amount` is the fault's (below).
enum class PlantedBug : std::uint32_t {
    none = 0,
    cosine_dropped,                 // next event: f without the receiver's cosine
    inverse_pi_dropped,             // next event: f without 1/pi
    roulette_not_divided,           // survivors of roulette keep their throughput
    one_bounce_more,                // a path may scatter once more than it should
    one_bounce_fewer,               // ... and once less
    relative_index_inverted,        // refraction by the inverse of the material's index
    pdf_not_of_sampler,             // uniform hemisphere directions weighted as cosine ones
    mis_weights_unequal,            // light sampling takes half of its weight where there is more than one light
    jacobian_missing,               // the density of light sampling left in area measure (CPU: of flat lights)
    light_from_behind,              // one-sided emitters emit on both sides
    dimension_reused,               // the second number of a scattering direction is the first again
    film_shifted,                   // film positions moved by `amount` pixels to the left and up
    albedo_scaled,                  // untextured diffuse colours brighter by the fraction `amount`
    self_hit_not_excluded,          // rays start on the surface with no offset and may find it again
    epsilon_too_large,              // rays start `amount` of the scene's size off the surface
    total_reflection_lost,          // beyond the critical angle the path ends
    normal_transform_wrong,         // normals through the matrix instead of its inverse transpose (CPU: of spheres)
    radiance_clamped,               // a sample's radiance is cut at 1
    lens_radius_scaled,             // the lens wider by the fraction `amount`; 1: diameter for radius
    alpha_ignored,                  // translucent absorption and emission as if alpha were 1
    next_event_scaled,              // light found by sampling is brighter by the fraction `amount`
    background_scaled,              // the background is brighter by the fraction `amount`
    background_inverted,            // the mix of two colours upside down
    light_choice_squared,           // lights chosen by the square of the number
    mixture_ignored,                // the weight of light found by scattering forgets how likely the light is chosen
    balance_on_one_side,            // light sampling is weighted with exponent 1, scattering with 2
    triangle_light_uneven,          // points of triangles from the number in place of its root
    sphere_light_cone_scaled,       // the density of the cone to a sphere off by the fraction `amount`
    cuboid_light_faces_even,        // points of cuboids on each face alike
    spot_falloff_linear,            // spots fade linearly between their cones
    spot_outer_scaled,              // the cosine of a spot's outer cone nearer to 1 by the fraction `amount`
    point_falloff_linear,           // points and spots fall off with the distance, not its square
    sky_sine_missing,               // the density of the sky's image as if all rows were as wide as the middle one
    sky_mirrored,                   // the sky's image mirrored
    sky_rotated,                    // the sky's image turned by `amount` of a full turn
    sky_nearest,                    // the sky's image without interpolation
    index_scaled,                   // refractive indices greater by the fraction `amount`
    schlick_for_exact,              // Schlick's reflectance in place of the exact one
    one_polarisation,               // reflectance of the perpendicular polarisation alone
    fuzz_scaled,                    // fuzz greater by the fraction `amount`
    albedo_twice,                   // untextured diffuse colours applied twice
    ggx_jacobian_missing,           // the density of a rough conductor's direction is that of its microfacet's normal
    ggx_masking_dropped,            // microfacets neither mask nor shadow
    conductor_fresnel_dropped,      // conductors reflect everything
    roughness_scaled,               // GGX's roughness greater by the fraction `amount`
    roughness_not_squared,          // GGX's alpha is the roughness itself
    rough_diffuse_term_dropped,     // rough diffuse surfaces without the light between their facets' two sides
    rough_diffuse_unweighted,       // paths that rough diffuse surfaces scatter are weighted as by smooth ones
    boundary_refracts,              // boundaries bend rays as a body of index 1.1 does
    priority_ignored,               // every surface of nested bodies is there
    outside_index_ignored,          // nested bodies refract as if vacuum were around them
    body_not_left,                  // bodies stay in the list after their back was passed
    extinction_scaled,              // media denser by the fraction `amount`
    phase_sign,                     // g with the wrong sign
    anisotropy_shifted,             // g greater by `amount`, in sampling and value
    free_path_unweighted,           // scattering in a medium without its weight
    absorption_scattering_swapped,  // what a medium absorbs it scatters, and the reverse
    medium_shadow_ignored,          // media do not dim next events
    grid_axes_swapped,              // cells of a grid looked up with x and y exchanged
    coordinates_swapped,            // u for v and v for u
    coordinates_flipped,            // images upside down on surfaces
    checker_shifted,                // checkers moved by one cell
    octave_missing,                 // turbulence with one octave fewer
    noise_seed_ignored,             // noise of seed 0
    texture_nearest,                // images on surfaces without interpolation
    texture_half_texel,             // images on surfaces moved by half a texel
    gamma_twice,                    // images on surfaces made linear a second time
    time_fixed,                     // every path at the shutter's opening
    time_dimension_shared,          // the moment is the lens's second number
    camera_motion_ignored,          // the camera stands still
    determinant_ignored,            // the front of mirrored triangles turned round
    field_scaled,                   // the image's half height greater by the fraction `amount`
    lens_uneven,                    // points of the lens from the number in place of its root
    focus_scaled,                   // the focus farther by the fraction `amount`
    box_skipped,                    // of two boxes of a tree the farther one is left out, in one of 128 nodes
    primitive_lost,                 // one of 64 primitives is never hit, if a triangle or a sphere
    face_normal_flipped,            // the normal of the upper z face of cuboids turned round
    sphere_inside_lost,             // the far side of spheres is never hit
    triangle_edge_lost,             // triangles narrower by `amount` of their weights on one side
    shadow_limit_short,             // blockers in the last `amount` of a shadow ray's way are overlooked
    shadow_limit_long,              // blockers behind a light, up to `amount` of its distance, count
    background_late_missing,        // the background is not seen by paths that have scattered twice
    heuristic_swapped,              // light found by scattering has the other technique's weight
    emission_scaled,                // emitting surfaces brighter by the fraction `amount`
    roulette_late,                  // roulette begins one event late: no bias, but other paths
    seed_repeated,                  // pixels 4096 apart have the same random numbers
    number_exchanged,  // scattering directions use the roulette's number: no bias without roulette, but other paths
    sample_lost,       // the sum forgets one of 512 samples, as threads do that race
    stale_constant,    // kernels made for a scene without one of its effects
    layouts_apart,     // a material's fuzz stands where its alpha is read
    shading_normal_of_corner,        // meshes are shaded by the normal of each triangle's first corner
    shading_normal_transform_wrong,  // vertex normals through the matrix instead of its inverse transpose
    shading_guard_dropped,           // directions on the wrong side of one of the two normals count
    light_tree_parents_forgotten,    // of light trees the choice between the last two lights alone counts
    light_tree_number_reused,        // ... every node is left by the same number
    light_tree_normal_forgotten,     // ... scattering that hits a light forgets the normal that it came from
    filter_width_scaled,             // of pixel filters but the box: wider by the fraction `amount`
    filter_off_centre,               // ... about the pixel's upper left corner
    filter_even,                     // ... every place within its reach is drawn alike
    // Never tuned for: in the catalogue before it was known which are found.
    throughput_half,           // paths keep their throughput in half precision
    reciprocal_short,          // next event: the reciprocal of the density has 12 bits
    random_short,              // random numbers have 16 bits
    texture_weights_short,     // images are interpolated with weights of 8 bits
    lamp_density_at_rest,      // MIS: the density of a moving lamp is that of its place at rest
    numbers_reused,            // vertex 9 scatters and samples lights with the numbers of vertex 5
    seed_high_word_ignored,    // the seed's upper 32 bits do not count
    sample_high_bits_lost,     // a sample's number has 32 bits
    workgroup_lost,            // the last pixels, fewer than a workgroup of 64, are not rendered
    row_lost,                  // the last row is not rendered
    pixel_index_short,         // a pixel's number has 16 bits
    tile_offset_wrong,         // tiles but the first are stored one pixel late
    accumulation_missing,      // the last sample of each block is counted, but not added
    film_half,                 // the sums of a block are kept in half precision
    lane_repeated,             // the last of each 32 pixels has the sums of the one before
    block_swizzled,            // rows and columns of each block of 8x8 pixels are exchanged
    camera_stale,              // the camera is `amount` of its distance behind, as in an earlier frame
    vertices_short,            // the corners of triangles lie on a grid of `amount` bits of a mesh's size
    normals_short,             // vertex normals have 8 bits a component
    pitch_wrong,               // rows of images on surfaces begin one texel late, each later than the row above
    base_vertex_wrong,         // the last triangle of each mesh has its first corner from the next vertex
    material_wrong,            // the last entity has the material before its own
    texture_channels_swapped,  // images on surfaces have red for blue
    texture_short,             // images on surfaces have 8 bits of linear light
    last_light_lost,           // the last light without a surface is left out
    medium_grey,               // media absorb and scatter all colours as their mean
    motion_halved,             // what moves goes half of its way
    count
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(PlantedBug::count)> planted_bug_names{"none",
    "cosine-dropped", "inverse-pi-dropped", "roulette-not-divided", "one-bounce-more", "one-bounce-fewer",
    "relative-index-inverted", "pdf-not-of-sampler", "mis-weights-unequal", "jacobian-missing", "light-from-behind",
    "dimension-reused", "film-shifted", "albedo-scaled", "self-hit-not-excluded", "epsilon-too-large",
    "total-reflection-lost", "normal-transform-wrong", "radiance-clamped", "lens-radius-scaled", "alpha-ignored",
    "next-event-scaled", "background-scaled", "background-inverted", "light-choice-squared", "mixture-ignored",
    "balance-on-one-side", "triangle-light-uneven", "sphere-light-cone-scaled", "cuboid-light-faces-even",
    "spot-falloff-linear", "spot-outer-scaled", "point-falloff-linear", "sky-sine-missing", "sky-mirrored",
    "sky-rotated", "sky-nearest", "index-scaled", "schlick-for-exact", "one-polarisation", "fuzz-scaled",
    "albedo-twice", "ggx-jacobian-missing", "ggx-masking-dropped", "conductor-fresnel-dropped", "roughness-scaled",
    "roughness-not-squared", "rough-diffuse-term-dropped", "rough-diffuse-unweighted", "boundary-refracts",
    "priority-ignored", "outside-index-ignored", "body-not-left", "extinction-scaled", "phase-sign",
    "anisotropy-shifted", "free-path-unweighted", "absorption-scattering-swapped", "medium-shadow-ignored",
    "grid-axes-swapped", "coordinates-swapped", "coordinates-flipped", "checker-shifted", "octave-missing",
    "noise-seed-ignored", "texture-nearest", "texture-half-texel", "gamma-twice", "time-fixed", "time-dimension-shared",
    "camera-motion-ignored", "determinant-ignored", "field-scaled", "lens-uneven", "focus-scaled", "box-skipped",
    "primitive-lost", "face-normal-flipped", "sphere-inside-lost", "triangle-edge-lost", "shadow-limit-short",
    "shadow-limit-long", "background-late-missing", "heuristic-swapped", "emission-scaled", "roulette-late",
    "seed-repeated", "number-exchanged", "sample-lost", "stale-constant", "layouts-apart", "shading-normal-of-corner",
    "shading-normal-transform-wrong", "shading-guard-dropped", "light-tree-parents-forgotten",
    "light-tree-number-reused", "light-tree-normal-forgotten", "filter-width-scaled", "filter-off-centre",
    "filter-even", "throughput-half", "reciprocal-short", "random-short", "texture-weights-short",
    "lamp-density-at-rest", "numbers-reused", "seed-high-word-ignored", "sample-high-bits-lost", "workgroup-lost",
    "row-lost", "pixel-index-short", "tile-offset-wrong", "accumulation-missing", "film-half", "lane-repeated",
    "block-swizzled", "camera-stale", "vertices-short", "normals-short", "pitch-wrong", "base-vertex-wrong",
    "material-wrong", "texture-channels-swapped", "texture-short", "last-light-lost", "medium-grey", "motion-halved"};

// A bug and how bad it is, where that can be chosen.
struct PlantedFault {
    constexpr PlantedFault(PlantedBug bug_ = PlantedBug::none, double amount_ = 0.0) : bug(bug_), amount(amount_) {}
    constexpr bool operator==(const PlantedFault&) const = default;
    PlantedBug bug;
    double amount;
};

}  // namespace tandem
