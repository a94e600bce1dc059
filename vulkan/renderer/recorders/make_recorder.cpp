#include "common/error.h"
#include "vulkan/renderer/recorders/fragment_recorder.h"
#include "vulkan/renderer/recorders/image_stages_recorder.h"
#include "vulkan/renderer/recorders/megakernel_recorder.h"
#include "vulkan/renderer/recorders/ray_tracing_recorder.h"
#include "vulkan/renderer/recorders/thesis_recorder.h"
#include "vulkan/renderer/recorders/wavefront_recorder.h"

namespace tandem {

void FrameRecorder::set_target(const FrameTarget&) {
    throw UnsupportedError("frames of this kernel shape end in sums of samples, not in an image; use the thesis's");
}

std::unique_ptr<FrameRecorder> make_recorder(const RecorderInput& input) {
    switch (input.patterns.tracer.kernel) {
        case KernelShape::stages:
            return std::make_unique<WavefrontRecorder>(input);
        case KernelShape::megakernel:
            return std::make_unique<MegakernelRecorder>(input);
        case KernelShape::image_stages:
            return std::make_unique<ImageStagesRecorder>(input);
        case KernelShape::fragment:
            return std::make_unique<FragmentRecorder>(input);
        case KernelShape::ray_tracing:
        case KernelShape::ray_tracing_triangles:
        case KernelShape::ray_query:
        case KernelShape::ray_query_triangles:
            return std::make_unique<RayTracingRecorder>(input);
        case KernelShape::thesis:
            return std::make_unique<ThesisRecorder>(input);
    }
    throw Error("no recorder for this kernel shape");
}

}  // namespace tandem
