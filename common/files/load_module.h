// Modules: parts of the program in shared libraries of their own, loaded when they are first asked for. Other starts
// need not wait for the libraries behind them.
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
