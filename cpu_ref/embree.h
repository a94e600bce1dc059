// Embree 3.13 or 4 behind one face: RAII for its objects, and the query context that carries our own state through it.
#pragma once

#if TANDEM_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <memory>
#include <string>

namespace tandem::cpu::embree {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<RTCDeviceTy, Release>;
using Scene = std::unique_ptr<RTCSceneTy, Release>;
using Geometry = std::unique_ptr<RTCGeometryTy, Release>;

#if TANDEM_EMBREE_MAJOR >= 4
using Context = RTCRayQueryContext;
inline void initialise(Context& context) { rtcInitRayQueryContext(&context); }
inline RTCIntersectArguments intersect_arguments(Context& context) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    return arguments;
}
inline RTCOccludedArguments occluded_arguments(Context& context) {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context;
    return arguments;
}
#define TANDEM_EMBREE_INTERSECT(function, context, ...)                 \
    do {                                                                \
        RTCIntersectArguments arguments = intersect_arguments(context); \
        function(__VA_ARGS__, &arguments);                              \
    } while (false)
#define TANDEM_EMBREE_OCCLUDED(function, context, ...)                \
    do {                                                              \
        RTCOccludedArguments arguments = occluded_arguments(context); \
        function(__VA_ARGS__, &arguments);                            \
    } while (false)
inline void intersect(RTCScene scene, Context& context, RTCRayHit& ray) {
    TANDEM_EMBREE_INTERSECT(rtcIntersect1, context, scene, &ray);
}
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) {
    TANDEM_EMBREE_OCCLUDED(rtcOccluded1, context, scene, &ray);
}
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit4& rays) {
    TANDEM_EMBREE_INTERSECT(rtcIntersect4, context, valid, scene, &rays);
}
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit8& rays) {
    TANDEM_EMBREE_INTERSECT(rtcIntersect8, context, valid, scene, &rays);
}
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit16& rays) {
    TANDEM_EMBREE_INTERSECT(rtcIntersect16, context, valid, scene, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay4& rays) {
    TANDEM_EMBREE_OCCLUDED(rtcOccluded4, context, valid, scene, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay8& rays) {
    TANDEM_EMBREE_OCCLUDED(rtcOccluded8, context, valid, scene, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay16& rays) {
    TANDEM_EMBREE_OCCLUDED(rtcOccluded16, context, valid, scene, &rays);
}
#undef TANDEM_EMBREE_INTERSECT
#undef TANDEM_EMBREE_OCCLUDED
#else
using Context = RTCIntersectContext;
inline void initialise(Context& context) { rtcInitIntersectContext(&context); }
inline void intersect(RTCScene scene, Context& context, RTCRayHit& ray) { rtcIntersect1(scene, &context, &ray); }
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) { rtcOccluded1(scene, &context, &ray); }
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit4& rays) {
    rtcIntersect4(valid, scene, &context, &rays);
}
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit8& rays) {
    rtcIntersect8(valid, scene, &context, &rays);
}
inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, &context, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay4& rays) {
    rtcOccluded4(valid, scene, &context, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay8& rays) {
    rtcOccluded8(valid, scene, &context, &rays);
}
inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay16& rays) {
    rtcOccluded16(valid, scene, &context, &rays);
}
#endif

inline std::string version() { return "Embree " RTC_VERSION_STRING; }

}  // namespace tandem::cpu::embree
