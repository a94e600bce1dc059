#include "common/validation/explanation/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/text.h"
#include "common/validation/compare/colour_space.h"
#include "common/validation/explanation/plain_facts.h"
#include "common/validation/explanation/shift_fit.h"
#include "common/validation/explanation/tone_fit.h"

namespace tandem {

namespace {

constexpr std::size_t most_names = 3;

class Explainer {
public:
    Explainer(ImagePair pair, const Criteria& criteria)
        : pair_(std::move(pair)), criteria_(criteria), interpolated_(criteria) {
        // As comparison_criteria allows edges to lie beside each other: what linear interpolation leaves of them.
        interpolated_.negligible.image = std::max(criteria.negligible.image, 1e-3);
        interpolated_.negligible.tile = std::max(criteria.negligible.tile, 1e-2);
    }

    std::vector<Explanation> run() {
        if (!differ(pair_, criteria_, 1.0)) return {};
        before_ = misfit_of(pair_);
        tolerated_ = left_over * typical_difference(pair_);
        for (const auto step : {&Explainer::facts, &Explainer::changes_without_a_figure, &Explainer::one_figure,
                 &Explainer::two_figures, &Explainer::three_figures, &Explainer::mixings}) {
            (this->*step)();
            if (found_.size() > most_names) return {};
            if (!found_.empty()) return std::move(found_);
        }
        return {};
    }

private:
    // The share that the mend explains, where it is shown and nothing is left.
    [[nodiscard]] std::optional<ExplainedShare> shown(const ImagePair& mended) const {
        Misfit after;
        for (const Misfit::Scale& before : before_.scales) {
            after.scales.push_back(misfit_of(mended, before.edge));
            const double doubt = share_doubt / static_cast<double>(before_.scales.size());
            if (contradicted(before, after.scales.back(), shown_share, doubt)) return std::nullopt;
        }
        const ExplainedShare share = explained_share(before_, after, share_doubt);
        if (share.at_least < shown_share || differ(mended, criteria_, tolerated_)) return std::nullopt;
        return share;
    }
    bool consider(const std::string& text, const ImagePair& mended) {
        const std::optional<ExplainedShare> share = shown(mended);
        if (share) found_.push_back({text, share});
        return share.has_value();
    }

    void facts() {
        for (const auto look : {rectangles_of_one_value, ceilings})
            for (const PlainFact& fact : look(pair_)) {
                const auto kept = std::ranges::count(fact.left_out, false);
                if (kept > 0 && differ(without(pair_, fact.left_out), criteria_, tolerated_)) continue;
                found_.push_back({fact.text + (kept > 0 ? ", and nothing else differs" : ""), std::nullopt});
            }
    }

    void changes_without_a_figure() {
        places();
        orders();
        encodings();
    }

    void places() {
        const std::uint32_t width = pair_.candidate.width, height = pair_.candidate.height;
        const std::uint32_t right = width - 1, bottom = height - 1;
        const auto consider_move = [&](const char* text, const std::function<Place(Place)>& source) {
            consider(text, with_candidate_moved(pair_, source));
        };
        consider_move("a horizontal flip", [=](Place p) { return Place{right - p.x, p.y}; });
        consider_move("a vertical flip", [=](Place p) { return Place{p.x, bottom - p.y}; });
        consider_move("a half turn", [=](Place p) { return Place{right - p.x, bottom - p.y}; });
        if (width != height) return;
        consider_move("a transpose, x for y", [](Place p) { return Place{p.y, p.x}; });
        consider_move("a transpose about the other diagonal", [=](Place p) { return Place{right - p.y, right - p.x}; });
        consider_move("a quarter turn clockwise", [=](Place p) { return Place{right - p.y, p.x}; });
        consider_move("a quarter turn anticlockwise", [=](Place p) { return Place{p.y, right - p.x}; });
    }

    void orders() {
        constexpr const char* letters = "RGB";
        std::array<std::uint32_t, channel_count> order{0, 1, 2};
        while (std::ranges::next_permutation(order).found) {
            const std::string text =
                fmt::format("another order of the channels: the candidate's R, G, B are the reference's {}, {}, {}",
                    letters[order[0]], letters[order[1]], letters[order[2]]);
            consider(text, with_channels_moved(pair_, order));
        }
    }

