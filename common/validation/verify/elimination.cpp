#include "common/validation/verify/elimination.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "common/error.h"
#include "common/statistics/mean_tests.h"
#include "common/text.h"
#include "common/validation/verdict/tile_grid.h"

namespace tandem {

namespace {

using Plane = Estimate::Plane;

constexpr std::uint64_t samples_at_once = 4;
constexpr std::uint64_t fewest_batches = 4, most_batches = 256;
constexpr double false_difference = 1e-4;  // a scene's chance
constexpr double deviations = 3.0;
constexpr double part_that_remains = 1.0 / 3.0;  // of a difference that is no longer there, at most
// Shares of sums that rounding may part. In edited scenes that may be more than in the whole one: paths are others.
constexpr double rounding_unknown = 0.05, rounding_floor = 5e-4, rounding_growth = 4.0;

// Differences of the image and its tiles by channel, over pixels and batches. Where chance alone parts paths, they are
// as often above 0 as below, so symmetric_sum_tail bounds their sum.
class PairedSums {
public:
    PairedSums(const RenderSettings& settings, const Criteria& criteria)
        : grid_(settings.width, settings.height, standard_tile_edge),
          criteria_(criteria),
          regions_((grid_.size() + 1) * channel_count) {}

    void add(const Plane& a, const Plane& b) {
        const double rounding = coarsest_operation * criteria_.fixed_tolerance;
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double larger = std::max(std::abs(a[i].sum), std::abs(b[i].sum)), apart = b[i].sum - a[i].sum;
            const double difference = std::abs(apart) > rounding * larger ? apart : 0.0;
            const std::size_t tile = grid_.tile_of_pixel()[i / channel_count] + 1, channel = i % channel_count;
            for (const std::size_t region : {std::size_t{0}, tile}) {
                Region& r = regions_[region * channel_count + channel];
                r.difference += difference;
                r.squares += difference * difference;
                r.reference += std::abs(a[i].sum);
                r.sums += 1.0;
            }
        }
        for (const SampleState state : compare_samples(a, b, gone_elsewhere)) counts_.add(state);
        all_ += a.size() / channel_count;
    }

    // `region`: where to look; nothing: where the means differ most surely, which it becomes.
    [[nodiscard]] PairedLook look(std::optional<std::size_t>& region) const {
        PairedLook look;
        look.sums = counts_;
        look.lit_share = all_ > 0 ? static_cast<double>(counts_.lit) / static_cast<double>(all_) : 0.0;
        std::size_t worst = 0;
        for (std::size_t i = 0; i < regions_.size(); ++i) {
            const double scale = scale_of(i), beyond = std::abs(regions_[i].difference) - negligible(i) * scale;
            if (!(beyond > 0.0) || !(regions_[i].squares > 0.0)) continue;
            const double p = symmetric_sum_tail(beyond / std::sqrt(regions_[i].squares));
            if (p < look.p) worst = i;
            look.p = std::min(look.p, p);
        }
        look.p = std::min(1.0, look.p * static_cast<double>(regions_.size()));
        if (!region) region = worst;
        const double scale = scale_of(*region);
        if (scale > 0.0) look.relative = regions_[*region].difference / scale;
        if (scale > 0.0) look.error = std::sqrt(regions_[*region].squares) / scale;
        return look;
    }

private:
    struct Region {
        double difference = 0.0, squares = 0.0, reference = 0.0, sums = 0.0;
    };
    [[nodiscard]] double negligible(std::size_t i) const {
        return i < channel_count ? criteria_.negligible.paired_image : criteria_.negligible.paired_tile;
    }
    // As Margins has it.
    [[nodiscard]] double scale_of(std::size_t i) const {
        const Region &r = regions_[i], &image = regions_[i % channel_count];
        double grey = 0.0;
        for (std::size_t c = 0; c < channel_count; ++c) grey += regions_[c].reference / channel_count;
        const double floor = i < channel_count ? 1.0 : criteria_.margins.tile_floor;
        const double bright = std::max(image.reference, criteria_.margins.channel_floor * grey) * floor;
        return std::max(r.reference, bright * r.sums / image.sums);
    }

