// Checks the files that a command will write, before it works: against the files that it reads, and against each other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem {

enum class OutputKind { text, image, folder, open };  // open: a stream that is written already

struct Output {
    std::string option;          // "--json"
    std::filesystem::path path;  // empty: not asked for
    OutputKind kind = OutputKind::text;
    std::vector<std::string> files = {"probe"};  // that it gets, if it is a folder
};

// Throws InputError where an output cannot be written. It also does where one is a file of `inputs` or of another
// output, by whatever name, link or mount. Pipes, terminals and /dev/null may be named twice. Leaves nothing behind.
void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs);

}  // namespace tandem
