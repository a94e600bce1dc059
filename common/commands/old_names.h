// Options that once had another name: the old one still works, and a note says the new one.
#pragma once

#include <string>
#include <vector>

namespace tandem {

struct RenamedArguments {
    std::vector<std::string> arguments;  // without the program's own name
    std::vector<std::string> notes;      // one for each old name that was used
};

[[nodiscard]] RenamedArguments with_new_names(int argc, char** argv);

}  // namespace tandem
