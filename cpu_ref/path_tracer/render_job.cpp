#include "cpu_ref/path_tracer/render_job.h"

#include "cpu_ref/path_tracer/variants.h"

namespace tandem::cpu {

namespace {

template <std::uint64_t effects>
std::unique_ptr<RenderJob> make_in(Precision precision, const JobParts& parts) {
    if (precision == Precision::single_precision) return make_embree_job<float, effects>(parts);
    return make_embree_job<double, effects>(parts);
}

}  // namespace

std::unique_ptr<RenderJob> make_render_job(const JobParts& parts, Precision precision) {
    // Mixed precision has the general variant alone, which simulates every set.
    if (precision == Precision::mixed) return make_embree_job<double, variants::general.bits(), float>(parts);
    const EffectSet simulated = parts.settings.effects.value_or(variants::general);
    // Light trees are in the general variant alone.
    if (parts.settings.light_sampling == LightSampling::tree)
        return make_in<variants::general.bits()>(precision, parts);
    if (variants::lean_path.covers(simulated)) return make_in<variants::lean_path.bits()>(precision, parts);
    if (variants::lean_next_event.covers(simulated)) return make_in<variants::lean_next_event.bits()>(precision, parts);
    return make_in<variants::general.bits()>(precision, parts);
}

}  // namespace tandem::cpu
