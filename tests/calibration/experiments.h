// The experiments of the count of false alarms: which two equal renderers are judged, on what, and how.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem::test {

using MakeRenderer = std::function<std::unique_ptr<Renderer>()>;

// What the two sides are: an observed rate is told for each of them by itself.
enum class Pair { synthetic, cpu_cpu, vulkan_vulkan, cpu_vulkan };
[[nodiscard]] const char* name_of(Pair pair);  // "synthetic", "CPU/CPU", ...

struct Experiment {
    std::string id;  // "cpu-vulkan-classic-paired"
    std::string name;
    Pair pair = Pair::synthetic;
    MakeRenderer reference, candidate;
    std::string scene;            // file name without ending, below `scenes`; empty: synthetic renderers need none
    std::uint32_t size = 16;      // longer side, pixels
    std::uint64_t samples = 512;  // a pixel and side, at the last look
    std::size_t looks = 3;
    double declared = 0.05;                  // Criteria::false_alarm
    bool paired = false;                     // with the paired levels
    bool beyond = false;                     // agrees at its first look, and then takes every look at pairs
    MakeRenderer other_precision = nullptr;  // of the reference: long paths and arithmetic are looked at, too
    [[nodiscard]] Scene load(const std::filesystem::path& scenes) const;
};

[[nodiscard]] std::vector<Experiment> experiments();

}  // namespace tandem::test
