// Arms that prove the runner: one that is the baseline again, and one that waits for a known time besides.
#include "vulkan/bench/families.h"

namespace tandem {

namespace {

// Every arm waits before its frame, since a device that was idle for longer answers later; one of them counts its wait.
class BusyRun : public ArmRun {
public:
    BusyRun(std::unique_ptr<ArmRun> run, bool counted) : run_(std::move(run)), counted_(counted) {}

    [[nodiscard]] ClockReadings run() override {
        const double start = steady_seconds();
        while (steady_seconds() - start < self_test_busy_seconds) {
        }
        const double waited = steady_seconds() - start;
        ClockReadings readings = run_->run();
        if (counted_) readings["total"] += waited;
        readings["busy"] = waited;
        return readings;
    }
    [[nodiscard]] std::optional<ArmOutput> output() override { return run_->output(); }

private:
    std::unique_ptr<ArmRun> run_;
    bool counted_;
};

Arm busy_arm(Arm arm, std::string name, std::string text, bool counted) {
    arm.make = [make = arm.make, counted] { return std::make_unique<BusyRun>(make(), counted); };
    arm.name = std::move(name);
    arm.text = std::move(text);
    return arm;
}

}  // namespace

Family self_test_family(const SharedDevice& device) {
    Family family;
    family.name = "self-test";
    family.question = "Does the runner see a busy-wait of known length, and nothing where there is nothing?";
    family.hypothesis = "The interval of the busy arm covers its wait; the twin's covers 1";
    family.source = "planted";
    family.held = "everything";
    family.base = plain_frame;
    family.along = "pixels";
    family.workloads = {workload_of({device->sizes().front(), 1, device->bounces()})};
    family.arms = [device](const Workload& workload) {
        const Arm frame = render_arm(device, workload, "frame", "a frame", {});
        return std::vector<Arm>{busy_arm(frame, "plain", "a frame; a wait before it is not counted", false),
            busy_arm(frame, "twin", "the same", false),
            busy_arm(frame, "busy", "the same, and the wait of 0.5 ms is counted", true)};
    };
    return family;
}

}  // namespace tandem
