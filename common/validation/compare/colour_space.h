// What an image's declared colour space means: which primaries, and how its values become linear light.
#pragma once

#include <string>

#include "common/image/image_io.h"

namespace tandem {

// How values stand for light.
struct Transfer {
    enum class Curve { linear, srgb, power };
    Curve curve = Curve::linear;
    double exponent = 1.0;  // of a power: light = value^exponent

    [[nodiscard]] double decoded(double value) const;  // to linear light; odd about 0
    [[nodiscard]] double encoded(double light) const;  // the inverse
    // Light of one unit of `value` there, for the step between neighbouring integers.
    [[nodiscard]] double slope(double value) const;
};

struct ColourSpace {
    // One name for each set of primaries: "Rec. 709" and so on, an unknown one as declared in lower case; empty: the
    // file does not say.
    std::string primaries;
    Transfer transfer;
};

// By the table of synonyms in README.md, whatever the case of letters and the marks between them. Integers without a
// declared space are taken as sRGB, floats as linear.
[[nodiscard]] ColourSpace colour_space_of(const Image& image);

}  // namespace tandem
