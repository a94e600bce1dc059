// One interface to Embree 3.13 and 4: RAII for its objects, and the query context that carries our own state through
// it.
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
inline void intersect(RTCScene scene, Context& context, RTCRayHit& ray) {
    RTCIntersectArguments arguments = intersect_arguments(context);
    rtcIntersect1(scene, &ray, &arguments);
}
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) {
    RTCOccludedArguments arguments = occluded_arguments(context);
    rtcOccluded1(scene, &ray, &arguments);
}
#define TANDEM_EMBREE_PACKETS(width)                                                                    \
    inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit##width& rays) { \
        RTCIntersectArguments arguments = intersect_arguments(context);                                 \
        rtcIntersect##width(valid, scene, &rays, &arguments);                                           \
    }                                                                                                   \
    inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay##width& rays) {     \
        RTCOccludedArguments arguments = occluded_arguments(context);                                   \
        rtcOccluded##width(valid, scene, &rays, &arguments);                                            \
    }
#else
using Context = RTCIntersectContext;
inline void initialise(Context& context) { rtcInitIntersectContext(&context); }
inline void intersect(RTCScene scene, Context& context, RTCRayHit& ray) { rtcIntersect1(scene, &context, &ray); }
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) { rtcOccluded1(scene, &context, &ray); }
#define TANDEM_EMBREE_PACKETS(width)                                                                    \
    inline void intersect(RTCScene scene, Context& context, const int* valid, RTCRayHit##width& rays) { \
        rtcIntersect##width(valid, scene, &context, &rays);                                             \
    }                                                                                                   \
    inline void occluded(RTCScene scene, Context& context, const int* valid, RTCRay##width& rays) {     \
        rtcOccluded##width(valid, scene, &context, &rays);                                              \
    }
#endif
TANDEM_EMBREE_PACKETS(4)
TANDEM_EMBREE_PACKETS(8)
TANDEM_EMBREE_PACKETS(16)
#undef TANDEM_EMBREE_PACKETS

inline std::string version() { return "Embree " RTC_VERSION_STRING; }

}  // namespace tandem::cpu::embree
