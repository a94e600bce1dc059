#include "geometry/intersection_choices.glsl"  // whose constants the host gives as floats

// From here on float means what positions are computed in: double in kernels of DOUBLE_GEOMETRY.
#ifdef DOUBLE_GEOMETRY
#include "arithmetic/double.glsl"
#endif
