#include "common/commands/command_time.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <utility>

#include "common/text.h"

namespace tandem {

CommandTime::CommandTime(const CommandContext& context, double seconds)
    : context_(context), seconds_(seconds), deadline_(context.stop, seconds) {}

bool CommandTime::over() const { return deadline_.passed() && !context_.stop.stop_requested(); }

ExitStatus CommandTime::too_short(const std::string& not_done) const {
    fmt::print(stderr, "tandem: {}: {}\n",
        context_.stop.stop_requested() ? std::string("stopped") : fmt::format("--time: {:g} s are too short", seconds_),
        escaped(not_done));
    return ExitStatus::undecided;
}

ExitStatus CommandTime::work(const std::function<ExitStatus()>& action) const {
    try {
        return action();
    } catch (const StoppedError& error) {
        return too_short(error.what());
    }
}

std::unique_ptr<Unheeded> CommandTime::at_any_rate(std::function<ExitStatus()> conclude) const {
    // Both leave time to write the results: a stop is to end within 2 s, the time within 10 % and 1 s.
    constexpr double after_request = 1.5;
    const auto grace = [this] { return over() ? 0.05 * seconds_ + 0.3 : after_request; };
    return std::make_unique<Unheeded>(token(), grace, [conclude = std::move(conclude)] {
        auto status = static_cast<int>(ExitStatus::unusable_input);
        try {
            status = static_cast<int>(conclude());
        } catch (const std::exception& error) {
            fmt::print(stderr, "tandem: {}\n", escaped(error.what()));
        }
        std::fflush(stdout);
        _exit(status);  // the threads at work would not end
    });
}

}  // namespace tandem
