#include "common/statistics/interval.h"

#include <cmath>
#include <limits>

namespace tandem {

Estimated times_or_over(double value, double log_half) {
    return {value, value * std::exp(-log_half), value * std::exp(log_half)};
}

double log_half_of(const Estimated& positive) {
    if (!(positive.low > 0.0)) return std::numeric_limits<double>::infinity();
    return 0.5 * std::log(positive.high / positive.low);
}

}  // namespace tandem
