// How much memory a command may use, and the forecast of what a render will use.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/render/memory_forecast.h"
#include "common/render/stopping.h"

namespace tandem {

inline constexpr const char* memory_help =
    "Memory that the command may take, 2GiB for example (default: three quarters of what is free)";

// Adds --memory, a rare option.
void add_memory_option(CLI::App& command, std::string& memory, const std::string& help);

// "512MiB", "2GiB", "1.5TiB", or MB, GB, TB; empty: three quarters of what this machine, or the container, has free.
// Throws InputError.
[[nodiscard]] std::uint64_t memory_limit(const std::string& memory);

// What this machine has free, or the container where that has less.
[[nodiscard]] std::uint64_t free_bytes();

// Why a scene does not fit into memory, whatever renders it; empty: it may.
[[nodiscard]] std::string beyond_memory(const Scene& scene, const RenderSettings& settings);

// check_memory (command.h) for work that takes so many bytes a pixel. `mend`: what to do in its place. Throws
// InputError.
void check_memory(const RenderSettings& settings, std::uint64_t bytes_per_pixel, const std::string& mend);

// What this process takes, bytes: now, and the most so far.
[[nodiscard]] std::uint64_t resident_bytes();
[[nodiscard]] std::uint64_t peak_resident_bytes();

// "12 MiB", "1.5 GiB".
[[nodiscard]] std::string shown_bytes(std::uint64_t bytes);

// What a render will take, part by part, bytes.
struct MemoryNeed {
    std::uint64_t program = 0;  // and the scene as loaded: what is taken already
    std::uint64_t tables = 0, trees = 0, building = 0;
    std::uint64_t film = 0;  // sums, paths in hand, and the image made of them

    [[nodiscard]] std::uint64_t scene() const { return program + tables + trees; }
    // The most at any one time.
    [[nodiscard]] std::uint64_t total() const;
    // "31 MiB, of them program and scene 12 MiB, …"
    [[nodiscard]] std::string text() const;
    [[nodiscard]] nlohmann::json json() const;  // MiB
};

// How a film is held.
struct FilmUse {
    std::uint64_t pixels = 0;  // at once
    std::uint64_t samples = 0;
    bool whole = true;  // false: region by region
    // It may end within a block, which is then held apart (growing_estimate.h). Settings are tried for it.
    bool by_error = false;
};
[[nodiscard]] FilmUse film_use(const RenderSettings& settings, const StoppingRule& rule);

// A renderer may forecast nothing: then it is the film alone.
[[nodiscard]] MemoryNeed memory_need(
    const Renderer& renderer, const Scene& scene, const RenderSettings& settings, const FilmUse& film);

}  // namespace tandem
