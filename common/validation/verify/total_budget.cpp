#include "common/validation/verify/total_budget.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/validation/verify/schedule.h"

namespace tandem {

namespace {

constexpr double survey = 0.5;               // of the budget: the first round
constexpr double most_of_equal = 2.0;        // a survey foretells; what one scene takes beyond is lost to later rounds
constexpr double least_scene_seconds = 0.5;  // below, a scene is not begun: preparing it takes as long
constexpr double reserve = 1.5;              // forecasts know neither the machine's load nor how noise falls out

using Verdicts = std::vector<std::optional<SceneVerdict>>;

double times_margin(const LevelResult& level, double margin) { return widest(level).bound() / margin; }

struct Waiting {
    std::size_t scene = 0;
    std::optional<double> forecast;
    [[nodiscard]] double rank() const { return forecast.value_or(std::numeric_limits<double>::infinity()); }
};

std::vector<Waiting> undecided_of(const Verdicts& verdicts) {
    std::vector<Waiting> waiting;
    for (std::size_t i = 0; i < verdicts.size(); ++i)
        if (verdicts[i] && verdicts[i]->verdict == Verdict::undecided && !verdicts[i]->judgement.black &&
            verdicts[i]->failure.empty())
            waiting.push_back({i, forecast_seconds(*verdicts[i])});
    std::ranges::stable_sort(waiting, {}, &Waiting::rank);
    return waiting;
}

class Rounds {
public:
    Rounds(const TotalBudget& budget, Verdicts& verdicts) : budget_(budget), verdicts_(verdicts) {
        verdicts_.assign(budget.scenes, std::nullopt);
    }

    void run() {
        for (std::size_t i = 0; i < budget_.scenes && goes_on(); ++i) {
            const double left = survey * budget_.seconds - budget_.elapsed();
            const double equal = survey * budget_.seconds / static_cast<double>(budget_.scenes);
            const double share = std::min(left / static_cast<double>(budget_.scenes - i), most_of_equal * equal);
            verify(i, std::max(least_scene_seconds, share), 0);
        }
        for (std::size_t round = 1; round < most_rounds && goes_on(); ++round) share_what_is_left(round);
    }

private:
    [[nodiscard]] double left() const { return budget_.seconds - budget_.elapsed(); }
    [[nodiscard]] bool goes_on() const { return !budget_.stop.stop_requested() && left() >= least_scene_seconds; }

    void verify(std::size_t scene, double seconds, std::size_t round) {
        SceneVerdict verdict = budget_.verify(scene, std::min({seconds, left(), budget_.most_seconds}), round);
        // One that was stopped before its first look says less than what there is.
        const bool says_less = verdict.verdict == Verdict::undecided && verdict.looks.empty();
        if (!verdicts_[scene] || !says_less) verdicts_[scene] = std::move(verdict);
    }

    void share_what_is_left(std::size_t round) {
        const std::vector<Waiting> waiting = undecided_of(verdicts_);
        for (std::size_t k = 0; k < waiting.size() && goes_on(); ++k) {
            double rest = 0.0;  // infinite where one has no forecast
            for (std::size_t j = k; j < waiting.size(); ++j) rest += waiting[j].rank();
            const Waiting& one = waiting[k];
            const double others = static_cast<double>(waiting.size() - k);
            double seconds = left() / others;
            if (one.forecast) {
                if (*one.forecast > std::min(left(), budget_.most_seconds)) continue;
                seconds = rest <= left() ? *one.forecast * left() / rest : reserve * *one.forecast;
            }
            verify(one.scene, seconds, round);
        }
    }

    const TotalBudget& budget_;
    Verdicts& verdicts_;
};

}  // namespace

std::optional<double> forecast_seconds(const SceneVerdict& verdict) {
    const Judgement& judgement = verdict.judgement;
    if (verdict.verdict != Verdict::undecided || verdict.looks.empty() || judgement.black || judgement.levels.empty())
        return std::nullopt;
    const Margins& margins = verdict.criteria.margins;
    double most = std::max(times_margin(judgement.level("image"), margins.image),
        times_margin(judgement.level("tiles 16x16"), margins.tile));
    for (const LevelResult& level : judgement.levels)
        if (level.name.starts_with("closed form")) most = std::max(most, times_margin(level, margins.image));
    if (!std::isfinite(most)) return std::nullopt;
    return budget_of_looks(verdict.looks.back().seconds * std::max(1.0, most * most));
}

void verify_within(const TotalBudget& budget, std::vector<std::optional<SceneVerdict>>& verdicts) {
    Rounds(budget, verdicts).run();
}

std::optional<double> seconds_needed(const std::vector<SceneVerdict>& verdicts) {
    double sum = 0.0;
    for (const SceneVerdict& verdict : verdicts) {
        if (verdict.verdict != Verdict::undecided) continue;
        const std::optional<double> forecast = forecast_seconds(verdict);
        if (!forecast) return std::nullopt;
        sum += *forecast;
    }
    return sum;
}

}  // namespace tandem
