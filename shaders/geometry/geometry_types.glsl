#include "geometry/intersection_choices.glsl"  // whose constants the host gives as floats

// From here on float means the type in which positions are computed: double in kernels of DOUBLE_GEOMETRY.
#ifdef DOUBLE_GEOMETRY
#include "arithmetic/double.glsl"
#endif
