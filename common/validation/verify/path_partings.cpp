#include "common/validation/verify/path_partings.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "common/error.h"
#include "common/validation/explanation/pixel_pattern.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/parting_patterns.h"

namespace tandem {

namespace {

using glm::dvec3;

constexpr std::size_t traced_pixels = 8, number_pixels = 2;
// 1024 ulp of single precision: above what a few vertices round, below the least fault worth a name. What rounding
// parts nevertheless is seldom, and the planted bugs' own counts hold it as well.
constexpr double tolerated_parting = 0x1p-13;
constexpr double most_octaves = 8.0;  // of a ratio that counts

bool apart(const dvec3& a, const dvec3& b, double scale) {
    const double difference = largest_coordinate(a - b);
    return !(difference <= tolerated_parting * scale) && difference > 0.0;
}
bool apart(const dvec3& a, const dvec3& b) {
    return apart(a, b, std::max(largest_coordinate(a), largest_coordinate(b)));
}

class Comparison {
public:
    // Vertex k of both paths.
    Comparison(const PathTrace& a, const PathTrace& b, std::size_t k) : a_(a), b_(b), k_(k) {
        parting_.vertex = k;
        if (k < a.vertices.size()) {
            parting_.material = a.vertices[k].material;
            parting_.primitive = a.vertices[k].primitive;
            parting_.in_medium = a.vertices[k].in_medium;
        }
    }

    std::optional<Parting> vertex() {
        arriving();
        if (!found_) leaving();
        return found_ ? std::optional(parting_) : std::nullopt;
    }
    std::optional<Parting> sum() {
        if (apart(a_.radiance, b_.radiance)) set(PartsBy::sum, a_.radiance, b_.radiance);
        return found_ ? std::optional(parting_) : std::nullopt;
    }

private:
    void set(PartsBy what) {
        parting_.by[static_cast<std::size_t>(what)] = true;
        found_ = true;
    }
    void set(PartsBy what, const dvec3& a, const dvec3& b) {
        set(what);
        if (std::ranges::any_of(parting_.ratio, [](const auto& r) { return r.has_value(); })) return;
        for (std::size_t c = 0; c < 3; ++c) {
            const double x = a[static_cast<int>(c)], y = b[static_cast<int>(c)];
            if (x > 0.0 && y > 0.0) parting_.ratio[c] = std::clamp(std::log2(y / x), -most_octaves, most_octaves);
        }
    }

    void arriving() {
        const TracedVertex &a = a_.vertices[k_], &b = b_.vertices[k_];
        const double place = std::max({largest_coordinate(a.position), largest_coordinate(b.position),
            largest_coordinate(a.origin), largest_coordinate(b.origin), 0x1p-100});
        const bool origin = apart(a.origin, b.origin, place);
        if (k_ == 0 && (origin || apart(a.direction, b.direction))) return set(PartsBy::camera);
        if (origin) return set(PartsBy::spawned);
        if (a.in_medium != b.in_medium || a.primitive != b.primitive) return set(PartsBy::met);
        if (std::isfinite(a.t) && std::isfinite(b.t) && apart(a.position, b.position, place)) set(PartsBy::place);
        if (apart(a.normal, b.normal)) set(PartsBy::normal);
        if (!found_ && told(a.shading_normal, b.shading_normal)) set(PartsBy::shading_normal);
        if (apart(a.throughput, b.throughput)) set(PartsBy::throughput, a.throughput, b.throughput);
    }

