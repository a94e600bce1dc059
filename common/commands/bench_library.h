// tandem bench --arm-library: a user's own arms, in a separate process. So no result is lost if that code crashes or
// hangs.
#pragma once

#include <string>

#include "common/commands/bench_arguments.h"

namespace tandem {

// Where in the library a process is, in memory that it shares with the one that started it: a file of its own.
class CallNote {
public:
    static constexpr std::size_t bytes = 256;
    // Throws Error where the file cannot be mapped.
    explicit CallNote(const std::string& file);
    ~CallNote();
    CallNote(const CallNote&) = delete;
    CallNote& operator=(const CallNote&) = delete;

    void write(const std::string& where);
    [[nodiscard]] std::string read() const;

private:
    char* text_ = nullptr;
};

// Throws InputError for options that say nothing beside --arm-library, or nothing without it.
void refuse_beside_library(const BenchArguments& arguments, const CommandContext& context);

// Measures the library's arms, lists them, or looks at them under the validation layer, as the arguments say: by other
// processes. Where one crashes, hangs or refuses, what was measured is told all the same, then why.
[[nodiscard]] ExitStatus measure_library(
    const BenchArguments& arguments, const CommandContext& context, const CommandTime& time);

}  // namespace tandem
