#include "vulkan/renderer/recorders/megakernel_recorder.h"

#include <algorithm>

#include "common/error.h"

namespace tandem {

namespace {

// So many invocations share out the places of a dispatch. Neighbours in a subgroup soon have pixels far apart.
// Otherwise their camera rays go down trees together. So trees take up to 12 % longer on an H200, loops 8 % less.
std::uint32_t claimants_of(const RecorderInput& input) {
    const TracerTuning& tuning = input.patterns.tracer;
    const Specialisation& kernel = input.specialisation;
    const std::uint32_t held =
        tuning.claimants > 0 ? tuning.claimants : input.device.description().abilities.resident_invocations;
    if (tuning.pixels == PixelPattern::claimed && held == 0)
        throw UnsupportedError("the driver does not tell how many invocations the device holds at once");
    const bool has_trees = kernel.triangle_root || kernel.sphere_root || kernel.cuboid_root;
    const bool claimed =
        tuning.pixels == PixelPattern::claimed || (tuning.pixels == PixelPattern::automatic && held > 0 && !has_trees);
    return claimed ? std::max(1u, held / kernel.workgroup) * kernel.workgroup : 0;
}

}  // namespace

MegakernelRecorder::MegakernelRecorder(const RecorderInput& input)
    : WholePathRecorder(input, Stage::megakernel), claimants_(claimants_of(input)) {}

void MegakernelRecorder::record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    const std::uint32_t places = dispatch.settings.invocations;
    kernels().dispatch(commands, dispatch, claimants_ > 0 ? std::min(places, claimants_) : places);
}

}  // namespace tandem
