#include "common/stability/catalogue.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/stability/generators.h"
#include "common/stability/metamorphic.h"

namespace tandem::stability {

namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 5> subject_names{"triangles", "convex", "guards", "images", "changes"};

class Reader {
public:
    Reader(std::string file, const json& document) : file_(std::move(file)), document_(document) {}

    [[nodiscard]] HardCase read(std::size_t index) const {
        const json& entry = document_.at("cases").at(index);
        const std::string at = "/cases/" + std::to_string(index);
        HardCase result;
        result.id = text(entry, at, "id");
        result.name = text(entry, at, "name");
        result.source = text(entry, at, "source");
        result.bound_text = text(entry, at, "bound");
        result.bound = number(entry, at, "bound_ulp");
        result.bound_vulkan = entry.contains("bound_ulp_vulkan") ? number(entry, at, "bound_ulp_vulkan") : result.bound;
        result.bound_double = entry.contains("bound_ulp_double") ? number(entry, at, "bound_ulp_double") : result.bound;
        const std::string subject = text(entry, at, "subject");
        const auto found = std::ranges::find(subject_names, subject);
        if (found == subject_names.end())
            throw input_error(file_, at + "/subject", "'" + subject + "' is no subject",
                "use triangles, convex, guards, images or changes");
        result.subject = static_cast<Subject>(found - subject_names.begin());
        if (result.subject == Subject::images) {
            result.scene_file = (std::filesystem::path(file_).parent_path() / text(entry, at, "scene")).string();
            result.samples = whole(entry, at, "samples");
            if (entry.contains("bounces")) result.bounces = static_cast<std::uint32_t>(number(entry, at, "bounces"));
        } else if (result.subject == Subject::changes) {
            read_change(entry, at, result);
        } else {
            result.generator = text(entry, at, "generator");
            result.rays = whole(entry, at, "rays");
            result.seed = static_cast<std::uint64_t>(number(entry, at, "seed"));
        }
        result.counts_as_aimed = entry.value("aimed_at_seams", false);
        result.every_pixel = entry.value("every_pixel", false);
        if (entry.contains("parameters"))
            for (const auto& [name, value] : entry.at("parameters").items()) {
                if (!value.is_number())
                    throw input_error(file_, at + "/parameters/" + name, "is no number", "give a number");
                result.parameters[name] = value.get<double>();
            }
        for (const json& pattern : entry.value("expected_failures", json::array()))
            result.expected_failures.push_back({pattern.value("backend", ""), pattern.value("precision", ""),
                pattern.value("kernel", ""), pattern.value("seldom", false)});
        return result;
    }

private:
    void read_change(const json& entry, const std::string& at, HardCase& result) const {
        result.change = text(entry, at, "change");
        if (std::ranges::find(change_names, result.change) == change_names.end())
            throw input_error(file_, at + "/change", "'" + result.change + "' is no change",
                "use scaled, turned, mirrored, permuted, split or baked");
        result.samples = whole(entry, at, "samples");
        for (const json& scene : entry.value("scenes", json::array()))
            result.scene_files.push_back(
                (std::filesystem::path(file_).parent_path() / scene.get<std::string>()).string());
    }
    [[nodiscard]] std::string text(const json& entry, const std::string& at, const char* name) const {
        if (!entry.contains(name) || !entry.at(name).is_string())
            throw input_error(file_, at + "/" + name, "is missing or no text", "give the case a " + std::string(name));
        return entry.at(name).get<std::string>();
    }
    [[nodiscard]] double number(const json& entry, const std::string& at, const char* name) const {
        if (!entry.contains(name) || !entry.at(name).is_number() || entry.at(name).get<double>() < 0.0)
            throw input_error(
                file_, at + "/" + name, "is missing or no number >= 0", "give the case its " + std::string(name));
        return entry.at(name).get<double>();
    }

    // So many of something that without it there is nothing to judge.
    [[nodiscard]] std::uint64_t whole(const json& entry, const std::string& at, const char* name) const {
        if (!entry.contains(name) || !entry.at(name).is_number_unsigned() || entry.at(name).get<std::uint64_t>() == 0)
            throw input_error(file_, at + "/" + name, "is missing or no whole number >= 1",
                "give the case one or more " + std::string(name));
        return entry.at(name).get<std::uint64_t>();
    }

    std::string file_;
    const json& document_;
};

}  // namespace

std::vector<HardCase> load_catalogue(const std::string& file) {
    const std::string text = read_file(file);
    json document;
    try {
        document = json::parse(text);
    } catch (const json::parse_error& error) {
        throw input_error(file, "", std::string("is no JSON: ") + error.what(), "mend it");
    }
    if (!document.is_object() || !document.contains("cases") || !document.at("cases").is_array())
        throw input_error(file, "/cases", "is missing or no list", "list the cases there");
    std::vector<HardCase> cases;
    const Reader reader(file, document);
    for (std::size_t i = 0; i < document.at("cases").size(); ++i) {
        cases.push_back(reader.read(i));
        const auto same = [&](const HardCase& other) { return other.id == cases.back().id; };
        if (std::count_if(cases.begin(), cases.end(), same) > 1)
            throw input_error(file, "/cases/" + std::to_string(i) + "/id", "'" + cases.back().id + "' is there twice",
                "give each case an id of its own");
    }
    return cases;
}

double parameter(const HardCase& hard_case, const char* name) {
    const auto found = hard_case.parameters.find(name);
    if (found == hard_case.parameters.end())
        throw InputError("hard case " + hard_case.id + ": its generator '" + hard_case.generator +
                         "' needs the parameter '" + name + "'; add it to the catalogue");
    return found->second;
}

std::vector<RayWork> make_ray_work(const HardCase& hard_case) {
    for (const auto make : {make_triangle_work, make_convex_work, make_leaving_work}) {
        Dice dice(hard_case.seed);
        std::vector<RayWork> work = make(hard_case, dice);
        if (!work.empty()) return work;
    }
    throw InputError("hard case " + hard_case.id + ": there is no generator '" + hard_case.generator + "'");
}

}  // namespace tandem::stability
