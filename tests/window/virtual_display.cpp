#include "tests/window/virtual_display.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>

namespace tandem::testing {

VirtualDisplay::VirtualDisplay() {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) return;
    const std::string written = std::to_string(ends[1]);
    process_ = ::fork();
    if (process_ == 0) {
        const int nothing = ::open("/dev/null", O_WRONLY);
        ::dup2(nothing, STDERR_FILENO);
        // -noreset: a server starts anew when its last client leaves, and refuses a window that comes meanwhile.
        ::execlp("Xvfb", "Xvfb", "-displayfd", written.c_str(), "-noreset", "-screen", "0", "800x600x24", nullptr);
        ::_exit(127);
    }
    ::close(ends[1]);
    std::string number;  // of the display that was free, and a line's end
    for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
    ::close(ends[0]);
    there_ = !number.empty();
    if (!there_) return;
    if (const char* before = std::getenv("DISPLAY")) before_ = before;
    ::setenv("DISPLAY", (":" + number).c_str(), 1);
}

VirtualDisplay::~VirtualDisplay() {
    if (there_ && before_) ::setenv("DISPLAY", before_->c_str(), 1);
    if (there_ && !before_) ::unsetenv("DISPLAY");
    if (process_ <= 0) return;
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
}

}  // namespace tandem::testing
