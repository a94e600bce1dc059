#include "common/validation/explanation/likeness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace tandem {

namespace {

constexpr std::size_t neighbours = 5;  // kinds of bugs that vote
// A row that is nearer than this says no more than one at this distance: two runs of one bug lie about so far apart.
constexpr double own_distance = 0.5;
constexpr std::size_t most_bugs = 2, most_subsystems = 3;
constexpr std::array sureness_bands{0.8, 0.5, 0.0};  // bounds, from above
// So many in a hundred of the record's own rows are further from all other kinds than what counts as near.
constexpr double far_share = 0.05;

// What parts the paths tells most of a fault, and where next. Shapes, depths and the scene's effects are as much the
// scene's as the fault's. Chosen by that reasoning, not fitted.
constexpr std::array<float, figure_count> weights = [] {
    std::array<float, figure_count> all{};
    const auto set = [&all](float weight, Figure first, Figure last) {
        for (auto i = static_cast<std::size_t>(first); i <= static_cast<std::size_t>(last); ++i) all[i] = weight;
    };
    set(0.5F, Figure::parted, Figure::diverged);
    set(2.0F, Figure::by_camera, Figure::by_sum);
    set(1.0F, Figure::at_nothing, Figure::at_boundary);
    set(0.25F, Figure::on_triangle, Figure::on_cuboid);
    set(1.0F, Figure::on_texture, Figure::on_texture);
    set(0.25F, Figure::vertex_0, Figure::vertex_9);
    set(1.0F, Figure::ratio_colour, Figure::ratio_colour);
    set(3.0F, Figure::film_apart, Figure::film_apart);
    set(2.0F, Figure::high_counters, Figure::high_counters);
    for (const Figure coarse : {Figure::pattern, Figure::image, Figure::concentrated, Figure::diverged})
        set(0.25F, coarse, coarse);
    set(0.25F, Figure::scene_light_sampling, Figure::scene_volumes);
    return all;
}();

constexpr Subsystem subsystem_named(std::string_view name) {
    for (std::size_t i = 0; i < subsystem_names.size(); ++i)
        if (subsystem_names[i] == name) return static_cast<Subsystem>(i);
    return Subsystem::count;
}

std::size_t band_of(double sureness) {
    std::size_t band = 0;
    while (sureness < sureness_bands.at(band)) ++band;
    return band;
}

// A subsystem without work in the scene is not at fault.
bool has_work(Subsystem subsystem, const Signature& signature) {
    switch (subsystem) {
        case Subsystem::light_sampling:
        case Subsystem::mis_weights:
            return signature[Figure::scene_light_sampling] > 0.0F;
        case Subsystem::dielectric:
            return signature[Figure::scene_dielectric] > 0.0F;
        case Subsystem::textures:
            return signature[Figure::scene_textures] > 0.0F;
        case Subsystem::volumes:
            return signature[Figure::scene_volumes] > 0.0F;
        default:
            return true;
    }
}

// What a reader of the figures would conclude by himself, 0 ... 1 each: rays of the camera that differ are the
// camera's, surfaces met in its stead geometry's, and so on. It stands in for kinds that the record does not hold.
Scores conclusions(const Signature& signature) {
    const auto f = [&](Figure figure) { return static_cast<double>(signature[figure]); };
    const auto most = [&](std::initializer_list<Figure> figures) {
        double greatest = 0.0;
        for (const Figure figure : figures) greatest = std::max(greatest, f(figure));
        return greatest;
    };
    using F = Figure;
    const double scattering = std::min(1.0, f(F::by_weight) + f(F::by_direction) + f(F::by_density));
    const double surface = f(F::at_diffuse) + f(F::at_rough_diffuse) + f(F::at_mirror) + f(F::at_conductor);
    const double glass = f(F::at_dielectric) + f(F::at_boundary), untextured = 1.0 - f(F::on_texture);
    // What comes from a light to a texture may be either's fault.
    const double unclear = 1.0 - 0.5 * f(F::on_texture);
    // A weight that is wrong though the density of light sampling is right.
    const double weighted = most({F::by_found_weight, F::by_light_weight}) * (1.0 - f(F::by_light_density));
    const double answered = f(F::by_light_response) * (1.0 - f(F::by_light_density));
    // No path parts: then films that are apart err by themselves, and not as rounding parts what is added.
    const double together = 1.0 - f(F::parted);
    Scores scores{};
    const auto set = [&](Subsystem subsystem, double score) { scores.at(static_cast<std::size_t>(subsystem)) = score; };
    set(Subsystem::camera, f(F::by_camera));
    // Where a next event from within a medium looks for light, and what is in its way, is not the medium's work.
    const double within = f(F::at_medium) * (1.0 - most({F::by_shadow, F::by_light_direction}));
    set(Subsystem::volumes, std::max(within, most({F::by_throughput, F::by_light_transmittance})));
    set(Subsystem::dielectric, glass * std::max(scattering, most({F::by_end, F::by_emission})));
    set(Subsystem::textures,
        f(F::on_texture) * std::max({f(F::by_weight), answered, 0.5 * f(F::by_light)}) * (1.0 - f(F::by_direction)));
    // Roulette weighs paths from some vertex on; what scatters does so from the first.
    const double late = std::max(0.0, 1.0 - f(F::vertex_0) - f(F::vertex_1));
    set(Subsystem::roulette,
        std::max({f(F::by_survival), f(F::by_end) * (1.0 - f(F::at_dielectric)) * (1.0 - f(F::at_medium)),
            f(F::by_weight) * f(F::scene_roulette) * late}));
    set(Subsystem::light_sampling,
        std::max(f(F::by_light_density), most({F::by_light, F::by_light_direction, F::by_shadow}) *
                                             (1.0 - std::max({scattering, weighted, answered})) * unclear));
    set(Subsystem::mis_weights, weighted);
    set(Subsystem::emission, std::max(f(F::by_emission) * (1.0 - weighted), f(F::by_light_radiance)));
    set(Subsystem::bsdf, std::max(scattering, answered) * surface * untextured);
    // A shadow ray ends differently by the length that it was given, or by what it meets.
    set(Subsystem::geometry,
        std::max(f(F::by_shadow), most({F::by_met, F::by_normal, F::by_shading_normal, F::by_place, F::by_spawned}) *
                                      (1.0 - f(F::at_medium))));
    set(Subsystem::accumulation, std::max(f(F::by_sum), together * f(F::film_apart) * (1.0 - f(F::pattern))));
    set(Subsystem::indexing, together * std::max(f(F::film_apart) * f(F::pattern), f(F::sizes) - f(F::short_paths)));
    // Other numbers part paths and keep the mean; noise alone makes tiles differ, to both sides. Half, as much else
    // may.
    const double mean_kept = f(F::parted) * (1.0 - f(F::one_sign)) * (1.0 - f(F::image));
    set(Subsystem::random_numbers, std::max(together * most({F::high_counters, F::first_counter}), 0.5 * mean_kept));
    // Coarse arithmetic changes what paths bring by less than 1 % (a third on the scale of octaves), and not their way.
    const double way = most({F::by_camera, F::by_met, F::by_normal, F::by_shadow, F::by_light_direction, F::by_end,
        F::by_direction, F::at_medium});
    set(Subsystem::arithmetic, most({F::by_throughput, F::by_light, F::by_emission, F::by_weight, F::by_sum}) *
                                   (1.0 - way) * f(F::parted) *
                                   std::max(0.0, 1.0 - 3.0 * most({F::ratio, F::ratio_spread})));
    return scores;
}

struct Kind {
    std::string_view bug;
    Subsystem subsystem;
    double distance;  // of its nearest row
};

std::vector<Kind> kinds_by_distance(
    const Signature& signature, std::span<const PlantedSignature> rows, std::string_view left_out) {
    std::map<std::string_view, Kind> kinds;
    for (const PlantedSignature& row : rows) {
        if (row.bug == left_out || !has_work(row.subsystem, signature)) continue;
        const double d = distance(signature, row.signature);
        const auto found = kinds.try_emplace(row.bug, Kind{row.bug, row.subsystem, d}).first;
        found->second.distance = std::min(found->second.distance, d);
    }
    std::vector<Kind> result;
    for (const auto& [bug, kind] : kinds) result.push_back(kind);
    std::ranges::stable_sort(result, {}, &Kind::distance);
    return result;
}

// The kinds of a subsystem share one vote: how many the record happens to have says nothing of a fault.
Scores scores_by(const std::vector<Kind>& kinds, const Signature& signature) {
    Scores scores{}, recorded{};
    for (const Kind& kind : kinds) recorded.at(static_cast<std::size_t>(kind.subsystem)) += 1.0;
    double all = 0.0;
    for (std::size_t i = 0; i < std::min(neighbours, kinds.size()); ++i) {
        const auto subsystem = static_cast<std::size_t>(kinds[i].subsystem);
        const double near = kinds[i].distance * kinds[i].distance + own_distance * own_distance;
        const double weight = 1.0 / (near * recorded.at(subsystem));
        scores.at(subsystem) += weight;
        all += weight;
    }
    const Scores concluded = conclusions(signature);
    for (std::size_t i = 0; i < scores.size(); ++i) scores[i] = (all > 0.0 ? scores[i] / all : 0.0) + concluded[i];
    return scores;
}

// How each row of the record fares when its kind is left out.
struct Trial {
    std::size_t band = 0;
    bool right = false;
    double nearest = 0.0;
};

std::vector<Trial> trials_of(std::span<const PlantedSignature> rows) {
    std::vector<Trial> trials;
    for (const PlantedSignature& row : rows) {
        const std::vector<Kind> kinds = kinds_by_distance(row.signature, rows, row.bug);
        const std::optional<Likeness> likeness = vote(row.signature, rows, row.bug);
        if (likeness)
            trials.push_back(
                {band_of(likeness->sureness), likeness->subsystems.front() == row.subsystem, kinds.front().distance});
    }
    return trials;
}

PlantedSignature row(std::string_view bug, std::string_view planting, std::string_view subsystem,
    const std::array<std::int16_t, figure_count>& thousandths) {
    PlantedSignature result{bug, planting, subsystem_named(subsystem), {}};
    for (std::size_t i = 0; i < figure_count; ++i)
        result.signature.figures[i] = static_cast<float>(thousandths[i]) / 1000.0F;
    return result;
}

}  // namespace

