#include "common/distribution/part.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/text.h"

namespace tandem {

namespace {

using nlohmann::json;

constexpr const char *scene_key = "tandem:part_scene", *settings_key = "tandem:part_settings",
                     *version_key = "tandem:part_version", *ranges_key = "tandem:part_ranges",
                     *whole_key = "tandem:part_whole", *devices_key = "tandem:part_devices",
                     *invalid_key = "tandem:part_invalid", *seconds_key = "tandem:part_seconds";

// A piece's words of a pixel: of each channel the sum and the sum of squares, the lower half of each first.
constexpr std::size_t words_of_moments = 4, words_per_piece = words_of_moments * channel_count;

std::string word_channel(std::size_t piece, std::size_t word) {
    constexpr std::array<const char*, channel_count> channels{"R", "G", "B"};
    constexpr std::array<const char*, words_of_moments> words{"sum.low", "sum.high", "squares.low", "squares.high"};
    return fmt::format("sums.{}.{}.{}", piece, channels.at(word / words_of_moments), words.at(word % words_of_moments));
}

std::array<std::uint32_t, words_of_moments> words_of(const Moments& moments) {
    const auto sum = std::bit_cast<std::uint64_t>(moments.sum);
    const auto squares = std::bit_cast<std::uint64_t>(moments.sum_of_squares);
    return {static_cast<std::uint32_t>(sum), static_cast<std::uint32_t>(sum >> 32u),
        static_cast<std::uint32_t>(squares), static_cast<std::uint32_t>(squares >> 32u)};
}

double double_of(std::uint32_t low, std::uint32_t high) {
    return std::bit_cast<double>(std::uint64_t{high} << 32u | low);
}

template <class Number>
bool read_number(std::string_view text, Number& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

bool parse_range(std::string_view text, SampleRange& range) {
    const std::size_t colon = text.find(':');
    return colon != std::string_view::npos && read_number(text.substr(0, colon), range.begin) &&
           read_number(text.substr(colon + 1), range.end) && range.begin < range.end &&
           range.end <= std::uint64_t{1} << 40u;
}

InputError damaged(const std::filesystem::path& path, const std::string& reason) {
    return input_error(path.string(), "", "is damaged: " + reason, "render this part again");
}

// The sums of a file, whose pieces are `ranges`.
Estimate estimate_of(const std::filesystem::path& path, const Image& image, const std::vector<SampleRange>& ranges) {
    std::map<std::string, std::size_t> places;
    for (std::size_t c = 0; c < image.word_channels.size(); ++c) places[image.word_channels[c]] = c;
    if (places.size() != ranges.size() * words_per_piece) throw damaged(path, "channels are missing");
    Estimate estimate(image.width, image.height);
    for (std::size_t piece = 0; piece < ranges.size(); ++piece) {
        std::array<std::size_t, words_per_piece> place{};
        for (std::size_t word = 0; word < words_per_piece; ++word) {
            const auto found = places.find(word_channel(piece, word));
            if (found == places.end()) throw damaged(path, "channels are missing");
            place.at(word) = found->second;
        }
        Estimate::Plane plane(estimate.pixel_count() * channel_count);
        for (std::size_t i = 0; i < plane.size(); ++i) {
            const std::uint32_t* const pixel = &image.words[i / channel_count * places.size()];
            const std::size_t* const at = &place.at(i % channel_count * words_of_moments);
            plane[i] = {double_of(pixel[at[0]], pixel[at[1]]), double_of(pixel[at[2]], pixel[at[3]])};
        }
        estimate.add_block(ranges[piece], std::move(plane));
    }
    return estimate;
}

// Which of two renders' settings differ: "bounces 4, not 12".
std::string differing_settings(const std::string& given, const std::string& wanted) {
    const json a = json::parse(given, nullptr, false), b = json::parse(wanted, nullptr, false);
    std::string text;
    if (a.is_object() && b.is_object())
        for (const auto& [key, value] : b.items())
            if (!a.contains(key) || a.at(key) != value)
                text += fmt::format("{}{} {}, not {}", text.empty() ? "" : ", ", key,
                    a.contains(key) ? a.at(key).dump() : "unknown", value.dump());
    return text.empty() ? "" : fmt::format(" ({})", text);
}

}  // namespace

Provenance provenance_of(const std::vector<std::string>& inputs, const RenderSettings& settings,
    const std::string& precision, const std::string& version) {
    std::string hashes;
    for (const std::string& input : inputs) hashes += hash_of(read_file(input));
    const auto number = [](double value) { return std::isfinite(value) ? json(value) : json(nullptr); };
    json all{{"width", settings.width}, {"height", settings.height}, {"seed", settings.seed},
        {"integrator", integrator_name(settings.integrator)}, {"mis", settings.mis},
        {"light_sampling", name_of(settings.light_sampling, light_sampling_names)},
        {"filter", name_of(settings.filter, pixel_filter_names)}, {"bounces", settings.bounces},
        {"roulette_start", settings.roulette_start}, {"ray_min", settings.ray_min},
        {"ray_max", number(settings.ray_max)},
        {"triangle_test", name_of(settings.intersection.triangles, triangle_kernel_names)},
        {"convex_test", name_of(settings.intersection.convex, convex_kernel_names)},
        {"guard", name_of(settings.intersection.guard, guard_names)}, {"epsilon", settings.intersection.epsilon},
        {"hierarchy_quality", name_of(settings.hierarchy, hierarchy_quality_names)},
        {"generator", name_of(settings.generator, generator_names)}, {"clamp", number(settings.clamp)},
        {"precision", precision.empty() ? "default" : precision},
        {"fresnel", settings.fresnel ? json(*settings.fresnel == Fresnel::exact ? "exact" : "schlick") : json()},
        {"accumulation",
            settings.accumulation ? json(name_of(*settings.accumulation, accumulation_names)) : json("default")}};
    return {hash_of(hashes), all.dump(), version};
}

bool Part::independent() const {
    const json settings = json::parse(of.settings, nullptr, false);
    return !settings.is_object() || settings.value("generator", "") != name_of(Generator::sobol, generator_names);
}

void check_splittable(const RenderSettings& settings) {
    if (settings.sampling == Sampling::adaptive)
        throw UnsupportedError(
            "--sampling adaptive: shares out samples by what all of them show, so it has no parts; leave it out");
    if (settings.accumulation == Accumulation::plain)
        throw UnsupportedError("--accumulation plain: adds all samples to one sum, so it has no parts; leave it out");
}

void write_part(const std::filesystem::path& path, const Part& part, const FilesRead& read) {
    const std::vector<Estimate::Piece> pieces = part.estimate.pieces();
    Image image = image_of(film_of(part.estimate), part.metadata, part.independent());
    std::string ranges;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        ranges += fmt::format("{}{}", i == 0 ? "" : " ", to_string(pieces[i].range));
        for (std::size_t word = 0; word < words_per_piece; ++word) image.word_channels.push_back(word_channel(i, word));
    }
    image.words.reserve(part.estimate.pixel_count() * image.word_channels.size());
    for (std::size_t pixel = 0; pixel < part.estimate.pixel_count(); ++pixel)
        for (const Estimate::Piece& piece : pieces)
            for (std::size_t c = 0; c < channel_count; ++c)
                for (const std::uint32_t word : words_of((*piece.moments)[pixel * channel_count + c]))
                    image.words.push_back(word);
    image.metadata[scene_key] = part.of.scene;
    image.metadata[settings_key] = part.of.settings;
    image.metadata[version_key] = part.of.version;
    image.metadata[ranges_key] = ranges;
    image.metadata[whole_key] = std::to_string(part.whole);
    image.metadata[devices_key] = json(part.devices).dump();
    image.metadata[invalid_key] = std::to_string(part.estimate.invalid());
    image.metadata[seconds_key] = json(part.seconds).dump();
    write_image(path, image, read);
}

Part read_part(const std::filesystem::path& path) {
    constexpr std::uint64_t most_words = 8 * greatest_float_count;
    const Image image = read_image_words(path, most_words);
    if (!image.metadata.contains(ranges_key))
        throw input_error(path.string(), "", "holds no sums", "name a file that render --range or --resume wrote");
    const auto value = [&](const char* key) {
        const auto found = image.metadata.find(key);
        if (found == image.metadata.end()) throw damaged(path, fmt::format("it has no {}", key));
        return found->second;
    };
    Part part;
    part.of = {value(scene_key), value(settings_key), value(version_key)};
    std::vector<SampleRange> ranges;
    const std::string listed = value(ranges_key);
    for (std::size_t at = 0; at < listed.size();) {
        const std::size_t end = std::min(listed.find(' ', at), listed.size());
        if (!parse_range(std::string_view(listed).substr(at, end - at), ranges.emplace_back()))
            throw damaged(path, "its ranges are none");
        at = end + 1;
    }
    try {
        part.estimate = estimate_of(path, image, ranges);
    } catch (const InputError&) {
        throw;
    } catch (const Error& error) {
        throw damaged(path, error.what());
    }
    std::uint64_t invalid = 0;
    const json devices = json::parse(value(devices_key), nullptr, false);
    const json seconds = json::parse(value(seconds_key), nullptr, false);
    if (!read_number(value(invalid_key), invalid) || !read_number(value(whole_key), part.whole) ||
        !devices.is_array() || !seconds.is_number())
        throw damaged(path, "its figures are none");
    part.estimate.add_invalid(invalid);
    part.seconds = seconds.get<double>();
    for (const json& device : devices)
        if (device.is_string()) part.devices.insert(device.get<std::string>());
    for (const auto& [key, text] : image.metadata)
        if (key.starts_with("tandem:") && !key.starts_with("tandem:part_")) part.metadata.emplace(key, text);
    return part;
}

void take_in(Part& all, Part part, const std::string& name) {
    const auto refuse = [&](const std::string& reason, const std::string& mend) {
        throw input_error(name, "", reason, mend);
    };
    if (part.of.scene != all.of.scene)
        refuse("is of another scene, or of one whose files changed", "name its own parts");
    if (part.of.settings != all.of.settings)
        refuse("is of other settings" + differing_settings(part.of.settings, all.of.settings), "name its own parts");
    if (part.of.version != all.of.version)
        refuse(fmt::format("is by version {} of the program, not {}", part.of.version, all.of.version),
            "render it again with that version");
    if (part.whole != 0 && all.whole != 0 && part.whole != all.whole)
        refuse(
            fmt::format("is of an image of {} samples a pixel, not {}", part.whole, all.whole), "name its own parts");
    for (const SampleRange& range : part.estimate.ranges())
        for (const SampleRange& there : all.estimate.ranges())
            if (range.begin < there.end && there.begin < range.end)
                refuse(fmt::format("holds samples {}, of which others hold {}", to_string(range), to_string(there)),
                    "name each sample once");
    all.estimate.merge(std::move(part.estimate));
    all.whole = std::max(all.whole, part.whole);
    all.seconds += part.seconds;
    all.devices.merge(part.devices);
}

std::vector<SampleRange> missing(const Estimate& part, SampleRange range, const std::string& name) {
    std::vector<SampleRange> gaps;
    std::uint64_t at = range.begin;
    for (const SampleRange& there : part.ranges()) {
        if (there.end <= range.begin || there.begin >= range.end) continue;
        if (there.begin > at) gaps.push_back({at, there.begin});
        at = std::max(at, there.end);
    }
    if (at < range.end) gaps.push_back({at, range.end});
    for (const SampleRange& gap : gaps)
        if (gap.begin % samples_per_block != 0)
            throw input_error(name, "",
                fmt::format("ends at sample {}, within a block of {}, and cannot go on", gap.begin, samples_per_block),
                fmt::format("choose multiples of {} samples from the start", samples_per_block));
    return gaps;
}

SampleRange range_from(const std::string& text) {
    SampleRange range;
    if (!parse_range(text, range))
        throw InputError(
            fmt::format("--range: '{}' is no range of samples; write A:B, from sample A to before sample B", text));
    if (range.begin % samples_per_block != 0)
        throw InputError(fmt::format("--range: a range begins at a multiple of {}, as {} or {}, not at {}",
            samples_per_block, range.begin / samples_per_block * samples_per_block,
            (range.begin / samples_per_block + 1) * samples_per_block, range.begin));
    return range;
}

std::string to_string(const SampleRange& range) { return fmt::format("{}:{}", range.begin, range.end); }

std::string to_string(const std::vector<SampleRange>& ranges) {
    std::string text;
    for (const SampleRange& range : ranges) text += fmt::format("{}{}", text.empty() ? "" : ", ", to_string(range));
    return text;
}

}  // namespace tandem
