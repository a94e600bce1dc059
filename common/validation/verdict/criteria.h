// The criteria of the verdict: margins, tolerances and error rates. All are declared in advance and printed in the
// report.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/render/estimate.h"

namespace tandem {

// "agree" means that every relative difference is shown to lie within these. What a user wants to know is a choice, so
// they are options; the defaults are what `verify`'s own effort can show. Let s be the relative deviation of one
// sample, and n the samples a pixel and side. A mean over P pixels is known to s sqrt(2/(P n)). It is shown to lie
// within 2.4 times that (one of six looks' share of the doubt of 5 %). On 128x128 pixels at n = 2048 that is 0.06 % s
// of the image and 0.5 % s of a tile of 256 pixels. So s may be up to 8 for the image's margin. For the tiles' it may
// be up to 20, as in tiles lit by rare paths.
struct Margins {
    double image = 0.005;  // mean of each channel over the image
    double tile = 0.10;    // mean of each channel over each 16x16 tile
    // A tile's difference is relative to its reference mean, or to this fraction of the image's mean in that channel
    // where the tile is darker. There the noise of a dark tile stands against a mean near 0, and a relative figure says
    // nothing. A channel darker than `channel_floor` times the mean of all three is held against that mean. Choices of
    // what is seen as dark: two stops, and a tenth of grey.
    double tile_floor = 0.25;
    double channel_floor = 0.1;
};

// Differences too small to be called a fault, however sure they are: a difference counts against the candidate only if
// it is significantly larger. They lie between what rounding can do and what a small fault does.
//
// Rounding of one path's arithmetic is at most float_transport_tolerance(D) = (7 D + 8) 2^-23: 1.1e-5 at D = 12
// bounces, 1e-4 at D = 118. Rounding of places moves edges (of shapes, shadows, textures). Coordinates as large as the
// view are off by some 8 ulp a side, 2^-20 of its width between both. So d = 1.2e-4 pixel of 128. An edge through a
// tile of E pixels moves at most sqrt(2) d/E of its area from one side to the other. Its mean changes by that times the
// contrast C of the two, in units of the tile's scale.
struct Negligible {
    // Arithmetic of up to 118 bounces. Moved edges darken as many pixels as they brighten, and add d/128 C at most.
    double image = 1e-4;
    // The edge of a light 46 times as bright as the scale of the smallest tile (8x8): sqrt(2) d/8 C.
    double tile = 1e-3;
    // ... 58 times as bright as that of the pixel: sqrt(2) d C.
    double pixel = 1e-2;
    // Paired seeds know a difference so well that rounding itself shows. On the classic Cornell box, float and double
    // differed by (4 +- 2) 1e-6 of the image, and by less than 6e-4 of any tile. A moved edge changes whole paths,
    // whose light is brighter than the scale. Thresholds are at least three times that. The image's is above the
    // arithmetic of 238 bounces. It is below the smallest fault to be found, one bounce fewer of twelve, which makes
    // 3.4e-4 of the image there.
    double paired_image = 2e-4;
    double paired_tile = 2e-3;
    // Root mean square over a tile's pixels. It is d C sqrt(32/256) for the edge of a light 115 times as bright as the
    // scale through 32 of the 256.
    double paired_pixel = 5e-3;
    // Variances of one sample, either way. Rounding changes none by more than it changes squares of samples (2e-4). A
    // fault of this size costs a quarter more samples for the same noise, and is the least one worth a name.
    double variance_ratio = 1.25;
};

// The most that a sample may be on each side (greatest_sample.h), per channel.
struct GreatestSamples {
    std::array<double, channel_count> reference{}, candidate{};
};

// Paired samples are drawn until a true difference of this size in the image and every 16x16 tile would be noticed
// (with Criteria::power). Else they are drawn until the time ends. There is no agreement before. The sizes are two and
// a half times what is negligible, so that nearly every difference worth a name is found. Closer to it the samples grow
// without bound.
struct PairedResolution {
    double image = 5e-4, tile = 5e-3;
};

struct Criteria {
    Margins margins;
    Negligible negligible;
    PairedResolution paired_resolution;
    double false_alarm = 0.01;     // a scene's chance of a wrong "disagree", over all looks and levels
    double doubt = 0.05;           // chance of a wrong "agree"; intervals have confidence 1 - doubt, over all looks
    double discovery_rate = 0.01;  // Benjamini-Hochberg q of the pixel map
    double power = 0.9;            // of the minimum detectable difference
    // Both sides draw from one distribution where they are right, as two backends with one integrator do. Then a
    // different variance is a fault. Otherwise it is only reported, and pixels allow for rare samples that one side has
    // not drawn.
    bool same_estimator = true;
    // Given where one side may not have drawn the rare samples that its mean rests on, as one that samples no lights.
    // Then only what the empirical Bernstein bound allows contradicts: neither Student's t nor pairs nor pixels that
    // look fixed know of such samples.
    std::optional<GreatestSamples> greatest;
    // Arithmetic coarser than single precision is a disagreement; otherwise an agreement says so.
    bool strict = false;
    // Pixels without variance on both sides must be equal to this relative tolerance (fixed_pixels.h).
    double fixed_tolerance = 0.0;
};

}  // namespace tandem
