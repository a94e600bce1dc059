// Files that are read whole, and what is refused instead of waited for.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "common/experiment/bench.h"
#include "common/experiment/results.h"
#include "common/files/read_file.h"
#include "common/scene/loader/scene_loader.h"
#include "common/stability/catalogue.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {}  // namespace

TEST_CASE("a file is read whole up to its limit") {
    const TemporaryFolder folder;
    const std::string bytes("a\0\nb", 4);
    std::ofstream(folder / "a", std::ios::binary) << bytes;
    CHECK(read_file(folder / "a") == bytes);
    CHECK(read_file(folder / "a", 4) == bytes);
    CHECK(refusal([&] { (void)read_file(folder / "a", 3); }).find("is larger than") != std::string::npos);
    CHECK(refusal([&] { (void)read_file(folder / "b"); }).find("b: no such file") != std::string::npos);
    CHECK(refusal([&] {
        (void)read_file(folder / "b", 1, {"scene.json", "/a/0", "b"});
    }) == "scene.json: /a/0: b: no such file; check the path");
}

TEST_CASE("pipes, devices and folders are refused by whoever reads a file, not waited for") {
    const TemporaryFolder folder;
    const std::string pipe = (folder / "pipe").string();
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    for (const std::string& file : {pipe, std::string("/dev/zero"), std::filesystem::path("/").string()})
        for (const std::function<void()>& read :
            {std::function<void()>([&] { (void)read_file(file); }), {[&] { (void)load_scene(file); }},
                {[&] { (void)stability::load_catalogue(file); }}, {[&] { (void)load_results(file); }}}) {
            const std::string message = refusal(read);
            CAPTURE(message);
            CHECK((message.find("is not a regular file") != std::string::npos ||
                   message.find("is a folder") != std::string::npos));
        }
}
