// A process of another program, in a process group of its own that ends with this object.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tandem {

class Child {
public:
    // Starts `words`, the first being found by PATH. What it writes goes to the file `log`; its standard input is
    // empty. One that `talks` has pipes for standard input and output instead. Throws Error where it cannot be started.
    Child(const std::vector<std::string>& words, const std::filesystem::path& log, bool talks);
    ~Child();  // kills the group
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    // Waits so long at most. Whether it has ended.
    [[nodiscard]] bool ended_within(double seconds);
    [[nodiscard]] bool succeeded() const { return status_ == 0; }
    // Its exit status, or 128 and the signal that ended it, as shells count; it must have ended.
    [[nodiscard]] int exit_status() const;
    // "ended with status 3", "was ended by signal 11 (Segmentation fault)"; it must have ended.
    [[nodiscard]] std::string how_it_ended() const;

    // Whether the line could be written.
    [[nodiscard]] bool send(std::string line);
    // A line that it wrote, within so many seconds; nothing: none yet, or, see `closed`, none will come.
    [[nodiscard]] std::optional<std::string> line_within(double seconds);
    [[nodiscard]] bool closed() const { return output_ < 0; }
    // Closes its input, which asks a program that stays up to end.
    void close_input();

private:
    void kill_group() const;

    pid_t pid_ = -1;
    int input_ = -1, output_ = -1;
    std::optional<int> status_;  // of waitpid
    std::string received_;
};

}  // namespace tandem
