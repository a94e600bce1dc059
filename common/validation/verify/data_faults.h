// Ways in which a renderer's copy of a scene goes wrong on its way to the device, as edits of the scene. A sound
// renderer of the edited scene draws the same samples as a faulty one of the scene itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

struct DataFault {
    std::string words;                    // "the k of conductors is their eta"
    std::function<bool(Scene&)> plant{};  // whether it changed the scene
    // Else a wrong formula or loop does the same: it leaves a figure out, exchanges two, or ends one too early.
    bool of_data_alone = false;
};

// Those of data alone first. Each leaves out, exchanges or moves entries of a table, for all or for one kind of entry.
[[nodiscard]] std::vector<DataFault> data_faults();

}  // namespace tandem
