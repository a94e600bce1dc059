// The knobs of `tandem cost`: their options, what they bring with them, and which of them keep the estimate.
#include <limits>

#include "tests/common/known_cost.h"
#include "tests/scene_builder.h"

namespace tandem {
namespace {

using namespace known_cost;

TEST_CASE("cost: leaving out MIS brings next events with it, and other integrators bring MIS") {
    ArmSettings baseline;
    const auto setting_of = [&](const std::string& knob, const std::string& setting) {
        const std::vector<KnobSetting> all = knob_settings(Scene{}, baseline, RendererInfo{}, 1.0);
        const auto found = std::ranges::find_if(
            all, [&](const KnobSetting& one) { return one.knob == knob && one.setting == setting; });
        REQUIRE(found != all.end());
        return *found;
    };
    ArmSettings arm = baseline;
    const KnobSetting off = setting_of("mis", "off");
    CHECK(off.options == "--integrator next-event --mis off");
    off.apply(arm);
    CHECK(arm.render.integrator == Integrator::next_event);
    CHECK_FALSE(arm.render.mis);
    baseline = arm;
    CHECK(setting_of("mis", "on").options == "--mis on");
    const KnobSetting path = setting_of("integrator", "path");
    CHECK(path.options == "--integrator path --mis on");
    path.apply(arm);
    CHECK(arm.render.mis);
    CHECK(reference_settings(baseline, "cpu").render.mis);
}

TEST_CASE("cost: choices of the light are arms where there are two lights, and bring next events with them") {
    const auto arms = [](const Scene& scene, const ArmSettings& baseline, const std::string& knob) {
        std::vector<KnobSetting> found;
        for (const KnobSetting& one : knob_settings(scene, baseline, RendererInfo{}, 1.0))
            if (one.knob == knob) found.push_back(one);
        return found;
    };
    Scene scene;
    ArmSettings baseline;
    PunctualLight lamp;
    lamp.intensity = glm::dvec3(1.0);
    scene.lights = {lamp};
    for (const KnobSetting& one : arms(scene, baseline, "light-sampling")) CHECK_FALSE(one.reason.empty());
    PunctualLight sun = lamp;
    sun.kind = PunctualKind::sun;
    scene.lights = {lamp, sun};  // the tree has near lights alone
    for (const KnobSetting& one : arms(scene, baseline, "light-sampling"))
        CHECK(one.reason.empty() == (one.setting == "uniform"));
    scene.lights = {lamp, lamp};
    const std::vector<KnobSetting> both = arms(scene, baseline, "light-sampling");
    REQUIRE(both.size() == 2);
    CHECK(both[1].options == "--integrator next-event --light-sampling tree");
    CHECK(both[1].reason.empty());
    both[1].apply(baseline);
    CHECK(baseline.render.integrator == Integrator::next_event);
    CHECK(baseline.render.light_sampling == LightSampling::tree);
    for (const KnobSetting& one : arms(scene, baseline, "integrator")) {
        CAPTURE(one.setting);
        ArmSettings arm = baseline;
        one.apply(arm);
        const bool chooses = chooses_lights(arm.render.integrator);
        CHECK((arm.render.light_sampling == LightSampling::tree) == chooses);
        CHECK((one.options.find("--light-sampling power") == std::string::npos) == chooses);
    }
    CHECK(reference_settings(baseline, "cpu").render.light_sampling == LightSampling::power);
}

TEST_CASE("cost: qualities of hierarchies are arms where there are primitives enough for one") {
    const auto arms = [](const Scene& scene, const ArmSettings& baseline) {
        std::vector<KnobSetting> found;
        for (const KnobSetting& one : knob_settings(scene, baseline, RendererInfo{}, 1.0))
            if (one.knob == hierarchy_knob) found.push_back(one);
        return found;
    };
    Scene scene = test::SceneBuilder().sphere(test::diffuse(glm::dvec3(0.5)), glm::dvec3(0.0), 1.0).scene();
    ArmSettings baseline;
    for (const KnobSetting& one : arms(scene, baseline)) CHECK_FALSE(one.reason.empty());
    scene.entities.resize(100, scene.entities.front());
    const std::vector<KnobSetting> all = arms(scene, baseline);
    REQUIRE(all.size() == 2);
    CHECK(all[0].reason.empty());
    CHECK(all[1].options == "--hierarchy-quality low");
    all[1].apply(baseline);
    CHECK(baseline.render.hierarchy == HierarchyQuality::low);
    CHECK(arms(scene, baseline)[0].setting == "high");
    CHECK(reference_settings(baseline, "cpu").render.hierarchy == HierarchyQuality::high);
}

TEST_CASE("cost: pixel filters are arms whose difference is a bias, and the reference has the baseline's own") {
    ArmSettings baseline;
    baseline.render.filter = PixelFilter::tent;
    std::vector<std::string> found;
    for (const KnobSetting& one : knob_settings(Scene{}, baseline, RendererInfo{}, 1.0)) {
        if (one.knob != "filter") continue;
        found.push_back(one.options);
        CHECK(one.reason.empty());
        ArmSettings arm = baseline;
        one.apply(arm);
        CHECK_FALSE(keeps_estimate(Scene{}, baseline, arm));
        CHECK(pixel_filter_names[static_cast<std::size_t>(arm.render.filter)] == one.setting);
    }
    CHECK(found == std::vector<std::string>{"--filter box", "--filter gaussian"});
    CHECK(reference_settings(baseline, "cpu").render.filter == PixelFilter::tent);
    const RendererInfo info;
    ArmSettings box = baseline;
    box.render.filter = PixelFilter::box;
    CHECK(text_of(box, info).find("filter") == std::string::npos);  // older measurements keep their keys
    CHECK(text_of(baseline, info).find(" filter tent") != std::string::npos);
}

TEST_CASE(
    "cost: ways of adding samples up are arms, but for the backend's own, and plain sums are not taken for safe") {
    const auto names = [](Accumulation own) {
        std::vector<std::string> found;
        RendererInfo renderer;
        renderer.accumulation = own;
        for (const KnobSetting& one : knob_settings(Scene{}, ArmSettings{}, renderer, 1.0)) {
            if (one.knob != "accumulation") continue;
            CHECK(one.options == "--accumulation " + one.setting);
            ArmSettings arm;
            one.apply(arm);
            CHECK(keeps_estimate(Scene{}, ArmSettings{}, arm) == (one.setting != "plain"));
            found.push_back(one.setting);
        }
        return found;
    };
    CHECK(names(Accumulation::in_double) == std::vector<std::string>{"plain", "compensated"});
    CHECK(names(Accumulation::compensated) == std::vector<std::string>{"plain", "double"});
}

TEST_CASE("cost: a mix names an option once that several of its settings bring") {
    CHECK(with_options("", "--bounces 8") == "--bounces 8");
    CHECK(with_options("--integrator next-event", "--integrator next-event --light-sampling tree") ==
          "--integrator next-event --light-sampling tree");
    CHECK(
        with_options("--roulette 4 --bounces 256 --mis off", "--bounces 16") == "--roulette 4 --mis off --bounces 16");
}

TEST_CASE("cost: an arm keeps the estimate but where it has fewer bounces or another mean by design") {
    ArmSettings baseline;
    baseline.render.bounces = 8;
    Scene scene = test::SceneBuilder().sphere(test::diffuse(glm::dvec3(0.5)), glm::dvec3(0.0), 1.0).scene();
    const auto keeping = [&] {
        std::string found;
        RendererInfo renderer;
        renderer.backend = "cpu";
        for (const KnobSetting& one : knob_settings(scene, baseline, renderer, 1.0)) {
            ArmSettings arm = baseline;
            one.apply(arm);
            if (one.reason.empty() && keeps_estimate(scene, baseline, arm))
                found += one.knob + " " + one.setting + "; ";
        }
        return found;
    };
    CHECK(keeping() ==
          "integrator next-event; integrator bidirectional; mis off; bounces 16; bounces 32; roulette 1; roulette 4; "
          "roulette 8; generator hash; generator sobol; accumulation compensated; sampling adaptive; precision double; "
          "precision contracted; precision mixed; ");
    // Punctual lights are not found by scattering.
    scene.lights.emplace_back();
    baseline.render.integrator = Integrator::next_event;
    CHECK(keeping().find("integrator ") == std::string::npos);
    scene.lights.clear();
    CHECK(keeping().find("integrator path") != std::string::npos);
}

TEST_CASE("cost: nothing on top of a baseline that changes the mean keeps the estimate, but what undoes that") {
    Scene scene = test::SceneBuilder().sphere(test::diffuse(glm::dvec3(0.5)), glm::dvec3(0.0), 1.0).scene();
    scene.materials.front().translucent = true;
    const ArmSettings plain;
    CHECK(keeps_estimate(scene, plain, plain));
    const auto changed = [&](auto&& change) {
        ArmSettings baseline;
        change(baseline);
        return keeps_estimate(scene, baseline, baseline);
    };
    CHECK_FALSE(changed([](ArmSettings& arm) { arm.render.clamp = 1.0; }));
    CHECK_FALSE(changed([](ArmSettings& arm) { arm.render.integrator = Integrator::whitted; }));
    CHECK_FALSE(changed([](ArmSettings& arm) { arm.render.intersection.guard = SelfIntersectionGuard::ulp; }));
    CHECK_FALSE(changed([](ArmSettings& arm) { arm.render.fresnel = Fresnel::schlick; }));
    CHECK(changed([](ArmSettings& arm) { arm.render.fresnel = Fresnel::exact; }));
    CHECK(changed([](ArmSettings& arm) { arm.render.filter = PixelFilter::tent; }));  // the reference has it, too
    CHECK(changed([](ArmSettings& arm) { arm.render.bounces = 1; }));
    ArmSettings whitted;
    whitted.render.integrator = Integrator::whitted;
    CHECK(keeps_estimate(scene, whitted, plain));
}

TEST_CASE("cost: only settings without a limit of bounces are said to have no bias by design") {
    const auto bias_of = [](std::uint32_t bounces, bool keeps) {
        CostReport report = report_of({"baseline"});
        ArmFigures& arm = report.figures.front();
        arm.arm.settings.render.bounces = bounces;
        arm.arm.keeps_estimate = keeps;
        arm.squared_bias = {0.0, 0.0, 1e-6};
        report.asked_error = 0.5;
        const std::string text = to_text(report);
        CAPTURE(text);
        const std::size_t begin = text.find("none ");
        REQUIRE(begin != std::string::npos);
        return text.substr(begin, text.find('\n', begin) - begin);
    };
    CHECK(bias_of(unlimited_bounces - 1, true) == "none found, below 0.10 %");
    CHECK(bias_of(unlimited_bounces, true) == "none by design, below 0.10 %");
    CHECK(bias_of(unlimited_bounces, false) == "none found, below 0.10 %");
}

}  // namespace
}  // namespace tandem
