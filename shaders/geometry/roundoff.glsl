// The unit roundoff of the precision in which geometry is computed.
#ifndef ROUNDOFF_GLSL
#define ROUNDOFF_GLSL

#include "made/constant_ids.glsl"

#ifdef DOUBLE_GEOMETRY
const float unit_roundoff = 1.1102230246251565e-16lf;
// Rounding of points that are handed on: in mixed precision they are floats.
layout(constant_id = id_hands_on_floats) const bool hands_on_floats = false;
const float handed_roundoff = hands_on_floats ? 5.9604644775390625e-8 : 0.0;
#else
const float unit_roundoff = 5.9604644775390625e-8;
const float handed_roundoff = 0.0;
#endif

#endif
