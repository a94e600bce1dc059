#include "common/files/read_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "common/error.h"
#include "common/files/write_file.h"

namespace tandem {

std::string read_file(const std::filesystem::path& path, std::size_t limit, const NamedBy& place) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) -> InputError {
        return input_error(place.file, place.pointer, place.shown.empty() ? reason : place.shown + ": " + reason, mend);
    };
    const auto check_kind = [&](const struct stat& facts) {
        if (S_ISDIR(facts.st_mode)) throw refuse("is a folder", "name a file");
        if (!S_ISREG(facts.st_mode)) throw refuse("is not a regular file", "name a regular file");
    };
    struct stat facts {};
    if (::stat(path.c_str(), &facts) == 0) check_kind(facts);  // before a device is opened, which may set it going
    // Without O_NONBLOCK some files of /proc, and a pipe that has taken the name since, would be waited for.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    if (file.get() < 0 && errno == ENOENT) throw refuse("no such file", "check the path");
    if (file.get() < 0 || ::fstat(file.get(), &facts) != 0)
        throw refuse(fmt::format("cannot be opened ({})", std::strerror(errno)), "check the path and its permissions");
    check_kind(facts);
    std::string text;
    std::vector<char> chunk(std::size_t{1} << 16);
    for (;;) {
        const ssize_t count = ::read(file.get(), chunk.data(), chunk.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0)
            throw refuse(fmt::format("cannot be read to its end ({})", std::strerror(errno)), "name another file");
        if (count == 0) break;
        text.append(chunk.data(), static_cast<std::size_t>(count));
        if (text.size() > limit)
            throw refuse(fmt::format("is larger than {} MiB", limit >> 20), "split it or simplify it");
    }
    return text;
}

std::string read_file(const std::filesystem::path& path, std::size_t limit) {
    return read_file(path, limit, {path.string(), "", ""});
}

}  // namespace tandem
