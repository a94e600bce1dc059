// Files to write: none that is read, no two that are one, folders that go again where nothing came of them; and names
// in messages.
#include <doctest/doctest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "common/error.h"
#include "common/files/outputs.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/image/image_io.h"
#include "common/text.h"
#include "common/validation/report/report.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

std::string refusal(const std::vector<Output>& outputs, const std::vector<std::string>& inputs) {
    return tandem::refusal([&] { check_outputs(outputs, inputs); });
}

}  // namespace

TEST_CASE("an output is no input by any name, and outputs are files of their own") {
    const TemporaryFolder folder;
    std::ofstream(folder / "in.json") << "{}";
    std::filesystem::create_hard_link(folder / "in.json", folder / "hard.json");
    std::filesystem::create_symlink("in.json", folder / "soft.json");
    std::filesystem::create_symlink("new.json", folder / "dangling.json");
    std::filesystem::create_directory_symlink(".", folder / "here");
    const std::vector<std::string> inputs{folder / "in.json"};
    for (const char* name : {"in.json", "hard.json", "soft.json", "here/in.json"}) {
        CAPTURE(name);
        CHECK(refusal({{"--json", folder / name}}, inputs).find("which is read") != std::string::npos);
        CHECK(refusal({{"--report", folder / "here", OutputKind::folder, {name}}}, inputs) != "");
    }
    CHECK(refusal({{"--json", folder / "new.json"}}, inputs) == "");
    CHECK(refusal({{"--json", folder / "new.json"}, {"--junit", ""}}, inputs) == "");
    for (const char* name : {"new.json", "dangling.json", "here/new.json", "here/dangling.json"}) {
        CAPTURE(name);
        const std::string line = refusal({{"--json", folder / "new.json"}, {"--junit", folder / name}}, inputs);
        CHECK(line.find("is named for two outputs, --json and --junit") != std::string::npos);
    }
    CHECK(
        refusal({{"--json", folder / "r/report.json"}, {"--report", folder / "r", OutputKind::folder, {"report.json"}}},
            {}) != "");
    CHECK(refusal({{"--json", "/dev/null"}, {"--junit", "/dev/null"}}, {}) == "");
    CHECK(folder.file_count() == 5);
}

TEST_CASE("what becomes a name of a file that was read, while a command works, is written by no writer") {
    const TemporaryFolder folder;
    Image image;
    image.width = image.height = 1;
    image.channels = {"R", "G", "B"};
    image.pixels = {1, 1, 1};
    const std::function<void(const std::filesystem::path&, const FilesRead&)> writers[] = {
        [](const auto& path, const FilesRead& read) { write_text_file(path, "text", read); },
        [&](const auto& path, const FilesRead& read) { write_image(path, image, read); },
        [&](const auto& path, const FilesRead& read) {
            write_png(std::filesystem::path(path).replace_extension(".png"), image, 1.0, read);
        },
        [&](const auto& path, const FilesRead& read) { write_report(path.parent_path(), {}, {}, {}, read); },
    };
    for (const char* way : {"soft link", "hard link", "moved"}) {
        CAPTURE(way);
        for (const auto& write : writers) {
            std::filesystem::remove_all(folder / "work");
            std::filesystem::create_directory(folder / "work");
            const std::filesystem::path input = folder / "in.txt";
            std::ofstream(input) << "read";
            FilesRead read;
            read.add(input);
            write(folder / "work/out.pfm", read);  // nothing is in the way yet
            for (const char* output : {"out.pfm", "out.png", "report.json"}) {
                const std::filesystem::path target = folder / "work" / output;
                std::filesystem::remove(target);
                if (way == std::string("soft link")) std::filesystem::create_symlink(input, target);
                if (way != std::string("soft link")) std::filesystem::create_hard_link(input, target);
            }
            if (way == std::string("moved")) std::filesystem::remove(input);
            const std::size_t files = folder.file_count();
            CHECK_THROWS_WITH_AS(write(folder / "work/out.pfm", read), doctest::Contains("which was read"), InputError);
            CHECK(read_file(folder / "work/out.pfm") == "read");
            CHECK(read_file(folder / "work/out.png") == "read");
            CHECK(read_file(folder / "work/report.json") == "read");
            CHECK(folder.file_count() == files);
        }
    }
}

TEST_CASE("a folder that was made goes again unless it is kept, and one that was there stays") {
    const TemporaryFolder folder;
    const auto fill = [&](const std::string& name, bool keep) {
        FolderToFill made(folder / name);
        write_text_file(made.file("a"), "a");
        if (keep) made.keep();
    };
    fill("x/y/z", false);
    CHECK_FALSE(std::filesystem::exists(folder / "x"));
    fill("x/y/", true);
    CHECK(std::filesystem::exists(folder / "x/y/a"));
    fill("x/y", false);
    CHECK(std::filesystem::exists(folder / "x/y/a"));
    check_writable_folder(folder / "x/y/new/newer");
    CHECK_FALSE(std::filesystem::exists(folder / "x/y/new"));
    CHECK_THROWS_AS(FolderToFill(folder / "x/y/a/b"), InputError);
    CHECK_THROWS_AS(FolderToFill(folder / "x/y/a"), InputError);
}

TEST_CASE("commands that start together may make and remove the same folders") {
    const TemporaryFolder folder;
    std::atomic<unsigned> refused = 0;
    {
        std::vector<std::jthread> commands;
        for (int i = 0; i < 4; ++i)
            commands.emplace_back([&] {
                for (int round = 0; round < 500; ++round) try {
                        check_writable_folder(folder / "cache/tandem/references");
                    } catch (const InputError&) {
                        ++refused;
                    }
            });
    }
    CHECK(refused == 0);
}

TEST_CASE("a replaced file keeps its permissions") {
    const TemporaryFolder folder;
    std::ofstream(folder / "a") << "old";
    REQUIRE(::chmod((folder / "a").c_str(), 0600) == 0);
    write_text_file(folder / "a", "new");
    CHECK(std::filesystem::status(folder / "a").permissions() == std::filesystem::perms(0600));
}

TEST_CASE("names are shown on one line, and what is no UTF-8 is told") {
    CHECK(escaped("a\nb\x1b[0m") == "a\\x0ab\\x1b[0m");
    CHECK(escaped(std::string(1000, 'x')).size() == 1000);
    CHECK(printable(std::string(1000, 'x')).size() < 200);
    for (const char* text : {"", "abc", "ä", "€", "\xF0\x9F\x98\x80"}) CHECK(is_utf8(text));
    for (const char* text :
        {"\xff", "a\xe4", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"}) {
        CAPTURE(text);
        CHECK_FALSE(is_utf8(text));
        CHECK(is_utf8(escaped(text)));
    }
    CHECK(hash_of("") == "cbf29ce484222325");
    CHECK(hash_of("a") == "af63dc4c8601ec8c");  // of the authors' list: isthe.com/chongo/tech/comp/fnv
}
