// Several renderers as one. A job that becomes free takes the next block of samples of a render.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// A renderer of at least one. The bits are those of one of them alone where all are equal; else each block has the bits
// of whichever had it. One that fails, or tells of no progress for `patience` seconds, gets no more, nor does it take
// part in later jobs: `told` is called with the reason, and others do its blocks. After a stop there is what every one
// had done: that may leave gaps between blocks. Pixel lists and single paths are those of the first one that is left.
[[nodiscard]] std::unique_ptr<Renderer> device_group(std::vector<std::unique_ptr<Renderer>> members,
    std::function<void(const std::string&)> told, double patience = 60.0);

}  // namespace tandem