    void leaving() {
        const TracedVertex &a = a_.vertices[k_], &b = b_.vertices[k_];
        next_event(a, b);
        if (told(dvec3(a.found_weight), dvec3(b.found_weight))) set(PartsBy::found_weight);
        const dvec3 found_a = emission(a_), found_b = emission(b_);
        const double all = std::max(largest_coordinate(a.radiance), largest_coordinate(b.radiance));
        // A difference of sums that are rounded.
        if (apart(found_a, found_b) && largest_coordinate(found_a - found_b) > 0x1p-18 * all)
            set(PartsBy::emission, found_a, found_b);
        if (a.end != b.end) {
            parting_.by_roulette = a.end == PathEnd::roulette || b.end == PathEnd::roulette;
            return set(PartsBy::end);
        }
        if (a.end != PathEnd::goes_on) return;
        if (apart(a.next_direction, b.next_direction)) set(PartsBy::direction);
        if (told(dvec3(a.pdf), dvec3(b.pdf))) set(PartsBy::density);
        const dvec3 scattered_a = before_roulette(a), scattered_b = before_roulette(b);
        if (apart(scattered_a, scattered_b))
            set(PartsBy::weight, scattered_a, scattered_b);
        else if (apart(a.next_throughput, b.next_throughput))
            set(PartsBy::survival, a.next_throughput, b.next_throughput);
    }

    // All else follows from another direction.
    void next_event(const TracedVertex& at_a, const TracedVertex& at_b) {
        const TracedLight &a = at_a.next_event, &b = at_b.next_event;
        const bool lit_a = largest_coordinate(at_a.light) > 0.0, lit_b = largest_coordinate(at_b.light) > 0.0;
        const bool both_aim = a.direction != dvec3(0.0) && b.direction != dvec3(0.0);
        if (both_aim ? apart(a.direction, b.direction) : lit_a != lit_b) return set(PartsBy::light_direction);
        if (lit_a != lit_b) set(PartsBy::shadow);
        if (!lit_a || !lit_b) return;
        if (a.pdf > 0.0 && b.pdf > 0.0) {
            if (apart(a.radiance, b.radiance)) set(PartsBy::light_radiance, a.radiance, b.radiance);
            if (apart(dvec3(a.pdf), dvec3(b.pdf))) set(PartsBy::light_density, dvec3(b.pdf), dvec3(a.pdf));
            if (apart(a.response, b.response)) set(PartsBy::light_response, a.response, b.response);
            if (apart(a.transmittance, b.transmittance))
                set(PartsBy::light_transmittance, a.transmittance, b.transmittance);
            if (apart(dvec3(a.weight), dvec3(b.weight))) set(PartsBy::light_weight, dvec3(a.weight), dvec3(b.weight));
        }
        if (apart(at_a.light, at_b.light)) set(PartsBy::light, at_a.light, at_b.light);
    }

    // Both sides tell it, and differ.
    static bool told(const dvec3& a, const dvec3& b) {
        return largest_coordinate(a) > 0.0 && largest_coordinate(b) > 0.0 && apart(a, b);
    }
    static dvec3 before_roulette(const TracedVertex& vertex) {
        return vertex.next_throughput * (vertex.survival > 0.0 ? vertex.survival : 1.0);
    }

    [[nodiscard]] dvec3 emission(const PathTrace& path) const {
        const dvec3 before = k_ > 0 ? path.vertices[k_ - 1].radiance : dvec3(0.0);
        return path.vertices[k_].radiance - before - path.vertices[k_].light;
    }

