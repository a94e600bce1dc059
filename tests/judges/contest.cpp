// Renders pairs of images, clean ones and such with a planted bug, and asks all judges. Run by scripts/measure/judges.
//
//     contest list                       bugs, with amount and scene, a line each
//     contest rules                      samples, then name and rule of each judge, a line each
//     contest clean SEED                 a pair of equal renderers on each of the five main scenes
//     contest clean-all SEED             the same on every scene that has a bug
//     contest planted SEED FIRST COUNT   a pair for each of so many bugs of the list
//
// References are rendered in double precision, candidates in single: two right renderers differ as two devices do.
#include <OpenImageIO/imagebufalgo.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/compare/compare.h"
#include "common/validation/judges/judges.h"
#include "common/validation/verify/verify.h"
#include "tests/judges/counted_renderer.h"
#include "tests/mutants/catalogue.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

constexpr std::uint32_t side = 64;
// A pixel and side of the images, so that both have as many as `verify` spends.
constexpr std::uint64_t samples = 448;
constexpr std::uint64_t samples_of_verify = 128;  // of each of its independent sides: the fewest that it takes
constexpr Precision of_reference = Precision::double_precision, of_candidate = Precision::single_precision;
// Bugs lie on one of these where they can. The others have scenes of their own, and fewer clean pairs.
const std::set<std::string> main_scenes{"cornell-classic", "glass", "conductors", "lights", "textures"};

struct Entry {
    Mutant mutant;
    std::string scene;
};

std::vector<Entry> entries() {
    std::vector<Entry> found;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.planting != Planting::cpu || mutant.unbiased) continue;
        const auto scene =
            std::ranges::find_if(mutant.scenes, [](const std::string& name) { return main_scenes.contains(name); });
        found.push_back({mutant, scene != mutant.scenes.end() ? *scene : mutant.scenes.front()});
    }
    std::ranges::stable_sort(found, {}, &Entry::scene);  // bugs of a scene share its references
    return found;
}

std::set<std::string> scenes_of_bugs() {
    std::set<std::string> scenes;
    for (const Entry& entry : entries()) scenes.insert(entry.scene);
    return scenes;
}

struct Film {
    Scene scene;
    RenderSettings settings;
};

Film film_of(const std::string& name) {
    Film film{load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / (name + ".json")), {}};
    film.settings = with_longer_side(default_settings(film.scene), side);
    return film;
}

Image rendered(Film film, const PlantedFault& fault, Precision precision, std::uint64_t seed) {
    film.settings.seed = seed;
    RenderedSamples count;
    const auto renderer = counted_renderer(fault, precision, count);
    return image_of(renderer->prepare(film.scene, film.settings)->render({0, samples}).estimate, {});
}

// How far Tandem's least p lies below what it was held to, in powers of ten.
double excess(const SceneVerdict& verdict) {
    double greatest = -300.0;
    for (const LevelResult& level : verdict.judgement.levels)
        greatest =
            std::max(greatest, std::log10(std::max(level.threshold, 1e-300)) - std::log10(std::max(level.p, 1e-300)));
    return verdict.verdict == Verdict::disagree ? std::max(greatest, 1e-9) : std::min(greatest, 0.0);
}

// What idiff -p says of them: Yee's metric, as OpenUSD's tests use it.
JudgeFinding perceptual(const JudgedPair& pair) {
    const auto as_read = [&](const std::vector<double>& linear) {
        OIIO::ImageBuf image(
            OIIO::ImageSpec(static_cast<int>(pair.width), static_cast<int>(pair.height), 3, OIIO::TypeDesc::FLOAT));
        const std::vector<double> values = displayed(linear);
        const std::vector<float> floats(values.begin(), values.end());
        image.set_pixels(OIIO::ROI::All(), OIIO::TypeDesc::FLOAT, floats.data());
        return image;
    };
    OIIO::ImageBufAlgo::CompareResults result;
    const int failing = OIIO::ImageBufAlgo::compare_Yee(as_read(pair.reference), as_read(pair.candidate), result);
    return {"idiff -p, OpenUSD", "more than 1 % of pixels look different by Yee's metric, in 8 bits as shown",
        100.0 * failing / static_cast<double>(pair.width * pair.height), 1.0};
}

std::vector<JudgeFinding> findings_on(const JudgedPair& pair) {
    std::vector<JudgeFinding> findings = ask_judges(pair);
    findings.push_back(perceptual(pair));
    return findings;
}

