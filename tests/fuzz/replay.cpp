// Replays the corpus of one target, with any compiler: replay TARGET FOLDER. Every file must be read or refused, each
// in bounded time and memory; a fault aborts, under the sanitizers or by the target's own checks.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace {

// Files of the corpus are small. A scene of 2^20 entities, the most, takes two seconds and 0.5 GiB where sanitizers
// are.
constexpr double greatest_seconds = 20.0;
constexpr double greatest_gibibytes = 2.0;

std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

double peak_gibibytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);  // KiB on Linux
}

// The number of files that took too much.
int replay(const tandem::fuzz::Target& target, const std::vector<std::filesystem::path>& files) {
    int failures = 0;
    for (const std::filesystem::path& file : files) {
        const std::string bytes = bytes_of(file);
        const auto begin = std::chrono::steady_clock::now();
        std::fprintf(stderr, "%s\n", file.c_str());  // the last one printed is the one that aborts
        target.run(std::as_bytes(std::span(bytes)));
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
        if (seconds.count() <= greatest_seconds && peak_gibibytes() <= greatest_gibibytes) continue;
        std::fprintf(stderr, "  took %.1f s and %.2f GiB\n", seconds.count(), peak_gibibytes());
        ++failures;
    }
    return failures;
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    const auto* const target = arguments.size() != 2
                                   ? tandem::fuzz::targets.end()
                                   : std::ranges::find(tandem::fuzz::targets, std::string_view(arguments[0]),
                                         [](const tandem::fuzz::Target& t) { return t.name; });
    if (target == tandem::fuzz::targets.end()) {
        std::fprintf(stderr, "replay TARGET FOLDER, of the targets scene, obj, mtl, gltf, volume, image\n");
        return 2;
    }
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(arguments[1])) files.push_back(entry.path());
    std::ranges::sort(files);
    if (files.empty()) {
        std::fprintf(stderr, "no file in %s\n", arguments[1].c_str());
        return 2;
    }
    return replay(*target, files) == 0 ? 0 : 1;
}