    // The candidate is encoded where the reference is linear, or is encoded twice; or the other way round. Undone is
    // what was done to the averages, or done to the other side.
    void encodings() {
        const Transfer srgb{Transfer::Curve::srgb, 1.0};
        const Curve decode{[=](double v) { return srgb.decoded(v); }, [=](double v) { return srgb.slope(v); }};
        const Curve encode{
            [=](double v) { return srgb.encoded(v); }, [=](double v) { return 1.0 / srgb.slope(srgb.encoded(v)); }};
        for (const bool more : {true, false}) {
            const Curve &undo = more ? decode : encode, &also = more ? encode : decode;
            const std::string text = more ? "the candidate being encoded in sRGB once more than the reference"
                                          : "the candidate being decoded from sRGB once more than the reference";
            for (const ImagePair& mended : {ImagePair{pair_.reference, through(pair_.candidate, undo)},
                     ImagePair{through(pair_.reference, also), pair_.candidate}}) {
                if (consider(text, mended) || consider_cut_off(text, mended)) {
                    add_gamma();
                    return;
                }
            }
        }
    }

    bool consider_cut_off(const std::string& text, const ImagePair& mended) {
        for (const PlainFact& ceiling : ceilings(mended))
            if (consider(text + ", and " + ceiling.text, without(mended, ceiling.left_out))) return true;
        return false;
    }

    // What is near to sRGB and cannot be told from it.
    void add_gamma() {
        const Power power = fit_power(pair_, false);
        if (shown(power.mended)) found_.back().text += fmt::format(", or an exponent of {:.3f}", power.exponent);
    }

    // Displays have gammas of 1.8 to 2.4, viewing conditions of 1.1 to 1.5. What is nearer to 1 fits many a curve.
    [[nodiscard]] static bool worth_a_name(const Power& power) { return std::abs(power.exponent - 1.0) > 0.05; }

    void one_figure() {
        const Factor factor = fit_factor(pair_);
        consider(told_of(factor) + missing_sample(factor), {pair_.reference, divided(factor)});
        const Power power = fit_power(pair_, false);
        if (worth_a_name(power))
            consider(fmt::format("a gamma: candidate = reference^{:.3f}", power.exponent), power.mended);
        const double offset = fit_offset(pair_);
        consider(fmt::format("a constant {:.4g} added to the candidate", offset),
            {pair_.reference, scaled(pair_.candidate, {1.0, 1.0, 1.0}, -offset)});
    }

    [[nodiscard]] SampledImage divided(const Factor& factor) const {
        const double inverse = 1.0 / factor.value;
        return scaled(pair_.candidate, {inverse, inverse, inverse});
    }

    [[nodiscard]] static std::string told_of(const Factor& factor) {
        constexpr double least = 5e-5;  // of what is shown
        return fmt::format("a constant exposure factor of {:.4f}{}", factor.value,
            factor.error < least ? "" : fmt::format(" ± {:.4f}", factor.error));
    }

    // A side of several images has so many samples in each.
    [[nodiscard]] std::string missing_sample(const Factor& factor) const {
        constexpr double clear = 0.1, sigmas = 2.0, exact = 0.01;  // of 1/n: errors as small; as near, or by rounding
        for (const SampledImage* side : {&pair_.candidate, &pair_.reference}) {
            const auto all = static_cast<double>(side->samples);
            const double images = side->pixels.front().count, each = images < all ? all / images : all;
            const double n = std::round(each);
            if (n < 2.0 || factor.error > clear / n) continue;
            const auto near = [&](double value) {
                return std::abs(factor.value - value) <= std::max(sigmas * factor.error, exact / n);
            };
            if (near((n - 1.0) / n)) return fmt::format(", as if the candidate lacked one of {:.0f} samples", n);
            if (near(n / (n - 1.0))) return fmt::format(", as if the reference lacked one of {:.0f} samples", n);
        }
        return "";
    }

    void two_figures() {
        consider_shift(false);
        const Power power = fit_power(pair_, true);
        if (!worth_a_name(power)) return;
        consider(fmt::format("a gamma and a factor: candidate = {:.4g} reference^{:.3f}", power.factor, power.exponent),
            power.mended);
    }

