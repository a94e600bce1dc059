// Which effects are simulated: bit i of the two words is effect i of common/render/effects.def. An absent effect's code is
// dropped when the pipeline is built. An effect that is present but not called for finds nothing to do in the data. So
// the general kernels, which simulate everything, do the same arithmetic to the last bit
// (shaders/tools/exact_arithmetic.py).
#ifndef EFFECTS_GLSL
#define EFFECTS_GLSL

#include "made/constant_ids.glsl"

layout(constant_id = id_effects_low) const uint effects_low = 0xffffffffu;
layout(constant_id = id_effects_high) const uint effects_high = 0xffffffffu;

#include "made/effect_bits.glsl"  // has_triangles, ...

#endif
