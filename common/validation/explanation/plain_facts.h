// Observations on the values of one image, without a fit. These are rectangles of one value, values clipped at a
// maximum, and channels that are copies of each other. Whether they explain the whole difference is tested elsewhere.
#pragma once

#include <string>

#include "common/validation/explanation/image_pair.h"

namespace tandem {

struct PlainFact {
    std::string text;            // "the candidate is black at x 3 to 20, y 4 to 9"
    std::vector<bool> left_out;  // [pixel * 3 + channel]: what it speaks of, where the sides cannot be compared
};

// Up to 16 rectangles in which one side has one value, bit for bit, that the other does not have there. It may be in
// all channels or in some. A rectangle is 4 pixels or more.
[[nodiscard]] std::vector<PlainFact> rectangles_of_one_value(const ImagePair& pair);

// The greatest value of one side is there 4 times or more, in whatever channels. The other side exceeds it in most of
// these places.
[[nodiscard]] std::vector<PlainFact> ceilings(const ImagePair& pair);

// One side's three channels are the same in every pixel, the other's are not.
[[nodiscard]] std::string copied_channels(const ImagePair& pair);

}  // namespace tandem
