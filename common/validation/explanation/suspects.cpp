#include "common/validation/explanation/suspects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/text.h"
#include "common/validation/explanation/part_evidence.h"
#include "common/validation/explanation/pixel_pattern.h"

namespace tandem {

namespace {

using S = Subsystem;

// For a part's figures, what a reader of the traced paths would say.
struct FigureClause {
    S part;
    Figure figure;
    std::string_view words;
};
constexpr FigureClause figure_clauses[] = {
    {S::camera, Figure::by_camera, "the rays of the camera differ first"},
    {S::geometry, Figure::by_met, "rays from one point meet different things first"},
    {S::geometry, Figure::by_normal, "normals differ first"},
    {S::geometry, Figure::by_place, "hits lie at different points first"},
    {S::geometry, Figure::by_spawned, "rays leave one hit at different points first"},
    {S::geometry, Figure::by_shadow, "shadow rays to one point end differently first"},
    {S::volumes, Figure::by_throughput, "the way through a medium dims differently first"},
    {S::volumes, Figure::at_medium, "they part within a medium"},
    {S::light_sampling, Figure::by_light, "what a next event brings differs first"},
    {S::light_sampling, Figure::by_light_direction, "next events aim at different points first"},
    {S::light_sampling, Figure::by_shadow, "shadow rays to one point end differently first"},
    {S::mis_weights, Figure::by_emission, "light that scattering has found differs first"},
    {S::emission, Figure::by_emission, "light that the ray itself has found differs first"},
    {S::roulette, Figure::by_end, "one path ends where the other goes on"},
    {S::dielectric, Figure::at_dielectric, "they part at glass"},
    {S::dielectric, Figure::at_boundary, "they part at a boundary of a medium"},
    {S::textures, Figure::on_texture, "they part on a texture"},
    {S::bsdf, Figure::by_weight, "the weight of scattering differs first"},
    {S::bsdf, Figure::by_direction, "new directions differ first"},
    {S::bsdf, Figure::by_density, "densities of scattering differ first"},
    {S::accumulation, Figure::by_sum, "the sum of a path differs though its vertices agree"},
    {S::roulette, Figure::by_weight, "weights differ first"},
};

std::string clause_of(S part, const Signature& signature) {
    constexpr float least = 0.1F;
    const FigureClause* most = nullptr;
    for (const FigureClause& clause : figure_clauses)
        if (clause.part == part && signature[clause.figure] >= least &&
            (most == nullptr || signature[clause.figure] > signature[most->figure]))
            most = &clause;
    if (most == nullptr) return "planted bugs of it look alike";
    return fmt::format("{} in {} of the paths that part", most->words, percent(double{signature[most->figure]}));
}

// Levels that compare means, of films or of paired differences; the others count samples that part.
bool compares_means(const LevelResult& level) {
    return level.name != paired_paths_level && !level.name.starts_with("paired samples") &&
           !level.name.starts_with("closed form");
}

std::string clause_of(const SceneFeature& feature, bool alone) {
    if (feature.section.empty()) return std::string(feature.words);
    return fmt::format("{} {}, MODEL.md {}", alone ? "the scene has" : "no scene that meets its closed form has",
        feature.words, feature.section);
}

class Ranking {
public:
    Ranking(const DifferenceEvidence& evidence, const BugRecord& record)
        : evidence_(evidence),
          part_evidence_{scores_of(evidence.signature, record.patterns),
              evidence.elimination != nullptr ? std::optional(needs_by_part(*evidence.elimination)) : std::nullopt,
              draws_are_independent(evidence.partings), evidence.partings.numbers.use},
          counted_(weight_of_evidence(part_evidence_, evidence_weights(record.patterns, record.needs))),
          scores_(counted_) {}

