#include "common/validation/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/image/image_io.h"
#include "common/validation/report/colour_map.h"
#include "common/validation/report/verdict_json.h"

namespace tandem {

namespace {

using nlohmann::json;

// Mean of what is lit in the picture once exposed and clipped, as photographers set middle grey.
constexpr double middle_grey = 0.18;
// What is darker than this part of the mean counts as unlit: a lit body before a black background stays a body.
constexpr double lit = 0.01;
// -log10 p at which the map of p-values reaches its brightest.
constexpr double brightest_p_decades = 8.0;

double grey_mean(const SampledImage& image) {
    const auto means = channel_means(image);
    return (means[0] + means[1] + means[2]) / 3.0;
}

// The factor for which the lit pixels' mean is middle grey. Clipped light counts as white, so that one bright lamp does
// not leave the rest black.
double exposure_of(const SampledImage& image) {
    const double mean = grey_mean(image);
    if (!(mean > 0.0)) return 1.0;
    std::vector<double> greys;
    for (std::size_t i = 0; i < image.pixels.size(); i += channel_count) {
        const double grey =
            (image.pixels[i].mean + image.pixels[i + 1].mean + image.pixels[i + 2].mean) / channel_count;
        if (grey > lit * mean) greys.push_back(grey);
    }
    const auto shown = [&](double exposure) {
        double sum = 0.0;
        for (const double grey : greys) sum += std::min(1.0, exposure * grey);
        return sum / static_cast<double>(greys.size());
    };
    double low = middle_grey / *std::ranges::max_element(greys), high = middle_grey / (lit * mean);
    for (int step = 0; step < 40; ++step)
        (shown(std::sqrt(low * high)) < middle_grey ? low : high) = std::sqrt(low * high);
    return low;
}

Image picture(const SampledImage& sampled) {
    Image image;
    image.width = sampled.width;
    image.height = sampled.height;
    image.channels = {"R", "G", "B"};
    for (const PixelStatistics& pixel : sampled.pixels) image.pixels.push_back(static_cast<float>(pixel.mean));
    return image;
}

// Candidate less reference, mean of the channels.
std::vector<double> grey_differences(const SceneVerdict& verdict) {
    std::vector<double> differences(verdict.reference.pixels.size() / channel_count, 0.0);
    for (std::size_t i = 0; i < verdict.reference.pixels.size(); ++i)
        differences[i / channel_count] +=
            (verdict.candidate.pixels[i].mean - verdict.reference.pixels[i].mean) / channel_count;
    return differences;
}

// |difference| that 99 % of the pixels stay below.
double range_of(const std::vector<double>& differences) {
    std::vector<double> sizes(differences);
    for (double& size : sizes) size = std::abs(size);
    const auto place = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() * 99 / 100);
    std::ranges::nth_element(sizes, place);
    return *place;
}

// Each pixel's tile: of its channels the one that differs most, over the margin.
std::vector<double> tile_differences(const SceneVerdict& verdict) {
    const LevelResult& level = verdict.judgement.level("tiles 16x16");
    const TileGrid grid(verdict.reference.width, verdict.reference.height, standard_tile_edge);
    std::vector<double> map;
    for (const std::uint32_t tile : grid.tile_of_pixel()) {
        double most = 0.0;
        for (std::size_t c = 0; c < channel_count; ++c) {
            const double relative = level.regions[tile * channel_count + c].relative;
            if (std::abs(relative) > std::abs(most)) most = relative;
        }
        map.push_back(most / verdict.criteria.margins.tile);
    }
    return map;
}

// -log10 of the least p of the three channels, times three.
std::vector<double> p_decades(const SceneVerdict& verdict) {
    std::vector<double> map;
    for (std::size_t i = 0; i < verdict.judgement.pixel_p.size(); i += channel_count) {
        const auto first = verdict.judgement.pixel_p.begin() + static_cast<std::ptrdiff_t>(i);
        const double p = std::min(1.0, channel_count * *std::min_element(first, first + channel_count));
        map.push_back(-std::log10(std::max(p, 1e-300)) / brightest_p_decades);
    }
    return map;
}

constexpr const char* report_file = "report.json";
constexpr std::array picture_names{"reference", "candidate", "difference", "tiles", "p"};

std::string file_of(std::size_t index, const std::string& scene, const std::string& picture) {
    std::string file = fmt::format("{:02}-", index + 1);
    const std::string name = std::filesystem::path(scene).stem().string();
    for (const char c : name) file += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '-';
    return file + "-" + picture + ".png";
}

json write_pictures(FolderToFill& folder, std::size_t index, const SceneVerdict& verdict, const FilesRead& read) {
    const std::uint32_t width = verdict.reference.width, height = verdict.reference.height;
    const double mean = grey_mean(verdict.reference);
    const double exposure = exposure_of(mean > 0.0 ? verdict.reference : verdict.candidate);
    const auto file = [&](const std::string& what) { return file_of(index, verdict.scene, what); };
    const auto write = [&](const char* what, const Image& image, double brightness = 1.0) {
        write_png(folder.file(file(what)), image, brightness, read);
    };
    write("reference", picture(verdict.reference), exposure);
    write("candidate", picture(verdict.candidate), exposure);

    std::vector<double> differences = grey_differences(verdict);
    const double range = range_of(differences);
    for (double& difference : differences) difference /= range > 0.0 ? range : 1.0;
    write("difference", false_colour_image(width, height, differences, diverging_colour));
    write("tiles", false_colour_image(width, height, tile_differences(verdict), diverging_colour));
    write("p", false_colour_image(width, height, p_decades(verdict), sequential_colour));
    return {{"reference", file("reference")}, {"candidate", file("candidate")}, {"difference", file("difference")},
        {"tiles", file("tiles")}, {"p", file("p")}, {"exposure", exposure},
        {"difference_range_relative", mean > 0.0 ? json(range / mean) : json(nullptr)},
        {"tiles_range_relative", verdict.criteria.margins.tile}, {"p_range_decades", brightest_p_decades}};
}

}  // namespace

