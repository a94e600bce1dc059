#include "common/files/read_file.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>
#include <vector>

#include "common/error.h"

namespace tandem {

std::string read_file(const std::filesystem::path& path, std::size_t limit, const NamedBy& place) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) -> InputError {
        return input_error(place.file, place.pointer, place.shown.empty() ? reason : place.shown + ": " + reason, mend);
    };
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found) throw refuse("no such file", "check the path");
    if (error) throw refuse("cannot be reached (" + error.message() + ")", "check the path and its permissions");
    if (status.type() == std::filesystem::file_type::directory) throw refuse("is a folder", "name a file");
    if (status.type() != std::filesystem::file_type::regular)
        throw refuse("is not a regular file", "name a regular file");
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw refuse("cannot be opened", "check its permissions");
    std::string text;
    std::vector<char> chunk(std::size_t{1} << 16);
    while (stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size())), stream.gcount() > 0) {
        text.append(chunk.data(), static_cast<std::size_t>(stream.gcount()));
        if (text.size() > limit)
            throw refuse(fmt::format("is larger than {} MiB", limit >> 20), "split it or simplify it");
    }
    if (stream.bad()) throw refuse("cannot be read to its end", "check the disk");
    return text;
}

std::string read_file(const std::filesystem::path& path, std::size_t limit) {
    return read_file(path, limit, {path.string(), "", ""});
}

}  // namespace tandem
