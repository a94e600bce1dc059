// Reads whole files into memory, for every room. It refuses pipes and devices, which might not end.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tandem {

// Bytes of the largest stored result read.
inline constexpr std::size_t greatest_result_bytes = std::size_t{1} << 30;

// Where an error is reported, if another file names the one that is read. It is at the JSON pointer `pointer` of
// `file`, which calls the read one `shown`.
struct NamedBy {
    std::string file, pointer, shown;
};

// The bytes of a regular file of at most `limit`. Throws InputError with the reason.
[[nodiscard]] std::string read_file(const std::filesystem::path& path, std::size_t limit, const NamedBy& place);
[[nodiscard]] std::string read_file(const std::filesystem::path& path, std::size_t limit = greatest_result_bytes);

}  // namespace tandem