    void three_figures() {
        consider_shift(true);
        std::array<double, channel_count> factors{}, inverse{};
        for (std::uint32_t c = 0; c < channel_count; ++c) {
            factors[c] = fit_factor(pair_, c).value;
            inverse[c] = factors[c] != 0.0 ? 1.0 / factors[c] : 1.0;
        }
        consider(fmt::format("a factor for each channel: red {:.4g}, green {:.4g}, blue {:.4g}", factors[0], factors[1],
                     factors[2]),
            {pair_.reference, scaled(pair_.candidate, inverse)});
    }

    void consider_shift(bool with_factor) {
        std::optional<Shift> shift = find_shift(pair_);
        if (!shift) return;
        std::string text;
        if (with_factor) {
            const Factor factor = fit_factor(shift->mended);
            const double inverse = 1.0 / factor.value;
            for (ImagePair* mended : {&shift->mended, &shift->mended_smooth})
                mended->candidate = scaled(mended->candidate, {inverse, inverse, inverse});
            text = told_of(factor) + " and ";
        }
        const ExplainedShare share =
            explained_share(misfit_of(shift->before), misfit_of(shift->mended), share_doubt, true);
        if (share.at_least < shown_share_of_shift || differ(shift->mended_smooth, interpolated_, 1.0, true)) return;
        const auto half = [](double s) { return std::abs(std::abs(s) - 0.5) < 0.1; };
        text += fmt::format("a shift of the candidate by ({:+.2f} ± {:.2f}, {:+.2f} ± {:.2f}) pixels{}", shift->x,
            shift->x_error, shift->y, shift->y_error, half(shift->x) || half(shift->y) ? ", about half a pixel" : "");
        found_.push_back({text, share});
    }

    void mixings() {
        if (const std::string copies = copied_channels(pair_); !copies.empty()) {
            found_.push_back({copies, std::nullopt});
            return;
        }
        constexpr std::size_t least_pixels = 64 * 64;  // 64 tiles for nine figures
        if (pair_.reference.pixels.size() / channel_count < least_pixels) return;
        const Mixing mixing = fit_mixing(pair_);
        std::string rows;
        for (std::size_t r = 0; r < channel_count; ++r)
            rows += fmt::format("{}({:.3g}, {:.3g}, {:.3g})", r == 0 ? "" : ", ", mixing.rows[r][0], mixing.rows[r][1],
                mixing.rows[r][2]);
        consider("a mixing of the channels, as by other primaries or saturation; rows of its matrix: " + rows,
            mixing.mended);
    }

    ImagePair pair_;
    const Criteria& criteria_;
    Criteria interpolated_;  // for shifts
    Misfit before_;
    double tolerated_ = 0.0;
    std::vector<Explanation> found_;
};

std::vector<bool> invalid_places(const SampledImage& reference, const SampledImage& candidate) {
    std::vector<bool> places(reference.pixels.size(), false);
    for (const SampledImage* side : {&reference, &candidate})
        for (const std::size_t pixel : side->invalid_pixels)
            for (std::size_t c = 0; c < channel_count; ++c) places[pixel * channel_count + c] = true;
    return places;
}

SampledImage without_batches(const SampledImage& image) {
    SampledImage result = image;
    result.batches.clear();
    return result;
}

}  // namespace

std::vector<Explanation> explain(
    const SampledImage& reference, const SampledImage& candidate, const Criteria& criteria) {
    ImagePair pair{without_batches(reference), without_batches(candidate)};
    return Explainer(without(pair, invalid_places(reference, candidate)), criteria).run();
}

std::string told(const std::vector<Explanation>& explanations) {
    if (explanations.empty()) return "";
    const Explanation& first = explanations.front();
    std::string text;
    for (const Explanation& one : explanations) text += (text.empty() ? "" : ", or ") + one.text;
    if (!first.share) return text;
    double least = 1.0;
    for (const Explanation& one : explanations)
        if (one.share) least = std::min(least, one.share->value);
    return fmt::format("it looks like {} ({} of the squared difference beyond noise)", text, percent(least));
}

}  // namespace tandem
