// What the statistics must know about a job of another program, beside its estimates.
#pragma once

namespace tandem {

class ForeignJob {
public:
    virtual ~ForeignJob() = default;
    // How many independent values the variance in the estimate of one render() rests on, where the program does not
    // tell the variance of its samples. It is one less than the images drawn for it. 0: it tells.
    [[nodiscard]] virtual double values_a_call() const = 0;
};

}  // namespace tandem
