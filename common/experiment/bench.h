// The interface for `tandem bench`: families of arms on one device, and the claims that they decide.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/experiment/claims.h"
#include "common/scene/scene.h"

namespace tandem {

// What an arm is to be measured on.
struct BenchRequest {
    std::string device;  // as BackendOptions::device
    Scene scene;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sizes;  // of images, ascending; empty: fit for the device
    std::string arm_library = {};  // a user's own arms (vulkan/bench/own_arms/tandem/arm.h); empty: the program's
    bool validation = false;       // his arms under the validation layer
    // Is told which function of his library is about to be called, and, empty, that it has returned.
    std::function<void(const std::string& where)> entering = {};
};

// Arms of a library whose results are not the same.
class DifferentResults : public Error {
public:
    using Error::Error;
};

// One job of the thesis's experiment.
class ThesisJob {
public:
    virtual ~ThesisJob() = default;
    // What a frame is and what its time is of, a sentence each.
    [[nodiscard]] virtual std::string frame_text() const = 0;
    [[nodiscard]] virtual std::string clock_text() const = 0;
    // Seconds. `fresh`: scene and camera changed, so that pre-processing and vertex stage run.
    [[nodiscard]] virtual double frame(std::uint32_t samples, bool fresh) = 0;
};
struct ThesisSetup {
    std::uint32_t width = 1920, height = 1080, bounces = 12;
    unsigned threads = 1;
    bool cohesive = true;
    bool presented = false;  // frames go to a window
};

struct BenchTarget {
    nlohmann::json device;  // name, driver, UUIDs, limits, extensions, queues, memory, hash of the shaders
    std::vector<Family> families;
    std::vector<Claim> claims;
    Family self_test;  // arms "twin", which is the baseline, and "busy", which waits besides for
    double self_test_seconds = 0.0;
    // Seconds that so many submissions of nothing took, each with its wait: the floor beneath every reading.
    std::function<std::vector<double>(std::size_t count)> empty_submissions;
    std::function<std::unique_ptr<ThesisJob>(const ThesisSetup&)> thesis_job;
    // Why no frame can be presented here; empty: they can.
    std::function<std::string(const ThesisSetup&)> no_presentation;
};
using MakeBench = std::function<BenchTarget(const BenchRequest&)>;

}  // namespace tandem
