// --time of a command. It covers everything that the command does, from loading the scene on.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "common/commands/command.h"
#include "common/deadline.h"
#include "common/stopwatch.h"

namespace tandem {

class CommandTime {
public:
    // It begins now.
    CommandTime(const CommandContext& context, double seconds);

    // A stop request of the user, or as the time is over.
    [[nodiscard]] std::stop_token token() const { return deadline_.token(); }
    [[nodiscard]] double left() const { return seconds_ - watch_.seconds(); }
    // The time is over, and the user did not stop before.
    [[nodiscard]] bool over() const;

    // For work that was ended early: says on stderr what was not done, and gives the exit status.
    [[nodiscard]] ExitStatus too_short(const std::string& not_done) const;
    // Does the work. What it was stopped before (StoppedError) is said on stderr.
    [[nodiscard]] ExitStatus work(const std::function<ExitStatus()>& action) const;

    // Until done(), a stop that is not heeded, as by a driver that compiles, runs `conclude` on another thread. It
    // prints and writes what is known, and the program ends with its status.
    [[nodiscard]] std::unique_ptr<Unheeded> at_any_rate(std::function<ExitStatus()> conclude) const;

private:
    const CommandContext& context_;
    double seconds_;
    Stopwatch watch_;
    Deadline deadline_;
};

}  // namespace tandem
