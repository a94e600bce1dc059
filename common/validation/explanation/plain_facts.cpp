#include "common/validation/explanation/plain_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace tandem {

namespace {

constexpr std::size_t least_places = 4, most_rectangles = 16;
constexpr double clearly = 5.0;  // standard errors

bool differs_clearly(const PixelStatistics& a, const PixelStatistics& b) {
    return std::abs(a.mean - b.mean) > clearly * std::sqrt(a.variance / a.count + b.variance / b.count);
}

struct Side {
    const SampledImage& own;
    const SampledImage& other;
    const char* name;
};

std::array<Side, 2> sides_of(const ImagePair& pair) {
    return {
        Side{pair.candidate, pair.reference, "the candidate"}, Side{pair.reference, pair.candidate, "the reference"}};
}

// Channels first to last - 1: all three, or one.
struct Channels {
    std::size_t first = 0, last = channel_count;
    [[nodiscard]] bool all() const { return last - first == channel_count; }
};

using Value = std::array<double, channel_count>;

Value value_of(const SampledImage& image, std::size_t pixel, const Channels& channels) {
    Value value{};
    for (std::size_t c = channels.first; c < channels.last; ++c)
        value[c] = image.pixels[pixel * channel_count + c].mean;
    return value;
}

// The value that most of the pixels that clearly differ have on this side.
std::optional<Value> commonest(const Side& side, const Channels& channels, std::vector<bool>& differing) {
    std::map<Value, std::size_t> counts;
    for (std::size_t pixel = 0; pixel < differing.size(); ++pixel) {
        for (std::size_t c = channels.first; c < channels.last; ++c) {
            const std::size_t i = pixel * channel_count + c;
            differing[pixel] = differing[pixel] || differs_clearly(side.own.pixels[i], side.other.pixels[i]);
        }
        if (differing[pixel]) ++counts[value_of(side.own, pixel, channels)];
    }
    const auto most = std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
    return most == counts.end() || most->second < least_places ? std::nullopt : std::optional(most->first);
}

// Rectangles that hold `value` and nothing else, bounding boxes of what is connected; none where they are not full.
class Components {
public:
    Components(const std::vector<bool>& marked, std::uint32_t width) : marked_(marked), width_(width) {}

    [[nodiscard]] std::vector<Rectangle> boxes(const std::vector<bool>& wanted) {
        std::vector<Rectangle> result;
        std::vector<bool> seen(marked_.size(), false);
        for (std::size_t pixel = 0; pixel < marked_.size(); ++pixel) {
            if (!wanted[pixel] || !marked_[pixel] || seen[pixel]) continue;
            const Rectangle box = box_from(pixel, seen);
            if (!full(box) || result.size() == most_rectangles) return {};
            result.push_back(box);
        }
        return result;
    }
    [[nodiscard]] bool full(const Rectangle& box) const {
        for (std::uint32_t y = box.y0; y < box.y1; ++y)
            for (std::uint32_t x = box.x0; x < box.x1; ++x)
                if (!marked_[std::size_t{y} * width_ + x]) return false;
        return true;
    }

private:
    Rectangle box_from(std::size_t start, std::vector<bool>& seen) const {
        const auto at = [&](std::size_t p) {
            return std::pair{static_cast<std::uint32_t>(p % width_), static_cast<std::uint32_t>(p / width_)};
        };
        const auto [x0, y0] = at(start);
        Rectangle box{x0, y0, x0 + 1, y0 + 1};
        std::vector<std::size_t> left{start};
        seen[start] = true;
        while (!left.empty()) {
            const std::size_t pixel = left.back();
            left.pop_back();
            const auto [x, y] = at(pixel);
            box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
            const auto visit = [&](bool there, std::size_t next) {
                if (!there || !marked_[next] || seen[next]) return;
                seen[next] = true;
                left.push_back(next);
            };
            visit(x > 0, pixel - 1);
            visit(x + 1 < width_, pixel + 1);
            visit(y > 0, pixel - width_);
            visit(pixel + width_ < marked_.size(), pixel + width_);
        }
        return box;
    }

