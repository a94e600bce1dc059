// What a miss of a closed form tells that both sides share. The closed form is the judge here, as no side errs alone.
// Settings that leave a right image's mean as it is are changed one at a time, and the limit of bounces is moved by
// one. A change with which the form is met says where the fault is. Beside that it is asked whether the film is the
// mean of its paths, and whether the scene's data keep what the loader promises. It changes no verdict.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/render/renderer.h"
#include "common/stopwatch.h"
#include "common/validation/explanation/likeness.h"
#include "common/validation/verdict/closed_form.h"
#include "common/validation/verdict/criteria.h"

namespace tandem {

// One side's image against the closed form.
struct FormLook {
    std::uint64_t samples = 0;           // a pixel
    double relative = 0.0, error = 0.0;  // of the channel that is off most; one standard error
};

enum class FormOutcome : std::uint8_t { met, missed, unknown };
inline constexpr std::array<std::string_view, 3> form_outcome_names{"met", "missed", "unknown"};

struct FormTrial {
    Subsystem part = Subsystem::count;
    std::string change;  // "without Russian roulette", "with one bounce more"
    bool whole = false;  // nothing of the part is left
    FormOutcome outcome = FormOutcome::unknown;
    FormLook look;  // with the change
};

struct MissedForm {
    std::string film;  // the film is not the mean of its traced paths (film_against_paths); empty: it is
    std::string data;  // what of the scene's data is not sound (common/scene/sound_scene.h); empty: nothing
    FormLook whole;    // the scene as it is
    std::vector<FormTrial> trials;
    double seconds = 0.0;
    std::string left_out;  // why nothing, or not all, was tried; empty: all was
};

struct MissQuestion {
    const Scene& scene;
    RenderSettings settings;
    Renderer& renderer;  // of either side, as both miss alike
    const ClosedForm& form;
    Criteria criteria;
    std::uint64_t most_samples = 1u << 20;  // a pixel and change
    double budget_seconds = 10.0;
    double expected_seconds = 0.0;  // of the first two blocks of samples
    std::stop_token stop;
    std::function<void(const std::string& what)> progress;
    std::function<double()> now = steady_seconds;  // the clock of the budget
};
[[nodiscard]] MissedForm look_into_miss(const MissQuestion& question);

// Parts that are out of an image that misses the form still, with every change of theirs.
[[nodiscard]] std::vector<Subsystem> cleared_parts(const MissedForm& missed);

// "the closed form is met with one bounce more: off by 0.002 % ± 0.01 %, else by -2.0 %"
[[nodiscard]] std::string told(const MissedForm& missed, const FormTrial& met);
// "4 changes tried on the closed form in 1.2 s; met: with one bounce more; missed: without Russian roulette, ..."
[[nodiscard]] std::string told(const MissedForm& missed);

}  // namespace tandem