    RankedSuspects ranked() {
        look_at_needs();
        look_at_bounces();
        look_at_ends();
        look_at_factors();
        look_at_frames();
        look_at_primitives();
        look_at_precision();
        look_at_data();
        look_at_numbers();
        look_at_levels();
        look_outside_paths();
        std::vector<S> order;
        for (std::size_t i = 0; i < scores_.size(); ++i)
            if (is_told(static_cast<S>(i))) order.push_back(static_cast<S>(i));
        std::ranges::stable_sort(order, std::greater{}, [&](S part) { return scores_.at(index(part)); });
        if (order.size() > most_suspects) order.resize(most_suspects);
        std::vector<Suspect> suspects;
        for (const S part : order) {
            const std::string& said = because_.at(index(part));
            suspects.push_back({part, said.empty() ? clause_of(part, evidence_.signature) : said});
        }
        return {suspects, {part_evidence_, counted_, scores_}};
    }

private:
    // Log-likelihood ratios. `certain` exceeds the sum of all that is counted: the observation leaves no other part.
    // `strong` is about the strongest observation of planted bugs. It stands for faults that the record does not have.
    // What is `weak` may be another part's as well.
    static constexpr double certain = 20.0, strong = 4.0, weak = 1.0;
    // In tests/mutants/catalogue.cpp 5 of 8 kinds of random numbers change no mean, and 2 of 89 others.
    static constexpr double means_agree = 3.1, means_differ = -0.9;

    static std::size_t index(S part) { return static_cast<std::size_t>(part); }
    void add(S part, double ratio, std::string because) {
        scores_.at(index(part)) += ratio;
        because_.at(index(part)) = std::move(because);
    }
    // Something speaks for it.
    [[nodiscard]] bool is_told(S part) const {
        return !because_.at(index(part)).empty() || part_evidence_.pattern.at(index(part)) > 0.0;
    }

    // Features stand in order, the most particular first.
    void look_at_needs() {
        if (evidence_.elimination == nullptr) return;
        double before = 0.0;
        for (const FeatureTrial& trial : evidence_.elimination->trials) {
            const std::size_t i = index(trial.feature.part);
            if (trial.need != Need::needed || trial.feature.naming == Naming::nobody || !because_.at(i).empty())
                continue;
            constexpr double later = 0.01;  // than a more particular one, where all else is equal
            add(trial.feature.part, -before, told(*evidence_.elimination, trial));
            before += later;
        }
    }

    void look_at_bounces() {
        if (evidence_.elimination == nullptr || !evidence_.elimination->bounces_off) return;
        add(S::roulette, certain, told_of_bounces(*evidence_.elimination));
    }

    void look_at_ends() {
        constexpr double nearly_all = 0.9;
        const PathPartings& partings = evidence_.partings;
        if (partings.parted == 0 || evidence_.place.outside_paths) return;
        const auto add_end = [&](double share, std::string_view what) {
            if (share < nearly_all) return;
            add(S::roulette, certain, fmt::format("{} in {} of the paths that part", what, percent(share)));
        };
        add_end(partings.by_roulette, "roulette ends one path alone");
        add_end(partings.at_limit, "one path ends at the limit of bounces where the other does not");
    }

