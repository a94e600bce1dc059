// An estimate that grows to any number of samples.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// Samples of every pixel from `first_sample` on, a multiple of samples_per_block. Samples that end within a block
// (MODEL.md section 11.2) count until it grows. A job that cannot go on from them renders them anew.
class GrowingEstimate {
public:
    explicit GrowingEstimate(std::uint64_t first_sample = 0) : first_sample_(first_sample) {}

    struct Growth {
        double seconds = 0.0;
        std::optional<double> device_seconds;
        bool complete = false;  // false: stopped

        void add_time(double more, const std::optional<double>& more_on_device) {
            seconds += more;
            if (more_on_device) device_seconds = device_seconds.value_or(0.0) + *more_on_device;
        }
    };
    // Goes on until there are `samples`, more than there are, or until a stop. `progress` tells samples that are added.
    // Samples that are not finite count again where they are rendered anew. `added` is told the whole blocks of this
    // call, if there are any.
    Growth grow_to(RenderJob& job, std::uint64_t samples, const RenderControl& control,
        const std::function<void(const Estimate&)>& added = {});

    [[nodiscard]] std::uint64_t count() const { return blocks_.count() + rest_.count(); }
    [[nodiscard]] bool ends_within_block() const { return rest_.count() > 0; }
    [[nodiscard]] const Estimate& blocks() const { return blocks_; }  // of no size before the first sample
    [[nodiscard]] const Estimate& rest() const { return rest_; }      // samples of a block that is not whole
    [[nodiscard]] FilmMoments film() const;
    [[nodiscard]] std::vector<Estimate::Piece> pieces() const;  // ascending, see Estimate::pieces()
    void add_to(Estimate::Plane& sums) const;                   // as Estimate::totals() adds

private:
    std::uint64_t first_sample_;
    Estimate blocks_, rest_;
};

}  // namespace tandem
