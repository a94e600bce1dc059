// Writes files and folders that appear complete or not at all, for every room.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tandem {

// An open file, closed at the end of its life; -1: none.
class Descriptor {
public:
    explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(descriptor_, other.descriptor_);
        return *this;
    }
    ~Descriptor() { (void)close(); }

    [[nodiscard]] int get() const { return descriptor_; }
    // As ::close tells it: false, and errno, where what was written did not reach the file.
    [[nodiscard]] bool close();

private:
    int descriptor_;
};

// The files that a command has read, by what they are, whatever their names become. None of them is to be replaced.
class FilesRead {
public:
    void add(const std::filesystem::path& path);
    // The name by which the file that `path` leads to was read; nothing where it was not.
    [[nodiscard]] std::optional<std::string> name_of(const std::filesystem::path& path) const;

private:
    struct File {
        std::uint64_t device, number;
        std::string name;
    };
    std::vector<File> files_;
};

// An empty file beside `target`, which takes its place on commit() and vanishes otherwise. A link is followed: what it
// points to is replaced.
class ReplacementFile {
public:
    // Throws InputError where commit() could not succeed. The folder is not there or not writable, or the target is a
    // folder, a device, read-only or bound to its place.
    explicit ReplacementFile(const std::filesystem::path& target);
    ~ReplacementFile();
    ReplacementFile(const ReplacementFile&) = delete;
    ReplacementFile& operator=(const ReplacementFile&) = delete;

    // Writes `bytes` to the disk and gives them the target's name. Throws InputError, also where that name has become
    // one of a file of `read`, and then the target is as it was.
    void commit(std::string_view bytes, const FilesRead& read = {});

private:
    std::filesystem::path shown_, target_, temporary_;
    Descriptor file_;
};

// A folder to fill, made with those above it where they are not there. What was made goes again, unless keep() is
// called; a folder that was there stays as it is.
class FolderToFill {
public:
    // Throws InputError where it cannot be made.
    explicit FolderToFill(const std::filesystem::path& folder);
    ~FolderToFill();
    FolderToFill(const FolderToFill&) = delete;
    FolderToFill& operator=(const FolderToFill&) = delete;

    // The path of a file in it, which is about to be written.
    [[nodiscard]] std::filesystem::path file(const std::string& name);
    void keep() { made_.clear(); }

private:
    std::filesystem::path folder_;
    std::vector<std::filesystem::path> made_;   // innermost first
    std::vector<std::filesystem::path> files_;  // in a folder that was made
};

// The file that a name leads to by links, also where it is not there yet. Throws InputError for links in a circle.
[[nodiscard]] std::filesystem::path end_of_links(const std::filesystem::path& path);

// Pipes, terminals and other devices have no old content to keep, and cannot be replaced.
[[nodiscard]] bool is_stream(const std::filesystem::path& path);

// Throws InputError unless a file of any ending could be made at `path`, for write_text_file. Pipes and devices pass,
// but not /dev/full.
void check_writable_text(const std::filesystem::path& path);

// Throws InputError unless the folder, if need be made, takes files of these names. Leaves nothing behind.
void check_writable_folder(const std::filesystem::path& folder, const std::vector<std::string>& files = {"probe"});

// Writes text whole or not at all. Throws InputError, also where `path` leads to a file of `read`.
void write_text_file(const std::filesystem::path& path, std::string_view text, const FilesRead& read = {});

// Writes all of it to an open file; false, and errno, where that fails.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes);

}  // namespace tandem
