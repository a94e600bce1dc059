// The generators of hard cases, by room. Each returns nothing for a name that it does not know.
#pragma once

#include "common/stability/hard_case.h"

namespace tandem::stability {

// The case's parameter of that name, or InputError.
[[nodiscard]] double parameter(const HardCase& hard_case, const char* name);

[[nodiscard]] std::vector<RayWork> make_triangle_work(const HardCase& hard_case, Dice& dice);
[[nodiscard]] std::vector<RayWork> make_convex_work(const HardCase& hard_case, Dice& dice);
[[nodiscard]] std::vector<RayWork> make_leaving_work(const HardCase& hard_case, Dice& dice);

}  // namespace tandem::stability
