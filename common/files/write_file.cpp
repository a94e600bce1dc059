#include "common/files/write_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <random>
#include <system_error>

#include "common/error.h"
#include "common/files/growing_file.h"

namespace tandem {

namespace {

// From errno.
InputError not_written(const std::filesystem::path& path) {
    return input_error(path.string(), "", fmt::format("cannot be written to its end ({})", std::strerror(errno)),
        "make room on its disk, or choose another folder");
}

// Refuses what rename() could not replace, or nobody wants replaced.
void check_replaceable(const std::filesystem::path& shown, const std::filesystem::path& target) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) {
        throw input_error(shown.string(), "", reason, mend);
    };
    struct statx facts {};
    if (::statx(AT_FDCWD, target.c_str(), 0, STATX_TYPE, &facts) != 0) {
        if (::access(shown.c_str(), F_OK) == 0)  // by a descriptor in /proc
            refuse("is open but has been removed from its folder", "name a file");
        return;  // not there, or told by what follows
    }
    if (S_ISDIR(facts.stx_mode)) refuse("is a folder", "name a file");
    if (!S_ISREG(facts.stx_mode)) refuse("is not a regular file", "name a regular file");
    if (::access(target.c_str(), W_OK) != 0 || (facts.stx_attributes & (STATX_ATTR_IMMUTABLE | STATX_ATTR_APPEND)) != 0)
        refuse("is read-only", "make it writable, or name another file");
    if ((facts.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0)
        refuse("is a mount of its own, which cannot be replaced", "name a file in a folder that is mounted");
}

}  // namespace

bool write_all(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
}

std::filesystem::path end_of_links(const std::filesystem::path& path) {
    std::filesystem::path end = path;
    std::error_code error;
    constexpr int most_links = 40;  // Linux's own limit (path_resolution(7))
    for (int links = 0; std::filesystem::is_symlink(end, error); ++links) {
        if (links == most_links)
            throw input_error(path.string(), "", "is a link that leads nowhere", "mend the link, or name another file");
        const std::filesystem::path next = std::filesystem::read_symlink(end, error);
        if (error) break;
        end = end.parent_path() / next;  // an absolute one takes the whole place
    }
    return end;
}

void FilesRead::add(const std::filesystem::path& path) {
    struct stat facts {};
    if (::stat(path.c_str(), &facts) == 0) files_.push_back({facts.st_dev, facts.st_ino, path.string()});
}

std::optional<std::string> FilesRead::name_of(const std::filesystem::path& path) const {
    struct stat facts {};
    if (files_.empty() || ::stat(path.c_str(), &facts) != 0) return std::nullopt;
    for (const File& file : files_)
        if (file.device == facts.st_dev && file.number == facts.st_ino) return file.name;
    return std::nullopt;
}

bool Descriptor::close() { return descriptor_ < 0 || ::close(std::exchange(descriptor_, -1)) == 0; }

namespace {

// An empty file beside `target`, which gets its name in `temporary`. Throws InputError where put_in_place() could not
// succeed.
Descriptor open_beside(
    const std::filesystem::path& shown, const std::filesystem::path& target, std::filesystem::path& temporary) {
    check_replaceable(shown, target);
    if (!target.has_filename()) throw input_error(shown.string(), "", "is no name of a file", "name a file");
    Descriptor file;
    std::random_device random;
    for (int attempt = 0;; ++attempt) {
        temporary = target.parent_path() / fmt::format(".tandem-{:08x}", random());
        file = Descriptor(::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666));
        if (file.get() >= 0) break;
        constexpr int attempts = 100;  // names already taken, by chance or by files left behind
        if (errno == EEXIST && attempt < attempts) continue;
        throw input_error(shown.string(), "", std::string("cannot be written (") + std::strerror(errno) + ")",
            errno == ENOENT ? "create the folder first" : "choose a folder that can be written");
    }
    // The name itself is tried by opening it, since there may be limits to it that the temporary one keeps.
    struct stat old {};
    if (::stat(target.c_str(), &old) == 0) {
        (void)::fchmod(file.get(), old.st_mode & 07777);  // as the file that it replaces
    } else if (errno != ENOENT) {
        const std::string reason = std::strerror(errno);
        (void)::unlink(temporary.c_str());
        throw input_error(shown.string(), "", "cannot be written (" + reason + ")", "choose another name");
    }
    return file;
}

void put_in_place(const std::filesystem::path& shown, const std::filesystem::path& target,
    const std::filesystem::path& temporary, Descriptor& file, const FilesRead& read) {
    // Space may run out, and a disk fail, as late as here: only then is the old content given up. Some file systems
    // have nothing to synchronise and say so.
    if (::fsync(file.get()) != 0 && errno != EINVAL && errno != ENOTSUP && errno != EROFS) throw not_written(shown);
    if (!file.close()) throw not_written(shown);
    // As late as can be: links may have been made while the command worked.
    if (const auto name = read.name_of(target))
        throw input_error(shown.string(), "", "has become a name of " + *name + ", which was read; it is left as it is",
            "name another output");
    std::error_code error;
    std::filesystem::rename(temporary, target, error);
    if (error)
        throw input_error(
            shown.string(), "", "cannot be replaced (" + error.message() + ")", "choose a folder that can be written");
}

