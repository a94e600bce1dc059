#include "common/cost/samples.h"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

using nlohmann::json;

json binary_of(const PixelValues& values) {
    std::vector<std::uint8_t> bytes(values.size() * sizeof(double));
    if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return json::binary(std::move(bytes));
}

PixelValues values_of(const json& member, std::size_t size) {
    const auto& bytes = member.get_binary();
    if (bytes.size() % sizeof(double) != 0 || bytes.size() / sizeof(double) != size)
        throw Error("an image has not the size of the others");
    PixelValues values(size);
    if (size > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

// A line with the checksum of the rest, so that damage is told from figures.
constexpr std::string_view head = "tandem cost, checksum ";

std::string bytes_of(const json& value) {
    const std::vector<std::uint8_t> cbor = json::to_cbor(value);
    const std::string bytes(cbor.begin(), cbor.end());
    return std::string(head) + hash_of(bytes) + "\n" + bytes;
}

// What follows the line. Throws Error where that is none of ours, or the checksum is of something else.
std::string_view checked(std::string_view bytes) {
    const std::size_t end = bytes.find('\n');
    if (!bytes.starts_with(head) || end == std::string_view::npos) throw Error("its first line is another");
    const std::string_view rest = bytes.substr(end + 1);
    if (bytes.substr(head.size(), end - head.size()) != hash_of(rest))
        throw Error("it is damaged, since its checksum is of something else");
    return rest;
}

json to_json(const CostReference& reference) {
    return {{"key", reference.key}, {"options", reference.options}, {"samples", reference.samples},
        {"seconds", reference.seconds}, {"size", reference.mean.size()}, {"mean", binary_of(reference.mean)},
        {"half_difference", binary_of(reference.half_difference)},
        {"half_variance", binary_of(reference.half_variance)}, {"image", reference.image},
        {"made_by", reference.made_by}, {"program", reference.program}};
}

CostReference reference_from(const json& value) {
    CostReference reference;
    reference.key = value.at("key").get<std::string>();
    reference.options = value.at("options").get<std::string>();
    reference.samples = value.at("samples").get<std::uint64_t>();
    reference.seconds = value.at("seconds").get<double>();
    const auto size = value.at("size").get<std::size_t>();
    reference.mean = values_of(value.at("mean"), size);
    reference.half_difference = values_of(value.at("half_difference"), size);
    reference.half_variance = values_of(value.at("half_variance"), size);
    reference.image = value.at("image").get<std::string>();
    reference.made_by = value.at("made_by").get<std::string>();
    reference.program = value.at("program").get<std::string>();
    return reference;
}

json to_json(const ArmTrials& arm) {
    json replicates = json::array();
    for (const Replicate& replicate : arm.replicates)
        replicates.push_back(
            {{"round", replicate.round}, {"seconds", replicate.seconds}, {"squared_errors", replicate.squared_errors},
                {"relative_squared_errors", replicate.relative_squared_errors},
                {"sample_variance", replicate.sample_variance}});
    return {{"name", arm.name}, {"stage", arm.stage}, {"first_replicate", arm.first_replicate},
        {"samples", arm.samples}, {"replicates", replicates}, {"invalid", arm.invalid}, {"flip", arm.flip},
        {"sum", binary_of(arm.sum)}, {"sum_of_squares", binary_of(arm.sum_of_squares)}};
}

ArmTrials arm_from(const json& value, std::size_t size) {
    ArmTrials arm;
    arm.name = value.at("name").get<std::string>();
    arm.stage = value.at("stage").get<std::uint32_t>();
    arm.first_replicate = value.at("first_replicate").get<std::uint64_t>();
    arm.flip = value.at("flip").get<double>();
    arm.samples = value.at("samples").get<std::vector<std::uint64_t>>();
    arm.invalid = value.at("invalid").get<std::uint64_t>();
    arm.sum = values_of(value.at("sum"), size);
    arm.sum_of_squares = values_of(value.at("sum_of_squares"), size);
    for (const json& each : value.at("replicates")) {
        Replicate replicate{each.at("round").get<std::uint64_t>(), each.at("seconds").get<std::vector<double>>(),
            each.at("squared_errors").get<std::vector<double>>(),
            each.at("relative_squared_errors").get<std::vector<double>>(), each.at("sample_variance").get<double>()};
        for (const auto* figures : {&replicate.seconds, &replicate.squared_errors, &replicate.relative_squared_errors})
            if (figures->size() != arm.samples.size()) throw Error("a replicate has not a figure a sample count");
        arm.replicates.push_back(std::move(replicate));
    }
    return arm;
}

template <class Convert>
auto read(const std::string& bytes, const std::string& whose, const Convert& convert) {
    try {
        return convert(json::from_cbor(checked(bytes)));
    } catch (const std::exception& error) {
        throw input_error(
            whose, "", std::string("is no file that tandem cost wrote: ") + error.what(), "name another, or delete it");
    }
}

}  // namespace

double CostReference::image_mean() const {
    return mean.empty() ? 0.0 : std::accumulate(mean.begin(), mean.end(), 0.0) / static_cast<double>(mean.size());
}

double CostReference::relative_uncertainty() const {
    double squares = 0.0;
    for (const double difference : half_difference) squares += difference * difference;
    return std::sqrt(squares / static_cast<double>(half_difference.size())) / image_mean();
}

std::string to_bytes(const CostReference& reference) { return bytes_of(to_json(reference)); }

std::string to_bytes(const CostSamples& samples) {
    json arms = json::array();
    for (const ArmTrials& arm : samples.arms) arms.push_back(to_json(arm));
    return bytes_of({{"key", samples.key}, {"reference", to_json(samples.reference)}, {"arms", arms},
        {"seconds", samples.seconds}});
}

CostReference reference_from_bytes(const std::string& bytes, const std::string& whose) {
    return read(bytes, whose, reference_from);
}

CostSamples samples_from_bytes(const std::string& bytes, const std::string& whose) {
    return read(bytes, whose, [](const json& value) {
        CostSamples samples;
        samples.key = value.at("key").get<std::string>();
        samples.seconds = value.at("seconds").get<double>();
        samples.reference = reference_from(value.at("reference"));
        for (const json& arm : value.at("arms")) samples.arms.push_back(arm_from(arm, samples.reference.mean.size()));
        return samples;
    });
}

}  // namespace tandem
