// From here on float means what light is computed in: double in kernels of DOUBLE_SHADING.
#ifdef DOUBLE_SHADING
#include "arithmetic/double.glsl"
#else
#include "arithmetic/single.glsl"
#endif
