#include "common/commands/shipped_files.h"

#include <filesystem>
#include <vector>

#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

namespace fs = std::filesystem;

// The folder that holds scenes/; empty: the program stands alone.
fs::path shipped_root() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    if (error) return {};
    // build/release/tandem; PREFIX/bin/tandem; PREFIX/lib/tandem/LEVEL/tandem.
    for (const char* root : {"../..", "../share/tandem", "../../../share/tandem"}) {
        const fs::path found = (folder / root).lexically_normal();
        // A file of ours: another scenes/ may lie there.
        if (fs::is_regular_file(found / "scenes" / "format" / "scene.schema.json", error)) return found;
    }
    return {};
}

// The names of the scenes in scenes/ itself.
std::vector<std::string> shipped_scenes() {
    std::vector<std::string> names;
    std::error_code error;
    const fs::path root = shipped_root();
    if (root.empty()) return names;
    for (const fs::directory_entry& entry : fs::directory_iterator(root / "scenes", error))
        if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    return names;
}

}  // namespace

std::string shipped_file(const std::string& name) {
    std::error_code error;
    if (name.empty() || fs::exists(name, error) || fs::path(name).is_absolute()) return name;
    const fs::path root = shipped_root();
    if (root.empty()) return name;
    if (*fs::path(name).begin() == "scenes" && fs::exists(root / name, error)) return (root / name).string();
    for (const fs::path& file : {root / "scenes" / name, root / "scenes" / (name + ".json")})
        if (fs::is_regular_file(file, error)) return file.string();
    return name;
}

CLI::Validator scene_name() {
    const auto replace = [](std::string& text) -> std::string {
        text = shipped_file(text);
        if (std::error_code error; fs::exists(text, error)) return {};
        if (const std::string meant = did_you_mean(fs::path(text).stem().string(), shipped_scenes()); !meant.empty())
            throw input_error(text, "", "no such file", meant + "check the path");
        return {};
    };
    return {replace, ""};
}

}  // namespace tandem