    const PathTrace &a_, &b_;
    std::size_t k_;
    Parting parting_;
    bool found_ = false;
};

Meeting meeting_of(const Scene& scene, const Parting& parting) {
    if (parting.in_medium) return Meeting::medium;
    if (parting.primitive == no_index || parting.material >= scene.materials.size()) return Meeting::nothing;
    const Material& material = scene.materials[parting.material];
    switch (material.kind) {
        case MaterialKind::diffuse:
            return largest_coordinate(material.radiance) > 0.0 ? Meeting::emitter : Meeting::diffuse;
        case MaterialKind::rough_diffuse:
            return Meeting::rough_diffuse;
        case MaterialKind::specular:
            return material.translucent ? Meeting::dielectric : Meeting::mirror;
        case MaterialKind::emissive:
            return Meeting::emitter;
        case MaterialKind::conductor:
            return Meeting::conductor;
        case MaterialKind::boundary:
            break;
    }
    return Meeting::boundary;
}

std::size_t depth_class(std::size_t vertex) {
    constexpr std::array<std::size_t, depth_classes - 1> ends{1, 2, 3, 5, 9};
    return static_cast<std::size_t>(std::ranges::upper_bound(ends, vertex) - ends.begin());
}

void add_ratios(PathPartings& counts, const std::vector<std::optional<Parting>>& paths) {
    double n = 0.0, sum = 0.0, squares = 0.0, colour = 0.0;
    for (const std::optional<Parting>& parting : paths) {
        if (!parting) continue;
        double least = most_octaves, most = -most_octaves, mean = 0.0, channels = 0.0;
        for (const std::optional<double>& ratio : parting->ratio) {
            if (!ratio) continue;
            least = std::min(least, *ratio);
            most = std::max(most, *ratio);
            mean += *ratio;
            channels += 1.0;
        }
        if (channels == 0.0) continue;
        n += 1.0;
        sum += mean / channels;
        squares += mean / channels * (mean / channels);
        colour += most - least;
    }
    if (n == 0.0) return;
    counts.ratio = std::abs(sum / n);
    counts.ratio_spread = std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
    counts.ratio_colour = colour / n;
}

// Where one of these is what parts two paths, the place of the draw on its vertex; nothing where there was none.
constexpr std::array drawn_figures{PartsBy::met, PartsBy::place, PartsBy::light_direction, PartsBy::direction};
std::optional<dvec3> drawn(const PathTrace& path, std::size_t vertex, PartsBy what) {
    if (vertex >= path.vertices.size()) return std::nullopt;
    const TracedVertex& at = path.vertices[vertex];
    switch (what) {
        case PartsBy::met:
        case PartsBy::place:
            if (!at.in_medium) return std::nullopt;
            return dvec3(at.t, 0.0, 0.0);
        case PartsBy::light_direction:
            if (at.next_event.direction == dvec3(0.0)) return std::nullopt;
            return at.next_event.direction;
        default:
            if (at.end != PathEnd::goes_on) return std::nullopt;
            return at.next_direction;
    }
}

class Tracing {
public:
    explicit Tracing(const PartingsQuestion& question)
        : question_(question),
          width_(question.settings.width),
          height_(question.settings.height),
          jobs_{question.reference.prepare(question.scene, question.settings),
              question.candidate.prepare(question.scene, question.settings)} {}

