// Ways in which a renderer's copy of a scene goes wrong on its way to the device, as edits of the scene. A sound
// renderer of the edited scene draws the same samples as a faulty one of the scene itself.
#pragma once

#include <span>
#include <string_view>

#include "common/scene/scene.h"

namespace tandem {

struct DataFault {
    std::string_view words;  // "the k of conductors is their eta"
    // Whether it changed the scene.
    bool (*plant)(Scene& scene) = nullptr;
    // Else a wrong formula or loop does the same: it leaves a figure out, exchanges two, or ends one too early.
    bool of_data_alone = false;
};

// Those of data alone first.
[[nodiscard]] std::span<const DataFault> data_faults();

}  // namespace tandem
