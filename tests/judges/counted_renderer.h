// A CPU renderer that counts what it renders, and that lives beside one with another planted bug.
#pragma once

#include <memory>

#include "common/render/path_trace.h"
#include "common/render/renderer.h"

namespace tandem::test {

// Samples, whatever their film and bounces.
struct RenderedSamples {
    std::uint64_t count = 0;
};

// The CPU path tracer with the bug. Bugs in code belong to the whole process, so each call sets this one's before it
// renders. Two such renderers may be asked in turn, never at once. They trace no single paths, as nobody asks why two
// differ. `rendered` must outlive the renderer.
[[nodiscard]] std::unique_ptr<Renderer> counted_renderer(
    const PlantedFault& fault, Precision precision, RenderedSamples& rendered);

}  // namespace tandem::test