void remove_left(const std::filesystem::path& temporary) {
    std::error_code ignored;  // once put in place there is nothing to remove
    std::filesystem::remove(temporary, ignored);
}

}  // namespace

ReplacementFile::ReplacementFile(const std::filesystem::path& target)
    : shown_(target), target_(end_of_links(target)), file_(open_beside(shown_, target_, temporary_)) {}

ReplacementFile::~ReplacementFile() { remove_left(temporary_); }

void ReplacementFile::commit(std::string_view bytes, const FilesRead& read) {
    if (!write_all(file_.get(), bytes)) throw not_written(shown_);
    put_in_place(shown_, target_, temporary_, file_, read);
}

GrowingFile::GrowingFile(const std::filesystem::path& target)
    : shown_(target), target_(end_of_links(target)), file_(open_beside(shown_, target_, temporary_)) {}

GrowingFile::~GrowingFile() { remove_left(temporary_); }

void GrowingFile::commit(const FilesRead& read) { put_in_place(shown_, target_, temporary_, file_, read); }

namespace {

// Another process may remove a folder that it had made, after it was seen here and before it is used.
constexpr int attempts = 100;

// Makes what is missing of `folder` and those above it, the innermost first in `made`.
std::error_code make_folders(const std::filesystem::path& folder, std::vector<std::filesystem::path>& made) {
    std::error_code error;
    std::vector<std::filesystem::path> missing;
    for (std::filesystem::path at = folder; !at.empty() && !std::filesystem::exists(at, error); at = at.parent_path())
        if (at.has_filename()) missing.push_back(at);  // "a/" and "a" are one folder
    for (auto at = missing.rbegin(); at != missing.rend(); ++at) {
        const bool own = std::filesystem::create_directory(*at, error);
        if (error) return error;
        if (own) made.insert(made.begin(), *at);
    }
    if (std::filesystem::is_directory(folder, error)) return {};
    return std::make_error_code(
        std::filesystem::exists(folder, error) ? std::errc::not_a_directory : std::errc::no_such_file_or_directory);
}

}  // namespace

FolderToFill::FolderToFill(const std::filesystem::path& folder) : folder_(folder) {
    std::error_code error;
    for (int attempt = 1; attempt <= attempts; ++attempt) {
        error = make_folders(folder, made_);
        if (error != std::errc::no_such_file_or_directory && error != std::errc::file_exists &&
            error != std::errc::not_a_directory)
            break;
    }
    if (!error) return;
    std::error_code ignored;
    for (const std::filesystem::path& made : made_) std::filesystem::remove(made, ignored);
    const bool file = error == std::errc::not_a_directory && std::filesystem::exists(folder, ignored);
    throw input_error(folder.string(), "", "cannot be made: " + (file ? "a file is in its place" : error.message()),
        "choose another folder");
}

FolderToFill::~FolderToFill() {
    std::error_code ignored;
    if (!made_.empty())
        for (const std::filesystem::path& file : files_) std::filesystem::remove(file, ignored);
    for (const std::filesystem::path& made : made_) std::filesystem::remove(made, ignored);
}

std::filesystem::path FolderToFill::file(const std::string& name) { return files_.emplace_back(folder_ / name); }

bool is_stream(const std::filesystem::path& path) {
    std::error_code error;
    const auto type = std::filesystem::status(path, error).type();
    return type == std::filesystem::file_type::fifo || type == std::filesystem::file_type::character;
}

void check_writable_text(const std::filesystem::path& path) {
    if (!is_stream(path)) {
        const ReplacementFile probe(path);
        return;
    }
    struct stat facts {};
    const bool there = ::stat(path.c_str(), &facts) == 0;
    if (there && S_ISCHR(facts.st_mode) && facts.st_rdev == makedev(1, 7))  // Linux's number of it
        throw input_error(path.string(), "", "is always full", "name another file");
    if (::access(path.c_str(), W_OK) != 0)
        throw input_error(path.string(), "", std::string("cannot be written (") + std::strerror(errno) + ")",
            "check its permissions");
}

void check_writable_folder(const std::filesystem::path& folder, const std::vector<std::string>& files) {
    for (int attempt = 1;; ++attempt) try {
            const FolderToFill made(folder);
            for (const std::string& file : files) const ReplacementFile probe(folder / file);
            return;
        } catch (const InputError&) {
            if (attempt == attempts) throw;
        }
}

void write_text_file(const std::filesystem::path& path, std::string_view text, const FilesRead& read) {
    if (!is_stream(path)) return ReplacementFile(path).commit(text, read);
    Descriptor stream(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (stream.get() < 0 || !write_all(stream.get(), text) || !stream.close()) throw not_written(path);
}

}  // namespace tandem
