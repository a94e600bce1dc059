// Runs this program again in a separate process, and reads its results from files.
#pragma once

#include <string>
#include <vector>

namespace tandem {

// Runs this program with `words` as arguments, its standard output dropped, and waits. Returns its exit status; 128 and
// more: it was ended by a signal. Throws Error where it cannot be started.
[[nodiscard]] int run_self(const std::vector<std::string>& words);

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