    TileGrid grid_;
    const Criteria& criteria_;
    std::vector<Region> regions_;  // the image, then tiles; by channel
    SampleCount counts_;
    std::uint64_t all_ = 0;
};

// Whether light can be scattered at all.
bool scatters(const Scene& scene) {
    return std::ranges::any_of(scene.entities, [&](const Entity& entity) {
        const Material& material = scene.materials[entity.material];
        return entity.primitive_count > 0 && material.kind != MaterialKind::boundary &&
               (material.kind != MaterialKind::emissive || material.translucent);
    });
}

double share_error(const SampleCount& count) {
    const double lit = std::max(1.0, static_cast<double>(count.lit)), share = count.share();
    return std::sqrt(share * (1.0 - share) / lit) + 1.0 / lit;
}

class Experiments {
public:
    explicit Experiments(const EliminationQuestion& question)
        : question_(question),
          reference_(&question.reference),
          candidate_(&question.candidate),
          start_(question.now()),
          features_(removable_features(question.scene, question.settings)) {
        for (const SceneFeature& feature : features_)
            result_.trials.push_back({.feature = feature, .with = {}, .without = {}});
        last_seconds_ = question.expected_seconds;
        use_one_kernel();
    }

    Elimination run() {
        if (look_at_whole()) {
            out_.assign(features_.size(), false);
            move_limit();
            reduce_all();
            look_longer();
            if (late_) result_.left_out = "no time was left for the rest";
        }
        result_.seconds = since_start();
        return std::move(result_);
    }

private:
    enum class Stays : std::uint8_t { yes, no, unknown };
    using Some = std::span<const std::size_t>;

    // Kernels are made for effects, which takes longer than to render: for all scenes the same ones.
    void use_one_kernel() {
        EditedScene diffuse{question_.scene, question_.settings};
        for (const SceneFeature& feature : features_)
            if (feature.part == Subsystem::bsdf || feature.part == Subsystem::dielectric) feature.take_out(diffuse);
        effects_ =
            needed_effects(question_.scene, question_.settings).united(needed_effects(diffuse.scene, diffuse.settings));
    }

    [[nodiscard]] double since_start() const { return question_.now() - start_; }
    [[nodiscard]] bool in_time(double seconds) const {
        return !question_.stop.stop_requested() && since_start() + seconds <= question_.budget_seconds;
    }

    [[nodiscard]] EditedScene without(const std::vector<bool>& out) const {
        EditedScene edited{question_.scene, question_.settings};
        for (std::size_t i = 0; i < out.size(); ++i)
            if (out[i]) features_[i].take_out(edited);
        if (!edited.settings.effects)
            edited.settings.effects = effects_.united(needed_effects(edited.scene, edited.settings));
        return edited;
    }

    using Jobs = std::array<std::unique_ptr<RenderJob>, 2>;
    [[nodiscard]] std::optional<Plane> batch(RenderJob& job, std::uint64_t k, std::uint64_t& invalid) const {
        RenderControl control;
        control.stop = question_.stop;
        const std::uint64_t begin = k * samples_per_block;
        const RenderResult rendered = job.render({begin, begin + samples_at_once}, control);
        invalid += rendered.estimate.invalid();
        if (rendered.estimate.count() != samples_at_once) return std::nullopt;
        return rendered.estimate.totals();
    }

    // Batches [begin, end) more; false: stopped.
    [[nodiscard]] bool extend(
        Jobs& jobs, PairedSums& sums, std::uint64_t begin, std::uint64_t end, std::uint64_t& invalid) const {
        for (std::uint64_t k = begin; k < end; ++k) {
            const std::optional<Plane> a = batch(*jobs[0], k, invalid);
            const std::optional<Plane> b = a ? batch(*jobs[1], k, invalid) : std::nullopt;
            if (!b) return false;
            sums.add(*a, *b);
        }
        return true;
    }