struct Verified {
    SceneVerdict verdict;
    double reference_samples = 0.0, candidate_samples = 0.0;  // a pixel of the film: all that each side rendered
};

// As `tandem verify --size 64` with the fewest samples. Throws where it spends more than the images have.
Verified verified(const Film& film, const PlantedFault& fault, std::uint64_t seed) {
    RenderedSamples reference_count, candidate_count;
    const auto reference = counted_renderer({}, of_reference, reference_count);
    const auto other = counted_renderer({}, of_candidate, reference_count);
    const auto candidate = counted_renderer(fault, of_candidate, candidate_count);
    VerifyOptions options;
    options.settings = film.settings;
    options.max_samples = samples_of_verify;
    options.budget_seconds = 1e6;
    options.seed = seed;
    options.other_precision = other.get();
    options.explain = false;
    Verified result{verify_scene(film.scene, *reference, *candidate, options), 0.0, 0.0};
    const double pixels = static_cast<double>(film.settings.width) * film.settings.height;
    result.reference_samples = static_cast<double>(reference_count.count) / pixels;
    result.candidate_samples = static_cast<double>(candidate_count.count) / pixels;
    if (result.reference_samples + result.candidate_samples > 2.0 * static_cast<double>(samples))
        throw Error(fmt::format("verify took {} and {} samples a pixel, more than {} a side", result.reference_samples,
            result.candidate_samples, samples));
    return result;
}

void print_pair(json line, const std::string& scene, const PlantedFault& fault, std::uint64_t seed) {
    static std::map<std::string, Film> films;
    if (!films.contains(scene)) films.emplace(scene, film_of(scene));
    const Film& film = films.at(scene);
    const std::uint64_t of_a = 2 * seed + 1, of_b = 2 * seed + 2;
    // Its references are the same for all bugs.
    static std::map<std::pair<std::string, std::uint64_t>, Image> references;
    const auto [place, is_new] = references.try_emplace({scene, seed});
    if (is_new) place->second = rendered(film, {}, of_reference, of_a);
    const Image &a = place->second, b = rendered(film, fault, of_candidate, of_b);

    json scores = json::object(), notices = json::object();
    for (const JudgeFinding& finding : findings_on(judged_pair(a, b))) {
        scores[std::string(finding.name)] = finding.score;
        notices[std::string(finding.name)] = finding.notices();
    }
    const SceneVerdict compared = compare_images({{"a", a}}, {{"b", b}});
    const Verified verify = verified(film, fault, of_a);
    for (const auto& [name, verdict] :
        {std::pair{"tandem compare", &compared}, std::pair{"tandem verify", &verify.verdict}}) {
        scores[name] = excess(*verdict);
        notices[name] = verdict->verdict == Verdict::disagree;
    }
    line["scene"] = scene;
    line["seed"] = seed;
    line["scores"] = scores;
    line["notices"] = notices;
    line["samples of verify"] = {verify.reference_samples, verify.candidate_samples};
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
}

std::uint64_t number(const char* text) {
    std::uint64_t value = 0;
    std::from_chars(text, text + std::string_view(text).size(), value);
    return value;
}

void planted(std::uint64_t seed, std::size_t first, std::size_t count) {
    const std::vector<Entry> all = entries();
    for (std::size_t i = first; i < std::min(first + count, all.size()); ++i) {
        const auto& [mutant, scene] = all[i];
        print_pair({{"bug", mutant.id()}, {"amount", mutant.fault.amount}}, scene, mutant.fault, seed);
    }
}

void list() {
    for (const auto& [mutant, scene] : entries()) fmt::print("{} {} {}\n", mutant.id(), mutant.fault.amount, scene);
}

void rules() {
    fmt::print("samples\t{}\n", samples);
    const std::vector<double> grey(3, 0.5);
    for (const JudgeFinding& finding : findings_on({1, 1, grey, grey, grey, grey, 2.0}))
        fmt::print("{}\t{}\n", finding.name, finding.rule);
}

}  // namespace

int main(int argc, char** argv) {
    const std::string_view what = argc > 1 ? argv[1] : "";
    try {
        if (what == "list")
            list();
        else if (what == "rules")
            rules();
        else if ((what == "clean" || what == "clean-all") && argc == 3)
            for (const std::string& scene : what == "clean" ? main_scenes : scenes_of_bugs())
                print_pair(json::object(), scene, {}, number(argv[2]));
        else if (what == "planted" && argc == 5)
            planted(number(argv[2]), number(argv[3]), number(argv[4]));
        else
            return 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "contest: {}\n", error.what());
        return 1;
    }
    return 0;
}
