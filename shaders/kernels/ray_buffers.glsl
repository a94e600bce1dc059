// The blocks of the Rays set whose two halves take turns: a stage declares those that it reads and those that it writes.
// As arrays (a pattern of vulkan/patterns.h) both halves stand in one set, and an index takes the place of another set.
#ifndef RAY_BUFFERS_GLSL
#define RAY_BUFFERS_GLSL

#if defined(RAY_ARRAYS) || defined(RAY_ARRAYS_NONUNIFORM)
#ifdef RAY_ARRAYS_NONUNIFORM
#extension GL_EXT_nonuniform_qualifier : require
#define RAY_HALF(parity) nonuniformEXT(parity)
#else
#define RAY_HALF(parity) (parity)
#endif
// Both views of a buffer share a binding: that of the half that is read where halves have a binding each.
#define READ_HALF(at, block, type, array) layout(std430, set = 2, binding = at) readonly buffer block { type data[]; } block##Halves[2]
#define WRITTEN_HALF(at, block, type, array) layout(std430, set = 2, binding = (at == 15 ? 14 : at - 5)) writeonly buffer block { type data[]; } block##Halves[2]
#define origins_in OriginsInHalves[RAY_HALF(RAY_PARITY)].data
#define directions_in DirectionsInHalves[RAY_HALF(RAY_PARITY)].data
#define throughputs_in ThroughputsInHalves[RAY_HALF(RAY_PARITY)].data
#define radiances_in RadiancesInHalves[RAY_HALF(RAY_PARITY)].data
#define contributions_in ContributionsInHalves[RAY_HALF(RAY_PARITY)].data
#define interiors_in InteriorsInHalves[RAY_HALF(RAY_PARITY)].data
#define origins_out OriginsOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#define directions_out DirectionsOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#define throughputs_out ThroughputsOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#define radiances_out RadiancesOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#define contributions_out ContributionsOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#define interiors_out InteriorsOutHalves[RAY_HALF(1u - RAY_PARITY)].data
#else
#define READ_HALF(at, block, type, array) layout(std430, set = 2, binding = at) readonly restrict buffer block { type array[]; }
#define WRITTEN_HALF(at, block, type, array) layout(std430, set = 2, binding = at) writeonly restrict buffer block { type array[]; }
#endif

#endif
