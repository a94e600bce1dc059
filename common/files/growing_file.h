// A file that is too large for memory. It is written under a temporary name, and appears complete or not at all.
#pragma once

#include <filesystem>

#include "common/files/write_file.h"

namespace tandem {

// As ReplacementFile, but written to bit by bit.
class GrowingFile {
public:
    // Throws InputError, as ReplacementFile does.
    explicit GrowingFile(const std::filesystem::path& target);
    ~GrowingFile();
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;

    // To write to.
    [[nodiscard]] int descriptor() const { return file_.get(); }
    // What was written gets the target's name. Throws InputError.
    void commit(const FilesRead& read = {});

private:
    std::filesystem::path shown_, target_, temporary_;
    Descriptor file_;
};

}  // namespace tandem
