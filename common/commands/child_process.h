// The program once more, in a process of its own, and files to hear from it.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

namespace tandem {

// Runs this program with `words` as arguments, its standard output dropped, and waits. Its error output goes to the
// file `errors`, or to this program's where that is empty. Returns its exit status; 128 and more: it was ended by a
// signal, as it is when `stop` is requested. Throws Error where it cannot be started.
[[nodiscard]] int run_self(
    const std::vector<std::string>& words, const std::string& errors = "", const std::stop_token& stop = {});

// An empty file with a name of its own, removed with the object.
class TemporaryFile {
public:
    TemporaryFile();
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    [[nodiscard]] const std::string& name() const { return name_; }

private:
    std::string name_;
};

}  // namespace tandem