    // Twice as many samples as before, until `decided` says so; nothing: stopped, or no time for the first ones.
    template <typename Decided>
    [[nodiscard]] std::optional<PairedLook> look_at(
        const EditedScene& edited, double until, std::uint64_t most, const Decided& decided) {
        if (question_.progress) question_.progress(fmt::format("features taken out, scene {}", result_.scenes + 1));
        const double start = since_start();
        RenderSettings of_candidate = edited.settings;
        of_candidate.bounces =
            static_cast<std::uint32_t>(static_cast<std::int64_t>(of_candidate.bounces) + candidate_bounces_);
        Jobs jobs{reference_->prepare(edited.scene, edited.settings), candidate_->prepare(edited.scene, of_candidate)};
        PairedSums sums(edited.settings, question_.criteria);
        PairedLook look;
        std::uint64_t invalid = 0;
        for (std::uint64_t done = 0, next = fewest_batches; next <= most; next *= 2) {
            const double before = since_start();
            if (!extend(jobs, sums, done, next, invalid)) return std::nullopt;
            look = sums.look(region_);
            look.invalid = invalid;
            look.pairs = next * samples_at_once;
            done = next;
            const double taken = since_start() - before;
            if (next == fewest_batches) last_seconds_ = since_start() - start;
            if (decided(look) || since_start() + 2.0 * taken > until || question_.stop.stop_requested()) break;
            if (result_.scenes == 0) region_.reset();  // of the whole scene: where it differs most surely at the end
        }
        ++result_.scenes;
        return look;
    }

    // What rounding alone parts of the whole scene's samples, with room.
    [[nodiscard]] double rounding_share() const {
        if (question_.other_precision == nullptr) return rounding_unknown;
        const EditedScene edited = without({});
        const auto a = question_.reference.prepare(edited.scene, edited.settings);
        const auto b = question_.other_precision->prepare(edited.scene, edited.settings);
        std::uint64_t invalid = 0;
        SampleCount parted;
        for (std::uint64_t k = 0; k < fewest_batches; ++k) {
            const std::optional<Plane> x = batch(*a, k, invalid), y = x ? batch(*b, k, invalid) : std::nullopt;
            if (!y) return rounding_unknown;
            for (const SampleState state : compare_samples(*x, *y, gone_elsewhere)) parted.add(state);
        }
        return rounding_growth * share_limit(parted) + rounding_floor;
    }

    [[nodiscard]] bool look_at_whole() {
        if (features_.empty() || !in_time(2.0 * last_seconds_)) {
            result_.left_out = features_.empty() ? "the scene has none" : "no time was left";
            return false;
        }
        rounding_ = question_.same_samples ? rounding_share() : 1.0;
        const auto shows = [&](const PairedLook& look) {
            return look.invalid > 0 || parts(look) || look.p < false_difference;
        };
        constexpr double part_of_budget = 0.25;
        const std::optional<PairedLook> look =
            look_at(without({}), part_of_budget * question_.budget_seconds, most_batches, shows);
        if (!look || !shows(*look)) {
            result_.left_out =
                look ? fmt::format("undecided, as {} pairs a pixel do not show the difference", look->pairs)
                     : "stopped";
            return false;
        }
        result_.whole = with_ = *look;
        result_.by_samples = parts(*look);
        by_means_ = look->p < false_difference;
        return true;
    }

    // A few samples show that some part; that none does takes more. False as well where a side refuses the scene.
    [[nodiscard]] bool same_samples(const EditedScene& edited) {
        constexpr double part_of_rest = 0.1;
        const auto same = [&](const PairedLook& one) {
            return one.invalid == 0 && one.p >= false_difference && parts_no_more(one);
        };
        const auto decided = [&](const PairedLook& one) { return same(one) || one.invalid > 0 || parts(one); };
        const double now = since_start();
        const double until = now + std::max(last_seconds_, part_of_rest * (question_.budget_seconds - now));
        try {
            const std::optional<PairedLook> look = look_at(edited, until, most_batches, decided);
            return look && same(*look);
        } catch (const UnsupportedError&) {
            return false;
        }
    }

    // Whether the candidate's limit of bounces is one off. Samples tell that are the same again, as hardly another
    // fault is undone by other paths. So means do not.
    void move_limit() {
        if (!result_.by_samples) return;
        for (const int by : {1, -1}) {
            if ((by < 0 && question_.settings.bounces == 0) || !in_time(1.2 * last_seconds_)) continue;
            candidate_bounces_ = by;
            if (same_samples(without({}))) result_.bounces_off = by;
            candidate_bounces_ = 0;
            if (result_.bounces_off) return;
        }
    }