    std::optional<PathPartings> run() {
        for (std::size_t side = 0; side < 2; ++side) {
            RenderControl control;
            control.stop = question_.stop;
            RenderResult result = jobs_[side]->render(first_block, control);
            if (result.estimate.count() != first_block.count()) return std::nullopt;
            planes_[side] = result.estimate.totals();
        }
        std::vector<bool> touched(std::size_t{width_} * height_);
        for (std::size_t i = 0; i < touched.size(); ++i) touched[i] = sums_differ(sum(0, i), sum(1, i));
        std::vector<std::optional<Parting>> paths;
        Draws draws;
        Frames frames;
        PrimitiveEnd end(question_.scene);
        std::size_t film_apart = 0;
        const std::vector<std::size_t> pixels = chosen(touched);
        for (const std::size_t pixel : pixels) {
            const std::vector<PathTrace> a = traces(0, pixel), b = traces(1, pixel);
            std::vector<std::optional<Parting>> partings;
            for (std::size_t i = 0; i < a.size(); ++i) partings.push_back(parting_of(a[i], b[i]));
            draws.add(a, b, partings);
            frames.add(a, partings);
            end.add(a, b, partings);
            paths.insert(paths.end(), partings.begin(), partings.end());
            film_apart += sums_differ(sum_of(a), sum(0, pixel)) || sums_differ(sum_of(b), sum(1, pixel)) ? 1 : 0;
        }
        PathPartings counts = counted(question_.scene, question_.settings.bounces, paths);
        for (const std::size_t pixel : pixels) counts.pixels.emplace_back(pixel % width_, pixel / width_);
        counts.film_apart = static_cast<double>(film_apart) / static_cast<double>(pixels.size());
        counts.touched = static_cast<double>(std::ranges::count(touched, true)) / static_cast<double>(touched.size());
        counts.pattern = !pixel_pattern(touched, width_, height_).empty();
        counts.independence = draws.independence();
        counts.frames = frames.words();
        counts.primitives = end.words();
        counts.numbers = numbers_at(pixels, paths);
        return counts;
    }

private:
    // `paths`: of the pixels in turn, a block each.
    [[nodiscard]] NumberUses numbers_at(
        const std::vector<std::size_t>& pixels, const std::vector<std::optional<Parting>>& paths) const {
        std::map<std::size_t, std::map<std::size_t, std::size_t>> parted;  // vertex, pixel, paths
        for (std::size_t i = 0; i < paths.size(); ++i)
            if (paths[i]) ++parted[paths[i]->vertex][pixels[i * pixels.size() / paths.size()]];
        if (parted.empty() || question_.stop.stop_requested()) return {};
        const auto all = [](const auto& at) {
            std::size_t sum = 0;
            for (const auto& [pixel, count] : at.second) sum += count;
            return sum;
        };
        const auto& most = *std::ranges::max_element(parted, {}, all);
        std::vector<std::pair<std::size_t, std::size_t>> by_count;
        for (const auto& [pixel, count] : most.second) by_count.emplace_back(count, pixel);
        std::ranges::sort(by_count, std::greater{});
        std::vector<glm::uvec2> places;
        for (std::size_t i = 0; i < std::min(number_pixels, by_count.size()); ++i)
            places.emplace_back(by_count[i].second % width_, by_count[i].second / width_);
        try {
            return number_uses({*jobs_[0], *jobs_[1], places, most.first});
        } catch (const UnsupportedError&) {
            return {};  // a side without
        }
    }
    [[nodiscard]] dvec3 sum(std::size_t side, std::size_t pixel) const {
        const Moments* m = &planes_[side][pixel * channel_count];
        return {m[0].sum, m[1].sum, m[2].sum};
    }
    [[nodiscard]] std::vector<PathTrace> traces(std::size_t side, std::size_t pixel) const {
        return jobs_[side]->trace(
            static_cast<std::uint32_t>(pixel % width_), static_cast<std::uint32_t>(pixel / width_), first_block);
    }
    [[nodiscard]] dvec3 sum_of(const std::vector<PathTrace>& paths) const {
        dvec3 sum(0.0);
        for (const PathTrace& path : paths) {
            const dvec3& r = path.radiance;
            if (!std::isfinite(r.x + r.y + r.z) || std::min({r.x, r.y, r.z}) < 0.0) continue;  // MODEL.md 12
            sum += glm::min(r, dvec3(question_.settings.clamp));
        }
        return sum;
    }
    // From the most different one to the least, at equal steps: the worst alone would tell of rare light.
    [[nodiscard]] std::vector<std::size_t> chosen(const std::vector<bool>& touched) const {
        const Rectangle r = question_.region.value_or(Rectangle{0, 0, width_, height_});
        std::vector<std::size_t> pixels, others;
        for (std::uint32_t y = r.y0; y < r.y1; ++y)
            for (std::uint32_t x = r.x0; x < r.x1; ++x) {
                const std::size_t i = std::size_t{y} * width_ + x;
                (touched[i] ? pixels : others).push_back(i);
            }
        if (pixels.empty()) pixels = std::move(others);
        std::ranges::stable_sort(
            pixels, std::greater{}, [&](std::size_t i) { return largest_coordinate(sum(0, i) - sum(1, i)); });
        std::vector<std::size_t> result;
        const std::size_t count = std::min(traced_pixels, pixels.size());
        for (std::size_t k = 0; k < count; ++k) result.push_back(pixels[k * pixels.size() / count]);
        return result;
    }