    // One factor of what a light brings differs and no other, but for those that follow from it.
    void look_at_factors() {
        const PathPartings& partings = evidence_.partings;
        if (partings.parted == 0 || evidence_.place.outside_paths) return;
        constexpr double nearly_all = 0.9;
        const auto share = [&](PartsBy what) { return partings.by.at(static_cast<std::size_t>(what)); };
        const auto add_factor = [&](S part, std::initializer_list<PartsBy> factors,
                                    std::initializer_list<PartsBy> following, std::string_view words) {
            double all = 0.0, others = 0.0;
            for (const PartsBy factor : factors) all += share(factor);
            for (std::size_t i = 0; i < partings.by.size(); ++i) {
                const auto what = static_cast<PartsBy>(i);
                if (std::ranges::find(factors, what) == factors.end() &&
                    std::ranges::find(following, what) == following.end())
                    others = std::max(others, share(what));
            }
            if (all >= nearly_all && others <= 1.0 - nearly_all)
                add(part, strong, fmt::format("{} in {} of the paths that part", words, percent(std::min(1.0, all))));
        };
        using enum PartsBy;
        add_factor(
            S::volumes, {light_transmittance}, {PartsBy::light}, "the way to a sampled light alone dims differently");
        add_factor(
            S::mis_weights, {light_weight, found_weight}, {PartsBy::light, emission}, "MIS weights alone differ");
        add_factor(S::light_sampling, {light_density}, {light_weight, found_weight, PartsBy::light, emission},
            "the density of light sampling alone differs");
        // The radiance of points, spots and suns holds how it falls off, which is light sampling's (8.3).
        if (!partings.punctual_lights)
            add_factor(S::emission, {light_radiance}, {PartsBy::light}, "the radiance of sampled lights alone differs");
        // Scattering's own weight has the same density in it.
        add_factor(S::mis_weights, {density}, {light_weight, found_weight, PartsBy::light, emission},
            "the density of scattering differs, for MIS weights alone,");
    }

    void look_at_frames() {
        const std::string& frames = evidence_.partings.frames;
        if (!frames.empty() && !evidence_.place.outside_paths) add(S::arithmetic, certain, frames);
    }

    void look_at_primitives() {
        const std::string& primitives = evidence_.partings.primitives;
        if (!primitives.empty() && !evidence_.place.outside_paths) add(S::indexing, certain, primitives);
    }

    // An offset of rays that is too short does no harm in double precision either: then rays go elsewhere. Normals come
    // from the scene by way of other code in double precision, and kernels are others there. None of these is the cause
    // where intersections in double precision do not mend it. Where they do, and rays go the same way, no rounding of
    // theirs was the fault: the scene reaches the device another way.
    void look_at_precision() {
        if (evidence_.precision_trial == nullptr) return;
        const std::optional<bool> in_mixed = evidence_.precision_trial->right_in_mixed;
        const bool by_shading = in_mixed == false;
        const auto& by = evidence_.partings.by;
        double elsewhere = 0.0;
        for (const PartsBy what :
            {PartsBy::spawned, PartsBy::met, PartsBy::place, PartsBy::normal, PartsBy::shading_normal, PartsBy::shadow})
            elsewhere = std::max(elsewhere, by.at(static_cast<std::size_t>(what)));
        const bool same_way = elsewhere < 0.5 && evidence_.place.kernels_without.empty();
        const bool in_paths = !evidence_.place.outside_paths;
        const std::string words = told(*evidence_.precision_trial);
        if (same_way && in_mixed == true)
            return add(S::scene_data, strong, words + ", or its intersections alone, though rays go the same way");
        add(S::arithmetic, same_way || (by_shading && in_paths) ? certain : weak, words);
    }

    // A part that reads wrong data is needed as well. So needs say nothing against the data.
    void look_at_data() {
        if (evidence_.data_trial == nullptr) return;
        add(S::scene_data, evidence_.data_trial->fault.of_data_alone ? certain : strong / 2,
            told(*evidence_.data_trial));
    }

    // Nothing differs but under one condition, which is the work of one part.
    void look_at_levels() {
        std::string_view only;
        for (const LevelResult& level : evidence_.judgement.levels) {
            if (!level.significant) continue;
            if (!only.empty()) return;
            only = level.name;
        }
        if (only == size_level) add(S::indexing, certain, "films of other sizes alone differ");
        if (only == counter_level) add(S::random_numbers, certain, "great sample numbers and seeds alone differ");
    }