std::span<const PlantedSignature> planted_signatures() {
    static const std::vector<PlantedSignature> rows{
#define SIGNATURE(bug, planting, subsystem, ...) row(bug, planting, subsystem, {__VA_ARGS__}),
#include "common/validation/explanation/planted_signatures.def"
#undef SIGNATURE
    };
    return rows;
}

double distance(const Signature& a, const Signature& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < figure_count; ++i)
        sum += static_cast<double>(weights[i] * std::abs(a.figures[i] - b.figures[i]));
    return sum;
}

Scores scores_of(const Signature& signature, std::span<const PlantedSignature> rows, std::string_view left_out) {
    Scores scores = scores_by(kinds_by_distance(signature, rows, left_out), signature);
    for (std::size_t i = 0; i < scores.size(); ++i)
        if (!has_work(static_cast<Subsystem>(i), signature)) scores[i] = 0.0;
    return scores;
}

std::optional<Likeness> vote(
    const Signature& signature, std::span<const PlantedSignature> rows, std::string_view left_out) {
    const std::vector<Kind> kinds = kinds_by_distance(signature, rows, left_out);
    if (kinds.empty()) return std::nullopt;
    const Scores scores = scores_by(kinds, signature);
    Likeness likeness;
    // Those without a score follow by the distance of their nearest kind.
    for (const Kind& kind : kinds)
        if (std::ranges::find(likeness.subsystems, kind.subsystem) == likeness.subsystems.end())
            likeness.subsystems.push_back(kind.subsystem);
    for (std::size_t i = 0; i < scores.size(); ++i)
        if (const auto subsystem = static_cast<Subsystem>(i);
            scores[i] > 0.0 && has_work(subsystem, signature) &&
            std::ranges::find(likeness.subsystems, subsystem) == likeness.subsystems.end())
            likeness.subsystems.push_back(subsystem);
    const auto score_of = [&](Subsystem subsystem) { return scores.at(static_cast<std::size_t>(subsystem)); };
    std::ranges::stable_sort(likeness.subsystems, std::greater{}, score_of);
    likeness.sureness = score_of(likeness.subsystems.front()) / std::accumulate(scores.begin(), scores.end(), 0.0);
    for (const Kind& kind : kinds)
        if (kind.subsystem == likeness.subsystems.front() && likeness.bugs.size() < most_bugs)
            likeness.bugs.push_back(kind.bug);
    if (likeness.subsystems.size() > most_subsystems) likeness.subsystems.resize(most_subsystems);
    return likeness;
}

