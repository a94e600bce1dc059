// What a student hands in, and the shader that it becomes part of. A submission is text from a stranger. Its size is
// limited. Directives are refused, and so are all words that could reach outside the function. The compiler gets
// exactly the checked text, without its comments.
#pragma once

#include <filesystem>
#include <string>

#include "common/error.h"
#include "common/exercise/exercise.h"

namespace tandem {

// The submission is refused: no mark is worth giving, and what() says why, with the line.
class RefusedSubmission : public Error {
public:
    using Error::Error;
};

inline constexpr std::size_t greatest_submission_bytes = 64 * 1024;

// The text of a file. Throws InputError where it cannot be read, RefusedSubmission where it is too large.
[[nodiscard]] std::string read_submission(const std::filesystem::path& path);

// The text without comments, line by line where it was. Throws RefusedSubmission for a directive, a backslash, and
// words that name what is not the student's: layout, buffer, uniform, main, gl_…, tandem_….
[[nodiscard]] std::string without_comments(const std::string& text);

// GLSL of a compute shader that calls the function on a list of arguments. The submission stands first, so that it sees
// nothing of what follows.
[[nodiscard]] std::string shader_of(const Exercise& exercise, const std::string& submission);

// What `tandem exercise start` writes.
[[nodiscard]] std::string starter_of(const Exercise& exercise, std::size_t number);

}  // namespace tandem
