// The pattern of a difference, as figures that do not depend on the size of the image or on which side is wrong. They
// say what parts the paths, where, and by how much. They also describe the difference in the image, and the looks at
// single samples that see it.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "common/render/effects.h"
#include "common/validation/verdict/verdict.h"
#include "common/validation/verify/path_partings.h"

namespace tandem {

// Each is a share, or a logarithm that is brought to about 0 ... 1.
enum class Figure : std::uint32_t {
#define FIGURE(name) name,
#include "common/validation/explanation/figures.def"
#undef FIGURE
    count
};
inline constexpr std::size_t figure_count = static_cast<std::size_t>(Figure::count);
[[nodiscard]] std::string_view figure_name(Figure figure);

struct Signature {
    std::array<float, figure_count> figures{};
    [[nodiscard]] float& operator[](Figure figure) { return figures[static_cast<std::size_t>(figure)]; }
    [[nodiscard]] float operator[](Figure figure) const { return figures[static_cast<std::size_t>(figure)]; }
};

[[nodiscard]] Signature signature_of(
    const Judgement& judgement, const PairedResult& paired, const PathPartings& partings, EffectSet effects);

}  // namespace tandem