std::optional<Likeness> likeness_of(const Signature& signature, std::span<const PlantedSignature> rows) {
    std::optional<Likeness> likeness = vote(signature, rows);
    if (!likeness) return std::nullopt;
    std::vector<Trial> trials = trials_of(rows);
    std::ranges::sort(trials, {}, &Trial::nearest);
    const auto last_near = static_cast<std::size_t>((1.0 - far_share) * static_cast<double>(trials.size()));
    const double nearest = kinds_by_distance(signature, rows, {}).front().distance;
    if (trials.empty() || nearest > trials.at(std::min(last_near, trials.size() - 1)).nearest) return std::nullopt;
    for (const Trial& trial : trials) {
        if (trial.band != band_of(likeness->sureness)) continue;
        ++likeness->of;
        likeness->right += trial.right ? 1 : 0;
    }
    return likeness;
}

std::string told(const Likeness& likeness) {
    std::vector<std::string_view> names;
    for (const Subsystem subsystem : likeness.subsystems)
        names.push_back(subsystem_names.at(static_cast<std::size_t>(subsystem)));
    std::string where(names.front());
    if (names.size() > 1) where += fmt::format("; else {}", fmt::join(names.begin() + 1, names.end(), " or "));
    const std::string bugs =
        likeness.bugs.empty() ? "no planted bug of it" : fmt::format("{}", fmt::join(likeness.bugs, ", "));
    return fmt::format("errs like {} ({}): right for {} of {} planted bugs", bugs, where, likeness.right, likeness.of);
}

}  // namespace tandem
