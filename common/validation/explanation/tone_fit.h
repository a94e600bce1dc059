// Least squares for supposed changes of value: a factor, a power, an offset, a mixing of channels. Whether a change
// explains the difference is tested elsewhere (explained_share.h).
#pragma once

#include "common/validation/explanation/image_pair.h"

namespace tandem {

// candidate = factor * reference, over the means of 8x8 tiles with the weights of explained_share.h; the noise of the
// reference is taken out of its square. The error is the jackknife's over 16x16 blocks.
struct Factor {
    double value = 1.0, error = 0.0;
};
[[nodiscard]] Factor fit_factor(const ImagePair& pair);
[[nodiscard]] Factor fit_factor(const ImagePair& pair, std::uint32_t channel);

// candidate = reference + offset, likewise.
[[nodiscard]] double fit_offset(const ImagePair& pair);

// candidate = factor * reference^exponent, the power taken on the one side whose noise it fits. A side that was encoded
// after its samples were averaged is decoded pixel by pixel. `free_factor`: else it is 1. Exponents from 1/4 to 4 are
// looked at.
struct Power {
    double exponent = 1.0, factor = 1.0;
    ImagePair mended;
};
[[nodiscard]] Power fit_power(const ImagePair& pair, bool free_factor);

// candidate's channel r = sum over c of rows[r][c] * the reference's channel c.
struct Mixing {
    std::array<std::array<double, channel_count>, channel_count> rows{};
    ImagePair mended;
};
[[nodiscard]] Mixing fit_mixing(const ImagePair& pair);

}  // namespace tandem
