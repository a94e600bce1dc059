#include "common/files/load_module.h"

#include <dlfcn.h>

#include <filesystem>
#include <system_error>

namespace tandem {

namespace {

// Beside the program as it is built; bin/tandem or lib/tandem/LEVEL/tandem where it is installed.
std::filesystem::path place_of(const char* file) {
    std::error_code error;
    const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    for (const char* const installed : {"../lib/tandem", ".."})
        if (!std::filesystem::exists(folder / file, error) && std::filesystem::exists(folder / installed / file, error))
            return folder / installed / file;
    return folder / file;
}

}  // namespace

LoadedModule load_module(const char* file, const char* entry, bool shared) {
    const std::filesystem::path place = place_of(file);
    void* const library = ::dlopen(place.c_str(), RTLD_NOW | (shared ? RTLD_GLOBAL : RTLD_LOCAL));
    if (library == nullptr) return {nullptr, ::dlerror()};
    void* const found = ::dlsym(library, entry);
    return {found, found != nullptr ? "" : place.string() + " is no module of this program"};
}

}  // namespace tandem