    // More samples part than rounding can explain.
    [[nodiscard]] bool parts(const PairedLook& look) const {
        return look.sums.share() - deviations * share_error(look.sums) > rounding_;
    }
    [[nodiscard]] bool parts_no_more(const PairedLook& look) const {
        const double most = look.sums.share() + deviations * share_error(look.sums);
        return most < rounding_ && most < part_that_remains * with_.sums.share();
    }
    [[nodiscard]] bool shifts_no_more(const PairedLook& look) const {
        constexpr double sure = 5.0;
        const bool seen_there = std::abs(with_.relative) > sure * with_.error;
        const double before = std::abs((seen_there ? with_ : result_.whole).relative);
        return std::abs(look.relative) + deviations * look.error < part_that_remains * before;
    }

    [[nodiscard]] Stays judge(const PairedLook& look) const {
        constexpr double darkened = 0.05;
        if (look.invalid > 0) return Stays::yes;
        if ((result_.by_samples && parts(look)) || look.p < false_difference) return Stays::yes;
        if (look.lit_share < darkened * with_.lit_share) return Stays::unknown;
        if (result_.by_samples) return parts_no_more(look) ? Stays::no : Stays::unknown;
        if (by_means_) return shifts_no_more(look) ? Stays::no : Stays::unknown;
        return Stays::no;  // invalid samples alone told
    }

    // Whether the difference stays without what is out already and without these.
    [[nodiscard]] Stays without_these(Some some, std::optional<PairedLook>& look) {
        if (!in_time(1.2 * last_seconds_)) {
            late_ = true;
            return Stays::unknown;
        }
        std::vector<bool> out = out_;
        for (const std::size_t i : some) out[i] = true;
        const EditedScene edited = without(out);
        if (!scatters(edited.scene)) return Stays::unknown;
        try {
            const std::uint64_t usual = std::max(4 * fewest_batches, 4 * result_.whole.pairs / samples_at_once);
            const std::uint64_t most = longer_ ? most_batches : std::min(most_batches, usual);
            constexpr double part_of_rest = 0.25;  // others are to be tried, too
            const double now = since_start(), until = now + part_of_rest * (question_.budget_seconds - now);
            look = look_at(edited, until, most, [&](const PairedLook& one) { return judge(one) != Stays::unknown; });
            return look ? judge(*look) : Stays::unknown;
        } catch (const UnsupportedError&) {
            return Stays::unknown;  // a side cannot do without
        }
    }

    void settle(std::size_t i, Need need, const std::optional<PairedLook>& without) {
        FeatureTrial& trial = result_.trials[i];
        trial.need = need;
        trial.without = without;
        trial.with = with_;
        if (need == Need::not_needed) out_[i] = true;
    }

    // ended: what was seen without all of these, if it is known that there is no difference.
    void reduce(Some some, const std::optional<PairedLook>& ended = {}) {
        if (some.empty() || late_) return;
        std::optional<PairedLook> look = ended;
        const Stays stays = ended ? Stays::no : without_these(some, look);
        if (stays == Stays::yes) {
            for (const std::size_t i : some) settle(i, Need::not_needed, look);
            with_ = *look;
            return;
        }
        if (some.size() == 1) {
            settle(some.front(), stays == Stays::no ? Need::needed : Need::unknown, look);
            return;
        }
        const Some first = some.first(some.size() / 2), rest = some.subspan(first.size());
        reduce(first);
        const bool first_out = std::ranges::all_of(first, [&](std::size_t i) { return out_[i]; });
        reduce(rest, stays == Stays::no && first_out ? look : std::nullopt);
    }

