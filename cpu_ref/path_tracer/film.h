// The sums of a film's values over a block of samples, kept as Accumulation says (MODEL.md section 11).
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/render/estimate.h"
#include "common/render/renderer.h"

namespace tandem::cpu {

class Film {
public:
    // `values`: pixels times channels.
    Film(Accumulation accumulation, std::size_t values) : accumulation_(accumulation), values_(values) {}

    // Before a block: of so many values.
    void resize(std::size_t values) { values_ = values; }
    // The sums of a block are zero; plain ones may go on from the block before.
    void begin_block(bool goes_on);
    // Or they go on from those of its first samples, as take_block() left them: in double alone, where they are exact.
    void go_on(Estimate::Plane begun) { doubles_ = std::move(begun); }
    // Adds one sample's x >= 0 to value i; different values may be added to by different threads.
    void add(std::size_t i, double x) {
        switch (accumulation_) {
            case Accumulation::in_double:
                doubles_[i].sum += x;
                doubles_[i].sum_of_squares += x * x;
                return;
            case Accumulation::compensated:
                pairs_[i].sum.add(x);
                pairs_[i].squares.add(x * x);
                return;
            case Accumulation::plain:
                add_plainly(singles_[i], x);
                return;
        }
    }
    // What the block has brought; begin_block comes next.
    [[nodiscard]] Estimate::Plane take_block();

private:
    // An unevaluated sum of two singles.
    struct Pair {
        float high = 0.0F, rest = 0.0F;
        void add(double x);
    };
    struct PairMoments {
        Pair sum, squares;
    };
    struct SingleMoments {
        float sum = 0.0F, squares = 0.0F;
    };
    static void add_plainly(SingleMoments& moments, double x);

    Accumulation accumulation_;
    std::size_t values_;
    Estimate::Plane doubles_;
    std::vector<PairMoments> pairs_;
    std::vector<SingleMoments> singles_, before_;  // plain: now, and when the block began
};

}  // namespace tandem::cpu
