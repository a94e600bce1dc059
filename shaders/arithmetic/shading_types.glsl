// From here on float means the type in which light is computed: double in kernels of DOUBLE_SHADING.
#ifdef DOUBLE_SHADING
#include "arithmetic/double.glsl"
#else
#include "arithmetic/single.glsl"
#endif