    const std::vector<bool>& marked_;
    std::uint32_t width_;
};

std::string told(const Value& value, const Channels& channels) {
    if (std::ranges::all_of(value, [](double v) { return v == 0.0; })) return channels.all() ? "black" : "0";
    if (!channels.all()) return fmt::format("constant ({:.3g})", value[channels.first]);
    return fmt::format("constant ({:.3g}, {:.3g}, {:.3g})", value[0], value[1], value[2]);
}

std::string told(const std::vector<Rectangle>& boxes, const SampledImage& image) {
    const Rectangle& r = boxes.front();
    if (r.x1 - r.x0 == image.width && r.y1 - r.y0 == image.height) return "everywhere";
    const std::string place = fmt::format("x {} to {}, y {} to {}", r.x0, r.x1 - 1, r.y0, r.y1 - 1);
    return boxes.size() == 1 ? "at " + place : fmt::format("in {} rectangles, the first at {}", boxes.size(), place);
}

// Whether the other side has one value there too: then the two differ by a factor, and nothing is missing.
bool other_is_even(const Side& side, const std::vector<Rectangle>& boxes, const Channels& channels) {
    const std::size_t first = std::size_t{boxes.front().y0} * side.own.width + boxes.front().x0;
    for (const Rectangle& r : boxes)
        for (std::uint32_t y = r.y0; y < r.y1; ++y)
            for (std::uint32_t x = r.x0; x < r.x1; ++x)
                if (value_of(side.other, std::size_t{y} * side.own.width + x, channels) !=
                    value_of(side.other, first, channels))
                    return false;
    return true;
}

std::optional<PlainFact> rectangles(const Side& side, const Channels& channels) {
    constexpr std::array<const char*, channel_count> names{"red", "green", "blue"};
    std::vector<bool> differing(side.own.pixels.size() / channel_count, false);
    const std::optional<Value> value = commonest(side, channels, differing);
    if (!value) return std::nullopt;
    std::vector<bool> marked(differing.size());
    Rectangle all{side.own.width, side.own.height, 0, 0};
    for (std::size_t pixel = 0; pixel < marked.size(); ++pixel) {
        marked[pixel] = value_of(side.own, pixel, channels) == *value;
        if (!marked[pixel] || !differing[pixel]) continue;
        const auto x = static_cast<std::uint32_t>(pixel % side.own.width),
                   y = static_cast<std::uint32_t>(pixel / side.own.width);
        all = {std::min(all.x0, x), std::min(all.y0, y), std::max(all.x1, x + 1), std::max(all.y1, y + 1)};
    }
    Components components(marked, side.own.width);
    std::vector<Rectangle> boxes = components.full(all) ? std::vector{all} : components.boxes(differing);
    std::erase_if(boxes, [](const Rectangle& r) { return (r.x1 - r.x0) * (r.y1 - r.y0) < least_places; });
    if (boxes.empty() || (*value != Value{} && other_is_even(side, boxes, channels))) return std::nullopt;
    PlainFact fact;
    fact.text =
        fmt::format("{}{} is {} {}", side.name, channels.all() ? "" : std::string("'s ") + names.at(channels.first),
            told(*value, channels), told(boxes, side.own));
    fact.left_out.assign(side.own.pixels.size(), false);
    for (const Rectangle& r : boxes)
        for (std::uint32_t y = r.y0; y < r.y1; ++y)
            for (std::uint32_t x = r.x0; x < r.x1; ++x)
                for (std::size_t c = channels.first; c < channels.last; ++c)
                    fact.left_out[(std::size_t{y} * side.own.width + x) * channel_count + c] = true;
    return fact;
}

}  // namespace

std::vector<PlainFact> rectangles_of_one_value(const ImagePair& pair) {
    std::vector<PlainFact> facts;
    for (const Side& side : sides_of(pair))
        for (const Channels channels : {Channels{}, Channels{0, 1}, Channels{1, 2}, Channels{2, 3}})
            if (std::optional<PlainFact> fact = rectangles(side, channels)) {
                facts.push_back(std::move(*fact));
                if (channels.all()) break;
            }
    return facts;
}

std::vector<PlainFact> ceilings(const ImagePair& pair) {
    std::vector<PlainFact> facts;
    for (const Side& side : sides_of(pair)) {
        double greatest = 0.0;
        for (const PixelStatistics& pixel : side.own.pixels) greatest = std::max(greatest, pixel.mean);
        std::size_t places = 0, exceeded = 0;
        PlainFact fact;
        fact.left_out.assign(side.own.pixels.size(), false);
        for (std::size_t i = 0; i < side.own.pixels.size(); ++i) {
            if (side.own.pixels[i].mean != greatest) continue;
            fact.left_out[i] = true;
            ++places;
            if (side.other.pixels[i].mean > greatest) ++exceeded;
        }
        if (places < least_places || 2 * exceeded <= places) continue;
        fact.text = fmt::format("{}'s values are cut off at {:.4g}", side.name, greatest);
        facts.push_back(std::move(fact));
    }
    return facts;
}

std::string copied_channels(const ImagePair& pair) {
    const auto grey = [](const SampledImage& image) {
        for (std::size_t i = 0; i < image.pixels.size(); i += channel_count)
            for (std::size_t c = 1; c < channel_count; ++c)
                if (image.pixels[i].mean != image.pixels[i + c].mean) return false;
        return true;
    };
    const std::array<bool, 2> is_grey{grey(pair.candidate), grey(pair.reference)};
    if (is_grey[0] == is_grey[1]) return "";
    return std::string(is_grey[0] ? "the candidate" : "the reference") + "'s three channels are the same everywhere";
}

}  // namespace tandem
