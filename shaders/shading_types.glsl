// From here on float means what light is computed in: double in kernels of DOUBLE_SHADING.
#ifdef DOUBLE_SHADING
#include "double.glsl"
#else
#include "single.glsl"
#endif
