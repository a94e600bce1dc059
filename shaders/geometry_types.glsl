// From here on float means what positions are computed in: double in kernels of DOUBLE_GEOMETRY.
#ifdef DOUBLE_GEOMETRY
#include "double.glsl"
#endif
