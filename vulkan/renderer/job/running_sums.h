// Plain sums stay on the device from block to block. So the sums fetched after a block include all earlier blocks.
#pragma once

#include <limits>
#include <utility>

#include "common/render/estimate.h"

namespace tandem {

class RunningSums {
public:
    // Whether the sums on the device are those of all samples up to this one. They are used up: what comes adds to them
    // or begins anew.
    [[nodiscard]] bool take(std::uint64_t sample) { return std::exchange(reach_, nowhere) == sample; }
    // They now reach up to this sample.
    void reached(std::uint64_t sample) { reach_ = sample; }
    void forget() { reach_ = nowhere; }
    // Leaves in `plane` what the sums have grown by since the last call; if they began anew, all of them.
    void leave_growth(Estimate::Plane& plane, bool went_on) {
        Estimate::Plane now = plane;
        for (std::size_t i = 0; went_on && i < plane.size(); ++i) {
            plane[i].sum -= before_[i].sum;
            plane[i].sum_of_squares -= before_[i].sum_of_squares;
        }
        before_ = std::move(now);
    }

private:
    static constexpr std::uint64_t nowhere = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t reach_ = nowhere;
    Estimate::Plane before_;
};

}  // namespace tandem
