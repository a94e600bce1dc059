#include "common/error.h"

namespace tandem {

InputError input_error(
    const std::string& file, const std::string& json_pointer, const std::string& reason, const std::string& mend) {
    std::string line = file;
    if (!json_pointer.empty()) line += ": " + json_pointer;
    line += ": " + reason;
    if (!mend.empty()) line += "; " + mend;
    return InputError(line);
}

}  // namespace tandem
