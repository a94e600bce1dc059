// Whether one side has wrong data of the scene: the other draws its paths from a scene that is wrong alike.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "common/validation/verify/data_faults.h"
#include "common/validation/verify/retraced_paths.h"

namespace tandem {

struct DataQuestion {
    const RetracedPaths& paths;
    const Scene& scene;       // as the paths'
    RenderSettings settings;  // as the paths'
    Renderer& reference;
    Renderer& candidate;
    std::function<bool()> in_time;  // asked before each fault
};

struct DataTrial {
    DataFault fault;
    VerifiedSide faulty = VerifiedSide::candidate;
    std::size_t parted = 0, left = 0;  // paths that part, and do so where the other side has the fault
};
// The first fault with which nine of ten paths that part do so no more. Empty: none, or too few paths part.
[[nodiscard]] std::optional<DataTrial> try_data_faults(const DataQuestion& question);

// "the reference draws the candidate's samples where motion is lost"
[[nodiscard]] std::string told(const DataTrial& trial);

}  // namespace tandem
