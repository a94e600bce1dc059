// Modules: parts of the program in separate shared libraries, loaded at first use. So a start that does not need them
// does not wait for the libraries that they use.
#pragma once

#include <string>

namespace tandem {

struct LoadedModule {
    void* entry = nullptr;  // the function asked for
    std::string reason;     // why there is none
};

// Loads `file`, which lies in the program's folder or, where it is installed, in ../lib/tandem or above it, and finds
// the function `entry`. `shared`: what the module loads in turn finds its names among the program's. Never unloaded.
[[nodiscard]] LoadedModule load_module(const char* file, const char* entry, bool shared = false);

}  // namespace tandem