    void look_outside_paths() {
        const FaultPlace& place = evidence_.place;
        // The samples of such a pixel are all alike.
        if (!place.outside_paths && evidence_.partings.paths > 0 && evidence_.partings.parted == 0 &&
            evidence_.judgement.fixed.mismatches > 0)
            add(S::accumulation, certain,
                "no traced path parts, films of one block are the same, and pixels without variance differ in longer "
                "ones");
        if (!place.outside_paths) return;
        if (place.clamped_at)
            return add(S::accumulation, certain,
                fmt::format("a film is the sum of its paths, each cut at {:.4g}", *place.clamped_at));
        if (!place.kernels_with.empty() && !place.kernels_without.empty())
            return add(S::indexing, certain,
                fmt::format("no traced path parts, and the kernels {} are without the fault",
                    fmt::join(place.kernels_without, ", ")));
        if (place.moved) {
            add(S::accumulation, strong, "sums of other pixels' samples look alike");
            return add(S::indexing, certain, "no traced path parts, and the film's light lies in other pixels");
        }
        if (place.scaled)
            return add(S::accumulation, certain, "no traced path parts, and the film differs by one factor everywhere");
        if (!place.pattern.empty() && place.pattern != every_pixel)
            return add(S::indexing, certain, "no traced path parts, and the pixels that differ lie in a pattern");
        if (place.reference_adds && place.candidate_adds) return;
        // Sums are formed alike in all pixels.
        constexpr double few = 0.25;
        if (evidence_.partings.touched > 0.0 && evidence_.partings.touched < few) {
            add(S::accumulation, strong, "a film is not the sum of its paths");
            return add(S::indexing, certain,
                fmt::format("no traced path parts, and a film is not the sum of its paths in {} of the pixels",
                    percent(evidence_.partings.touched)));
        }
        add(S::accumulation, certain, "no traced path parts, and a film is not the sum of its paths");
        add(S::indexing, strong, "a path's state may be lost between stages, which traces do without");
    }

    void look_at_numbers() {
        const PathPartings& partings = evidence_.partings;
        if (partings.parted == 0 || evidence_.place.outside_paths) return;
        const bool agree = std::ranges::none_of(evidence_.judgement.levels,
            [](const LevelResult& level) { return level.significant && compares_means(level); });
        if (agree)
            add(S::random_numbers, means_agree, "paths part, and all means agree nevertheless");
        else
            scores_.at(index(S::random_numbers)) += means_differ;
        // A number that decides what it is not for breaks section 3, whatever else follows from it.
        if (partings.numbers.use != NumberUse::same)
            return add(
                S::random_numbers, partings.numbers.use == NumberUse::foreign ? certain : 0.0, partings.numbers.words);
        if (draws_are_independent(partings))
            add(S::random_numbers, 0.0,
                "most paths part, and their draws are as far apart as those of different samples");
    }

