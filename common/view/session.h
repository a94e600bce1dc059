// What a window shows of a scene, and what its user can do. How windows are made is not known here.
#pragma once

#include <filesystem>
#include <memory>

#include "common/image/image_io.h"
#include "common/stopwatch.h"
#include "common/view/progressive_view.h"

namespace tandem {

// Colours are shown in 8-bit sRGB after a factor.
struct Appearance {
    double exposure = 1.0;
    double split = 0.5;  // of the width, from the left: the first backend's; with two backends alone
    bool operator==(const Appearance&) const = default;
};

class ViewSession {
public:
    // One backend or two: of two, the first one's image is left of the split.
    ViewSession(Scene scene, const RenderSettings& settings, std::vector<std::unique_ptr<ProgressiveView>> views);

    [[nodiscard]] const Camera& camera() const { return scene_.camera; }
    [[nodiscard]] const Scene& scene() const { return scene_; }
    [[nodiscard]] std::uint32_t width() const { return width_; }
    [[nodiscard]] std::uint32_t height() const { return height_; }
    [[nodiscard]] const Film& first_film() const { return first_film_; }  // the size that it began with
    [[nodiscard]] std::size_t view_count() const { return views_.size(); }
    [[nodiscard]] const ProgressiveView& view(std::size_t i) const { return *views_[i]; }

    // The backends follow with the next call of follow().
    void set_camera(const Camera& camera);
    void reset_camera() { set_camera(first_camera_); }
    void set_size(std::uint32_t width, std::uint32_t height);
    // Once a frame: has the backends begin, and begin anew where the camera or the size changed. A camera that moves
    // all the time still gets pictures. The first sample of a place may be finished, if that takes no longer than half
    // a second.
    void follow();
    // Whether every backend has all its samples, or has failed.
    [[nodiscard]] bool finished() const;
    // Grows with each change of any backend's image.
    [[nodiscard]] std::uint64_t version() const;
    void stop();

    // What is seen, linear, with the split; of no size where there is nothing yet.
    [[nodiscard]] Image seen(double split) const;
    // The same in 8 bits a channel: RGBA, row by row from the top.
    struct Shown {
        std::uint32_t width = 0, height = 0;
        std::vector<std::uint8_t> rgba;
    };
    [[nodiscard]] Shown shown(const Appearance& appearance) const;

private:
    Scene scene_;
    Camera first_camera_;
    Film first_film_;
    std::uint32_t width_, height_;
    bool begun_ = false;
    bool changed_ = true;  // since the backends began
    Stopwatch since_start_;
    std::vector<std::unique_ptr<ProgressiveView>> views_;
};

// The text of the scene file `original`, with `camera` in place of its own. Names of files in it, which are relative to
// their scene, are made to fit `target`, where the text is to stand. Throws InputError.
[[nodiscard]] std::string scene_text_with(
    const std::filesystem::path& original, const Camera& camera, const std::filesystem::path& target);

}  // namespace tandem