    // Short paths first, as they make all that follows sooner; then what is suspected least.
    void reduce_all() {
        std::vector<std::size_t> order(features_.size());
        std::iota(order.rbegin(), order.rend(), std::size_t{0});
        const auto suspicion = [&](std::size_t i) {
            return question_.suspicion.empty() ? 0.0
                                               : question_.suspicion.at(static_cast<std::size_t>(features_[i].part));
        };
        const auto others = std::stable_partition(
            order.begin(), order.end(), [&](std::size_t i) { return features_[i].naming == Naming::nobody; });
        std::stable_sort(
            others, order.end(), [&](std::size_t a, std::size_t b) { return suspicion(a) < suspicion(b); });
        const Some all(order);
        const auto short_paths = static_cast<std::size_t>(others - order.begin());
        reduce(all.first(short_paths));
        reduce(all.subspan(short_paths));
    }

    // At what is not known by then.
    void look_longer() {
        longer_ = true;
        for (std::size_t i = 0; i < features_.size(); ++i)
            if (result_.trials[i].need == Need::unknown) reduce(Some(&i, 1));
    }

    const EliminationQuestion& question_;
    Renderer *reference_, *candidate_;  // double precision for a while
    double start_;
    std::vector<SceneFeature> features_;
    EffectSet effects_;
    std::optional<std::size_t> region_;
    double rounding_ = 0.0;
    double last_seconds_ = 0.0;  // of the last scene, to its first look
    bool by_means_ = false, late_ = false, longer_ = false;
    int candidate_bounces_ = 0;  // more than the reference's
    std::vector<bool> out_;
    PairedLook with_;  // the plainest scene yet that differs
    Elimination result_;
};

std::string figures(const Elimination& elimination, const PairedLook& look, bool all) {
    if (elimination.by_samples)
        return fmt::format("{} of the sums of {} samples part", percent(look.sums.share()), samples_at_once);
    if (elimination.whole.p >= false_difference) return fmt::format("{} are invalid", look.invalid);
    if (!all) return percent(std::abs(look.relative));
    if (constexpr double shown = 1e-6; std::abs(look.relative) + 2.0 * look.error < shown)
        return fmt::format("difference below {}", percent(shown));
    return fmt::format("difference {} ± {}", percent(std::abs(look.relative)), percent(2.0 * look.error));
}

}  // namespace

Elimination eliminate(const EliminationQuestion& question) { return Experiments(question).run(); }

std::vector<Subsystem> cleared_parts(const Elimination& elimination) {
    std::vector<Subsystem> parts;
    for (const FeatureTrial& trial : elimination.trials) {
        const Subsystem part = trial.feature.part;
        const bool out = std::ranges::all_of(elimination.trials,
            [&](const FeatureTrial& one) { return one.feature.part != part || one.need == Need::not_needed; });
        if (out && trial.feature.whole && std::ranges::find(parts, part) == parts.end()) parts.push_back(part);
    }
    return parts;
}

std::string told(const Elimination& elimination, const FeatureTrial& needed) {
    return fmt::format("the sides agree without {}: {} pairs a pixel, {}; with it {}", needed.feature.words,
        needed.without ? needed.without->pairs : 0, figures(elimination, needed.without.value_or(PairedLook{}), true),
        figures(elimination, needed.with, false));
}

std::string told_of_bounces(const Elimination& elimination) {
    return fmt::format("with one bounce {} the candidate has the samples of the reference",
        elimination.bounces_off.value_or(0) > 0 ? "more" : "fewer");
}

std::string told(const Elimination& elimination) {
    if (elimination.scenes <= 1 || elimination.trials.empty())
        return fmt::format("no feature was taken out: {}", elimination.left_out);
    std::string text =
        fmt::format("features taken out on both sides, {} scenes in {:.1f} s", elimination.scenes, elimination.seconds);
    for (const Need need : {Need::needed, Need::not_needed, Need::unknown}) {
        std::vector<std::string_view> words;
        for (const FeatureTrial& trial : elimination.trials)
            if (trial.need == need) words.push_back(trial.feature.words);
        if (!words.empty())
            text += fmt::format("; {}: {}", need_names.at(static_cast<std::size_t>(need)), fmt::join(words, ", "));
    }
    if (elimination.bounces_off) text += "; " + told_of_bounces(elimination);
    if (!elimination.left_out.empty()) text += "; " + elimination.left_out;
    return text;
}

}  // namespace tandem
