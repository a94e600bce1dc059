// Intervals, and figures with an interval.
#pragma once

namespace tandem {

struct Interval {
    double low = 0.0, high = 0.0;
};

// A figure and the interval that holds it with 95 %.
struct Estimated {
    double value = 0.0, low = 0.0, high = 0.0;
};

// exp of a normal estimate: value times or over exp(log_half).
[[nodiscard]] Estimated times_or_over(double value, double log_half);

// Half the width of the logarithm's interval; infinite where the interval is not above 0.
[[nodiscard]] double log_half_of(const Estimated& positive);

}  // namespace tandem
