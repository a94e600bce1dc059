// What the verdict is held to: margins, tolerances and error rates, all declared in advance and printed in the report.
#pragma once

#include <cstdint>

namespace tandem {

// "agree" means that every relative difference is shown to lie within these.
struct Margins {
    double image = 0.005;  // mean of each channel over the image
    double tile = 0.10;    // mean of each channel over each 16x16 tile
    // A tile's difference is relative to its reference mean, or to this fraction of the image's mean in that channel
    // where the tile is darker: in near darkness a relative figure says nothing. Likewise a channel darker than
    // `channel_floor` times the mean of all three is held against that.
    double tile_floor = 0.25;
    double channel_floor = 0.1;
};

// Differences too small to be called a fault, however sure they are: a difference counts against the candidate only if
// it is significantly larger. Rounding in float transport stays far below.
struct Negligible {
    double image = 1e-4;
    double tile = 1e-3;
    double pixel = 1e-2;
    // Paired seeds know a difference so well that rounding itself shows: float against double was measured to differ by
    // (4 +- 2) 1e-6 of the image on the classic Cornell box, and by less than 6e-4 of any tile. One bounce fewer of
    // twelve makes 3.4e-4 of the image there.
    double paired_image = 2e-4;
    double paired_tile = 2e-3;
    double paired_pixel = 5e-3;    // root mean square over a tile's pixels
    double variance_ratio = 1.25;  // variances of one sample, either way
};

struct Criteria {
    Margins margins;
    Negligible negligible;
    double false_alarm = 0.01;     // a scene's chance of a wrong "disagree", over all looks and levels
    double doubt = 0.05;           // chance of a wrong "agree"; intervals have confidence 1 - doubt, over all looks
    double discovery_rate = 0.01;  // Benjamini-Hochberg q of the pixel map
    double power = 0.9;            // of the minimum detectable difference
    // Both sides draw from one distribution where they are right, as two backends with one integrator do. Then a
    // different variance is a fault. Otherwise it is only reported, and pixels allow for rare samples that one side has
    // not drawn.
    bool same_estimator = true;
    // Pixels without variance on both sides must be equal to this relative tolerance (fixed_pixels.h).
    double fixed_tolerance = 0.0;
};

}  // namespace tandem
