#include "vulkan/core/driver_remedy.h"

#include <cstdlib>

namespace tandem {

std::string driver_remedy() {
    std::string named;
    for (const std::string variable : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"})
        if (const char* value = std::getenv(variable.c_str())) named += ", or correct " + variable + " (" + value + ")";
    if (named.empty()) named = ", or name a driver's .json file in VK_DRIVER_FILES";
    return "install a driver (Debian: mesa-vulkan-drivers, whose lavapipe runs on any CPU)" + named;
}

}  // namespace tandem
