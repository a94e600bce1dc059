#include "cpu_ref/path_tracer/film.h"

namespace tandem::cpu {

// What is added is split into two singles. The sum of the greater parts is exact with its rest [Knuth, The Art of
// Computer Programming 2, 4.2.2]. So only rests round, by less than 2^-46 of the sum.
void Film::Pair::add(double x) {
    const auto greater = static_cast<float>(x);
    const auto lesser = static_cast<float>(x - static_cast<double>(greater));
    const float sum = high + greater;
    const float of_greater = sum - high, of_high = sum - of_greater;
    const float lost = (high - of_high) + (greater - of_greater);
    const float small = lost + (rest + lesser);
    high = sum + small;
    rest = small - (high - sum);
}

// The square of a single is exact in double, so that it rounds once.
void Film::add_plainly(SingleMoments& moments, double x) {
    const auto single = static_cast<float>(x);
    const auto square = static_cast<float>(static_cast<double>(single) * static_cast<double>(single));
    moments.sum += single;
    moments.squares += square;
}

void Film::begin_block(bool goes_on) {
    switch (accumulation_) {
        case Accumulation::in_double:
            doubles_.assign(values_, {});
            return;
        case Accumulation::compensated:
            pairs_.assign(values_, {});
            return;
        case Accumulation::plain:
            if (!goes_on) singles_.assign(values_, {});
            before_ = singles_;
            return;
    }
}

Estimate::Plane Film::take_block() {
    if (accumulation_ == Accumulation::in_double) return std::move(doubles_);
    Estimate::Plane block(values_);
    const auto value = [](const Pair& pair) { return double{pair.high} + double{pair.rest}; };
    for (std::size_t i = 0; i < values_; ++i) {
        if (accumulation_ == Accumulation::compensated)
            block[i] = {value(pairs_[i].sum), value(pairs_[i].squares)};
        else  // a block's share of running sums, so that the shares add up to the sums themselves
            block[i] = {double{singles_[i].sum} - double{before_[i].sum},
                double{singles_[i].squares} - double{before_[i].squares}};
    }
    return block;
}

}  // namespace tandem::cpu
