// How the samples of a tile are shared out over submissions of the six stages. Each holds whole samples, or segments of
// the paths of one sample. They are of all places of the tile or of a run of them. So a submission is short however
// long paths are, however large the image is and whatever a ray costs.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vulkan/devices.h"

namespace tandem {

// Segments of the paths of one sample that start in a run of places. A run has all its segments before the next begins.
struct StageShare {
    std::uint64_t sample = 0;  // of the block
    std::uint32_t first_place = 0, places = 0;
    std::uint32_t first_segment = 0, end_segment = 0;
    bool completes = false;  // the sample, for every place

    [[nodiscard]] std::uint64_t size() const { return std::uint64_t{places} * (end_segment - first_segment); }
};

class StagePlan {
public:
    // `segments`: that a path can have. `fixed`: segments of all places in each submission; 0: as time tells.
    StagePlan(const DeviceDescription& device, std::uint32_t segments, std::uint32_t fixed);

    // Samples [0, samples) of `places` places are next.
    void begin(std::uint32_t places, std::uint64_t samples);
    // The shares of the next submission; or all that are left, in one.
    [[nodiscard]] std::vector<StageShare> next();
    [[nodiscard]] std::vector<StageShare> rest();
    // The submission took so long: later ones grow or shrink.
    void took(double seconds);

    // The segment that the run in hand goes on with where its paths are so long that all may have ended before; else 0.
    [[nodiscard]] std::uint32_t doubtful_segment() const;
    // They have: the run's other segments are left out. Whether that completes the sample.
    [[nodiscard]] bool leave_out_rest_of_run();

    // Samples that are done for every place, the last submission counting as done; and of the next one the part done.
    [[nodiscard]] std::uint64_t done() const { return done_; }
    [[nodiscard]] double done_of_next() const;

private:
    [[nodiscard]] StageShare share(std::uint32_t places, std::uint64_t segments);
    [[nodiscard]] std::vector<StageShare> whole_samples(std::uint64_t count);
    [[nodiscard]] std::vector<StageShare> whole_segments(std::uint64_t count);
    [[nodiscard]] std::optional<double> foretold_sample() const;
    [[nodiscard]] bool end_run();
    void adapt(const StageShare& last, double seconds);

    std::uint32_t segments_, fixed_;
    std::uint32_t places_ = 0;  // of the tile
    std::uint64_t wanted_ = 0, done_ = 0;
    std::uint32_t first_place_ = 0, run_places_ = 0, segment_ = 0;  // the run in hand, and its next segment

    // Segments of single places in a submission: of one that begins a run, with all its rays, and of a later one.
    std::uint64_t first_budget_, later_budget_ = 0;
    std::uint32_t most_places_;             // of the next run
    std::uint64_t most_segments_;           // of a submission: dispatches take time however few rays they have
    std::uint32_t ended_by_ = 0;            // the segment by which all paths of a run were found to have ended; 0: none
    double sample_seconds_ = 0.0;           // of the sample in hand
    bool left_out_ = false;                 // some of its segments
    std::optional<double> last_sample_;     // seconds of the last sample that had all segments,
    std::uint32_t last_sample_places_ = 0;  // and its places
    std::vector<StageShare> last_;          // submission
};

}  // namespace tandem
