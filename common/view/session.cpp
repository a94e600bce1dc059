#include "common/view/session.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/files/read_file.h"

namespace tandem {

namespace {

// sRGB [IEC 61966-2-1] of linear values in [0, 1], by a table of 12-bit steps, below which 8 bits see nothing. For the
// steepest part, of slope 12.92, spans 12.92 * 255 / 4095 = 0.8 levels a step.
class Encoder {
public:
    Encoder() {
        for (std::size_t i = 0; i < table_.size(); ++i) {
            const double linear = static_cast<double>(i) / last;
            const double encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
            table_[i] = static_cast<std::uint8_t>(std::lround(255.0 * encoded));
        }
    }
    [[nodiscard]] std::uint8_t operator()(double linear) const {
        if (!(linear > 0.0)) return 0;  // what is not a number too
        return table_[static_cast<std::size_t>(std::lround(std::min(linear, 1.0) * last))];
    }

private:
    static constexpr double last = 4095.0;
    std::array<std::uint8_t, 4096> table_{};
};

// "image" names a file in backgrounds alone.
void fit_files(nlohmann::ordered_json& value, const std::filesystem::path& from, const std::filesystem::path& to,
    bool background = false) {
    for (auto& [key, member] : value.items())
        if (member.is_structured())
            fit_files(member, from, to, key == "background");
        else if (member.is_string() && (key == "file" || key == "$schema" || (background && key == "image")))
            member = std::filesystem::relative(from / member.get<std::string>(), to).generic_string();
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
    return std::filesystem::absolute(file).parent_path();
}

}  // namespace

ViewSession::ViewSession(
    Scene scene, const RenderSettings& settings, std::vector<std::unique_ptr<ProgressiveView>> views)
    : scene_(std::move(scene)),
      first_camera_(scene_.camera),
      first_film_{settings.width, settings.height},
      width_(settings.width),
      height_(settings.height),
      views_(std::move(views)) {
    if (views_.empty() || views_.size() > 2) throw Error("a session has one view or two");
}

void ViewSession::set_camera(const Camera& camera) {
    scene_.camera = camera;
    changed_ = true;
}

void ViewSession::set_size(std::uint32_t width, std::uint32_t height) {
    if (width == width_ && height == height_) return;
    width_ = width;
    height_ = height;
    changed_ = true;
}

void ViewSession::follow() {
    constexpr double patience = 0.5;  // seconds
    const bool shown = !begun_ || std::ranges::all_of(views_, [](const auto& view) {
        const ViewState state = view->state();
        return state.samples > 0 || !state.failure.empty();
    });
    if (!changed_ || (!shown && since_start_.seconds() < patience)) return;
    for (const auto& view : views_) view->restart(scene_.camera, width_, height_);
    changed_ = false;
    begun_ = true;
    since_start_ = Stopwatch();
}

bool ViewSession::finished() const {
    return !changed_ && std::ranges::all_of(views_, [](const auto& view) {
        const ViewState state = view->state();
        return state.finished || !state.failure.empty();
    });
}

std::uint64_t ViewSession::version() const {
    std::uint64_t sum = 0;
    for (const auto& view : views_) sum += view->state().version;
    return sum;
}

void ViewSession::stop() {
    for (const auto& view : views_) view->stop();
}

Image ViewSession::seen(double split) const {
    std::vector<std::shared_ptr<const ProgressiveView::Picture>> pictures;
    for (const auto& view : views_)
        if (auto picture = view->picture()) pictures.push_back(std::move(picture));
    if (pictures.empty()) return {};
    const auto& first = *pictures.front();
    // For a moment after a change of size the two sizes differ: then the first picture is seen alone.
    const auto& second = pictures.back()->mean.size() == first.mean.size() ? *pictures.back() : first;
    Image image;
    image.width = first.width;
    image.height = first.height;
    image.channels = {"R", "G", "B"};
    image.pixels.reserve(first.mean.size());
    const auto edge = static_cast<std::size_t>(std::lround(split * first.width)) * channel_count;
    const std::size_t row = std::size_t{first.width} * channel_count;
    for (std::size_t i = 0; i < first.mean.size(); ++i)
        image.pixels.push_back(static_cast<float>(i % row < edge ? first.mean[i] : second.mean[i]));
    return image;
}

ViewSession::Shown ViewSession::shown(const Appearance& appearance) const {
    static const Encoder encode;
    const Image image = seen(appearance.split);
    Shown shown{image.width, image.height, {}};
    shown.rgba.reserve(image.pixels.size() / 3 * 4);
    for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
        for (std::size_t c = 0; c < 3; ++c)
            shown.rgba.push_back(encode(appearance.exposure * static_cast<double>(image.pixels[i + c])));
        shown.rgba.push_back(255);
    }
    return shown;
}

std::string scene_text_with(
    const std::filesystem::path& original, const Camera& camera, const std::filesystem::path& target) {
    nlohmann::ordered_json scene = nlohmann::ordered_json::parse(read_file(original));
    nlohmann::ordered_json& view = scene["camera"];
    const auto vector = [](const glm::dvec3& v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
    view["position"] = vector(camera.position);
    view["target"] = vector(camera.target);
    if (view.contains("focus_distance")) view["focus_distance"] = camera.focus_distance;
    // What the film should be by the file's own closed form holds for its own view alone.
    scene.erase("expect");
    if (const auto from = folder_of(original), to = folder_of(target); from != to) fit_files(scene, from, to);
    return scene.dump(1, '\t') + "\n";
}

}  // namespace tandem
