// The intersection tests and self-intersection guards that can be chosen (MODEL.md section 5.3). The first of each is
// the default. `tandem stability` compares the others with it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace tandem {

// Tests of a ray against a triangle. The last two are Embree's own, of its plain and its robust hierarchy.
enum class TriangleKernel : std::uint32_t {
    watertight = 0,
    moller_trumbore = 1,
    baldwin_weber = 2,
    embree = 3,
    embree_robust = 4
};
inline constexpr std::array<std::string_view, 5> triangle_kernel_names{
    "watertight", "moller-trumbore", "baldwin-weber", "embree", "embree-robust"};

// Tests against spheres and cuboids: stable ones, or those of the textbooks (the quadratic formula as it stands;
// slabs by minimum and maximum).
enum class ConvexKernel : std::uint32_t { stable = 0, naive = 1 };
inline constexpr std::array<std::string_view, 2> convex_kernel_names{"stable", "naive"};

// What keeps a ray from finding again the surface that it leaves.
enum class SelfIntersectionGuard : std::uint32_t {
    error_bound = 0,    // moved along the normal by a bound on the hit point's rounding error, the primitive excluded
    fixed_epsilon = 1,  // moved along the normal by `epsilon`, nothing excluded
    ulp = 2,            // each coordinate moved by up to 256 representable numbers [Wächter 2019], nothing excluded
    exclusion = 3       // not moved, the primitive excluded
};
inline constexpr std::array<std::string_view, 4> guard_names{"error-bound", "fixed-epsilon", "ulp", "exclusion"};

struct IntersectionSettings {
    TriangleKernel triangles = TriangleKernel::watertight;
    ConvexKernel convex = ConvexKernel::stable;
    SelfIntersectionGuard guard = SelfIntersectionGuard::error_bound;
    double epsilon = 1e-4;  // > 0, scene units, of fixed_epsilon alone
    bool operator==(const IntersectionSettings&) const = default;
};

// "moller-trumbore", and so on, by the number that an enumeration stands for.
template <class Enumeration, std::size_t count>
[[nodiscard]] constexpr std::string_view name_of(Enumeration value, const std::array<std::string_view, count>& names) {
    return names[static_cast<std::size_t>(value)];
}

}  // namespace tandem