    const PartingsQuestion& question_;
    std::uint32_t width_, height_;
    std::array<std::unique_ptr<RenderJob>, 2> jobs_;
    std::array<Estimate::Plane, 2> planes_;
};

}  // namespace

std::optional<Parting> parting_of(const PathTrace& reference, const PathTrace& candidate) {
    const std::size_t both = std::min(reference.vertices.size(), candidate.vertices.size());
    for (std::size_t k = 0; k < both; ++k)
        if (std::optional<Parting> parting = Comparison(reference, candidate, k).vertex()) return parting;
    return Comparison(reference, candidate, both).sum();
}

void Draws::add(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate,
    const std::vector<std::optional<Parting>>& partings) {
    const auto square = [](const dvec3& v) { return glm::dot(v, v); };
    for (std::size_t i = 0; i < partings.size(); ++i) {
        if (!partings[i]) continue;
        const auto first = std::ranges::find_if(
            drawn_figures, [&](PartsBy what) { return partings[i]->by[static_cast<std::size_t>(what)]; });
        if (first == drawn_figures.end()) continue;
        const std::size_t vertex = partings[i]->vertex;
        const std::optional<dvec3> a = drawn(reference[i], vertex, *first), b = drawn(candidate[i], vertex, *first);
        const std::optional<dvec3> other = drawn(reference[(i + 1) % reference.size()], vertex, *first);
        if (!a || !b || !other) continue;
        between_sides_ += square(*a - *b);
        between_samples_ += square(*a - *other);
        ++pairs_;
    }
}

double Draws::independence() const {
    constexpr std::size_t fewest = 16;
    if (pairs_ < fewest || !(between_samples_ > 0.0)) return 0.0;
    return std::min(1.0, between_sides_ / between_samples_);
}

PathPartings counted(const Scene& scene, std::uint32_t bounces, const std::vector<std::optional<Parting>>& paths) {
    PathPartings counts;
    counts.paths = paths.size();
    counts.punctual_lights = !scene.lights.empty();
    const PlacedPrimitives placed = placed_primitives(scene);
    for (const std::optional<Parting>& parting : paths) {
        if (!parting) continue;
        ++counts.parted;
        for (std::size_t i = 0; i < counts.by.size(); ++i) counts.by[i] += parting->by[i] ? 1.0 : 0.0;
        counts.at[static_cast<std::size_t>(meeting_of(scene, *parting))] += 1.0;
        counts.depth[depth_class(parting->vertex)] += 1.0;
        counts.by_roulette += parting->by_roulette ? 1.0 : 0.0;
        const bool last = parting->vertex + 1 == bounces || parting->vertex == bounces;
        counts.at_limit += parting->by[static_cast<std::size_t>(PartsBy::end)] && last ? 1.0 : 0.0;
        if (parting->primitive < placed.size() && !parting->in_medium)
            counts.shape[static_cast<std::size_t>(scene.primitives[placed[parting->primitive].primitive].kind)] += 1.0;
        if (parting->material < scene.materials.size() && scene.materials[parting->material].colour_texture != no_index)
            counts.textured += 1.0;
    }
    const double n = std::max(1.0, static_cast<double>(counts.parted));
    const auto share = [n](auto& shares) {
        for (double& s : shares) s /= n;
    };
    share(counts.by);
    share(counts.at);
    share(counts.shape);
    share(counts.depth);
    for (double* const one : {&counts.textured, &counts.by_roulette, &counts.at_limit}) *one /= n;
    add_ratios(counts, paths);
    return counts;
}

std::optional<PathPartings> partings_of_paths(const PartingsQuestion& question) {
    try {
        return Tracing(question).run();
    } catch (const UnsupportedError&) {
        return std::nullopt;
    }
}

}  // namespace tandem
