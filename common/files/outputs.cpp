#include "common/files/outputs.h"

#include <sys/stat.h>

#include <optional>
#include <tuple>

#include "common/error.h"
#include "common/files/write_file.h"

namespace tandem {

namespace {

// A file is its device and number; one that is not there yet is a name in the nearest folder above that is.
struct Identity {
    dev_t device;
    ino_t number;
    std::filesystem::path rest;
    bool operator==(const Identity&) const = default;
};

std::optional<Identity> identity_of(const std::filesystem::path& path) {
    struct stat facts {};
    if (::stat(path.c_str(), &facts) == 0) {
        if (!S_ISREG(facts.st_mode)) return std::nullopt;  // writers of a pipe or a terminal overwrite nothing
        return Identity{facts.st_dev, facts.st_ino, {}};
    }
    std::error_code error;
    std::filesystem::path above = std::filesystem::weakly_canonical(end_of_links(path), error), rest;
    if (error) return std::nullopt;
    while (above.has_relative_path() && ::stat(above.c_str(), &facts) != 0) {
        rest = rest.empty() ? above.filename() : above.filename() / rest;
        above = above.parent_path();
    }
    if (::stat(above.empty() ? "." : above.c_str(), &facts) != 0) return std::nullopt;
    return Identity{facts.st_dev, facts.st_ino, rest};
}

struct NamedFile {
    std::filesystem::path path;
    std::optional<Identity> identity;
};

// The path itself, and the files that a folder gets.
std::vector<NamedFile> files_of(const Output& output) {
    std::vector<NamedFile> files{{output.path, identity_of(output.path)}};
    if (output.kind != OutputKind::folder) return files;
    for (const std::string& name : output.files) files.push_back({output.path / name, identity_of(output.path / name)});
    return files;
}

void check_writable(const Output& output) {
    if (output.kind == OutputKind::open) return;
    if (output.path == "-")  // as --json alone has it
        throw InputError(output.option + " -: standard output is for --json alone; write ./- for a file of that name");
    if (output.kind == OutputKind::folder) return check_writable_folder(output.path, output.files);
    if (output.kind == OutputKind::text) return check_writable_text(output.path);
    const ReplacementFile probe(output.path);
}

}  // namespace

void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs) {
    std::vector<std::pair<std::string, NamedFile>> earlier;  // with the option
    for (const Output& output : outputs) {
        if (output.path.empty()) continue;
        for (const NamedFile& file : files_of(output)) {
            if (!file.identity) continue;
            for (const std::string& input : inputs)
                if (identity_of(input) == file.identity)
                    throw input_error(output.kind == OutputKind::open ? output.option : file.path.string(), "",
                        "would overwrite " + input + ", which is read", "name another output");
            for (const auto& [option, other] : earlier)
                if (other.identity == file.identity && output.kind != OutputKind::open)
                    throw input_error(file.path.string(), "",
                        "is named for two outputs, " + option + " and " + output.option,
                        "name another file for one of them");
            earlier.emplace_back(output.option, file);
        }
        check_writable(output);
    }
}

}  // namespace tandem