    const DifferenceEvidence& evidence_;
    const PartEvidence part_evidence_;
    const Scores counted_;
    Scores scores_;
    std::array<std::string, subsystem_names.size()> because_{};
};

}  // namespace

std::vector<Suspect> suspects_of_miss(const MissEvidence& evidence) {
    std::vector<Suspect> suspects;
    const auto add = [&](Subsystem part, std::string because) {
        if (suspects.size() < most_suspects && std::ranges::find(suspects, part, &Suspect::part) == suspects.end())
            suspects.push_back({part, std::move(because)});
    };
    std::vector<Subsystem> cleared;
    if (evidence.film) add(evidence.film->part, evidence.film->because);
    if (const MissedForm* const tried = evidence.tried) {
        cleared = cleared_parts(*tried);
        if (!tried->film.empty()) add(S::accumulation, tried->film);
        if (!tried->data.empty())
            add(S::scene_data,
                fmt::format("{} that were read are not what common/scene/scene.h promises", tried->data));
        for (const FormTrial& trial : tried->trials)
            if (trial.outcome == FormOutcome::met) add(trial.part, told(*tried, trial));
    }
    const auto is_in = [](const auto& list, const auto& one) { return std::ranges::find(list, one) != list.end(); };
    for (const bool last : {false, true})
        for (const bool excused : {false, true})
            for (const SceneFeature& feature : evidence.features)
                if (is_in(evidence.met, feature) == excused && is_in(cleared, feature.part) == last)
                    add(feature.part, clause_of(feature, evidence.met.empty() || excused));
    return suspects;
}

std::optional<Suspect> film_misses(const ClosedForm& form, const SampledImage& side) {
    const std::size_t pixels = std::size_t{side.width} * side.height;
    const double allowed = 2.0 * form.rounding;  // relative: the side's, and the form's
    const auto is_times = [&](std::size_t pixel, double factor) {
        bool same = true;
        for (std::size_t c = 0; c < channel_count; ++c) {
            const double expected = factor * form.radiance[c];
            same = same && std::abs(side.pixels[pixel * channel_count + c].mean - expected) <= allowed * expected;
        }
        return same;
    };
    std::size_t off = 0;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) off += is_times(pixel, 1.0) ? 0 : 1;
    if (off > 0 && 10 * off <= pixels)
        return Suspect{S::accumulation,
            fmt::format("{} of {} pixels are off, and all others have the closed form's value", off, pixels)};
    const auto samples = static_cast<double>(side.samples);
    if (off < pixels || pixels == 0 || !(samples > 1.0) || 1.0 / samples < 2.0 * allowed) return std::nullopt;
    for (const double divisor : {samples - 1.0, samples + 1.0}) {
        std::size_t right = 0;
        for (std::size_t pixel = 0; pixel < pixels; ++pixel) right += is_times(pixel, samples / divisor) ? 1 : 0;
        if (right == pixels)
            return Suspect{
                S::accumulation, fmt::format("all pixels have the closed form's value times {} / {}, with {} samples",
                                     side.samples, divisor, side.samples)};
    }
    return std::nullopt;
}

RankedSuspects suspects_of_difference(const DifferenceEvidence& evidence, const BugRecord& record) {
    return Ranking(evidence, record).ranked();
}

std::vector<Suspect> suspects_of(const Misreading& misreading) {
    using Reader = std::pair<std::string_view, S>;
    constexpr std::array sections{Reader{"/camera", S::camera}, Reader{"/background", S::emission},
        Reader{"/media", S::volumes}, Reader{"/textures", S::textures}, Reader{"/render/bounces", S::roulette},
        Reader{"/render/roulette_start", S::roulette}};
    for (const auto& [section, part] : sections)
        if (misreading.pointer.starts_with(section)) return {{part, misreading.words}};
    std::vector<Suspect> suspects{{S::scene_data, misreading.words}};
    constexpr std::array fields{Reader{"roughness", S::bsdf}, Reader{"fuzz", S::bsdf}, Reader{"eta", S::bsdf},
        Reader{"k", S::bsdf}, Reader{"colour", S::bsdf}, Reader{"refractive_index", S::dielectric},
        Reader{"fresnel", S::dielectric}, Reader{"priority", S::dielectric}, Reader{"radiance", S::emission},
        Reader{"sides", S::emission}, Reader{"alpha", S::emission}, Reader{"interior", S::volumes}};
    constexpr std::string_view materials = "/materials/";
    const std::string& pointer = misreading.pointer;
    const std::size_t name_ends = pointer.find('/', materials.size());
    if (!pointer.starts_with(materials) || name_ends == std::string::npos) return suspects;
    const std::string field = pointer.substr(name_ends + 1, pointer.find('/', name_ends + 1) - name_ends - 1);
    const auto reader = std::ranges::find(fields, std::string_view(field), &Reader::first);
    if (reader != fields.end()) suspects.push_back({reader->second, "which reads " + field});
    return suspects;
}

std::string told(std::span<const Suspect> suspects) {
    std::vector<std::string> each;
    for (const Suspect& suspect : suspects)
        each.push_back(fmt::format("{} ({})", name_of(suspect.part), suspect.because));
    return fmt::format("suspect {}", fmt::join(each, "; then "));
}

}  // namespace tandem