std::vector<std::string> report_files(const std::vector<std::string>& scenes) {
    std::vector<std::string> files{report_file};
    for (std::size_t i = 0; i < scenes.size(); ++i)
        for (const char* picture : picture_names) files.push_back(file_of(i, scenes[i], picture));
    return files;
}

void write_report(const std::filesystem::path& path, std::span<const SceneVerdict> verdicts,
    const std::vector<DeviceSelfTest>& self_tests, const std::vector<std::string>& not_run, const FilesRead& read) {
    FolderToFill folder(path);
    json report = to_json(verdicts, not_run);
    report["device_self_tests"] = to_json(self_tests);
    for (std::size_t i = 0; i < verdicts.size(); ++i)
        report["scenes"][i]["images"] = verdicts[i].looks.empty() || verdicts[i].judgement.black
                                            ? json(nullptr)
                                            : write_pictures(folder, i, verdicts[i], read);
    write_text_file(folder.file(report_file), report.dump(2, ' ', false, json::error_handler_t::replace) + "\n", read);
    folder.keep();
}

void merge_reports(const std::filesystem::path& path, json report, const std::vector<std::filesystem::path>& parts,
    const FilesRead& read) {
    FolderToFill folder(path);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        json& scene = report.at("scenes").at(i);
        scene["images"] = nullptr;
        std::error_code error;
        if (!std::filesystem::exists(parts[i] / report_file, error)) continue;
        const json part = json::parse(read_file(parts[i] / report_file), nullptr, false);
        if (!part.is_object() || !part.contains("scenes") || part.at("scenes").size() != 1)
            throw input_error((parts[i] / report_file).string(), "", "is no report of one scene", "do that item again");
        scene["images"] = part.at("scenes").front().at("images");
        if (scene.at("images").is_null()) continue;
        for (const char* const picture : picture_names) {
            const std::string file = file_of(i, scene.at("scene").get<std::string>(), picture);
            write_text_file(
                folder.file(file), read_file(parts[i] / scene.at("images").at(picture).get<std::string>()), read);
            scene["images"][picture] = file;
        }
    }
    write_text_file(folder.file(report_file), report.dump(2, ' ', false, json::error_handler_t::replace) + "\n", read);
    folder.keep();
}

}  // namespace tandem
