// The folder of a report: report.json and the pictures. scripts/report turns it into one HTML file.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "common/files/write_file.h"
#include "common/self_test/self_test.h"
#include "common/validation/verify/scene_verdict.h"

namespace tandem {

// The files that write_report writes into its folder, for scenes of these names.
[[nodiscard]] std::vector<std::string> report_files(const std::vector<std::string>& scenes);

// Writes DIR/report.json (verdict_json.h, "device_self_tests", and for each scene "images": file names and the ranges
// of the maps) and the PNGs it names. Makes the folder if need be. Throws InputError where it cannot be written or a
// file of `read` is in the way. Then a folder that it made is gone again.
void write_report(const std::filesystem::path& folder, std::span<const SceneVerdict> verdicts,
    const std::vector<DeviceSelfTest>& self_tests = {}, const std::vector<std::string>& not_run = {},
    const FilesRead& read = {});

// The same folder for scenes of several reports. `report`: what they say together, as verdict_json.h has it. `parts`:
// the folder that each scene is in, by itself; without one it has no images.
void merge_reports(const std::filesystem::path& folder, nlohmann::json report,
    const std::vector<std::filesystem::path>& parts, const FilesRead& read = {});

}  // namespace tandem
