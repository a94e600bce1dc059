#include "common/validation/explanation/signature.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tandem {

namespace {

float clamped(double value) { return static_cast<float>(std::clamp(value, 0.0, 1.0)); }

// 0 at `least` and below, 1 at 1.
float logarithm(double share, double least) {
    return clamped(1.0 - std::log10(std::max(share, least)) / std::log10(least));
}

template <std::size_t n>
void put(Signature& signature, Figure first, const std::array<double, n>& shares) {
    for (std::size_t i = 0; i < n; ++i)
        signature.figures[static_cast<std::size_t>(first) + i] = static_cast<float>(shares[i]);
}

void put_paths(Signature& s, const PathPartings& paths) {
    put(s, Figure::by_camera, paths.by);
    put(s, Figure::at_nothing, paths.at);
    put(s, Figure::on_triangle, paths.shape);
    put(s, Figure::vertex_0, paths.depth);
    s[Figure::on_texture] = static_cast<float>(paths.textured);
    const double all = std::max(1.0, static_cast<double>(paths.paths));
    s[Figure::parted] = logarithm(static_cast<double>(paths.parted) / all, 1e-3);
    s[Figure::ratio] = logarithm(paths.ratio, 1e-3);
    s[Figure::ratio_spread] = logarithm(paths.ratio_spread, 1e-3);
    s[Figure::ratio_colour] = logarithm(paths.ratio_colour, 1e-3);
    s[Figure::touched] = static_cast<float>(paths.touched);
    s[Figure::film_apart] = static_cast<float>(paths.film_apart);
    s[Figure::pattern] = paths.pattern ? 1.0F : 0.0F;
}

void put_image(Signature& s, const LevelResult& image, const LevelResult& tiles) {
    double least = 1e300, most = -1e300, size = 0.0;
    for (const RegionComparison& region : image.regions) {
        least = std::min(least, region.relative);
        most = std::max(most, region.relative);
        size = std::max(size, std::abs(region.relative));
    }
    s[Figure::image] = logarithm(size, 1e-4);
    s[Figure::coloured] = size > 0.0 ? clamped(0.5 * (most - least) / size) : 0.0F;
    std::vector<double> sizes;
    double sum = 0.0;
    for (const RegionComparison& region : tiles.regions) {
        sizes.push_back(std::abs(region.relative));
        sum += region.relative;
    }
    const double all = std::accumulate(sizes.begin(), sizes.end(), 0.0);
    if (!(all > 0.0)) return;
    s[Figure::one_sign] = clamped(std::abs(sum) / all);
    std::ranges::sort(sizes, std::greater{});
    const auto tenth = static_cast<std::ptrdiff_t>((sizes.size() + 9) / 10);
    s[Figure::concentrated] = clamped(std::accumulate(sizes.begin(), sizes.begin() + tenth, 0.0) / all);
}

void put_samples(Signature& s, const PairedResult& paired) {
    if (paired.paths) s[Figure::short_paths] = clamped(paired.paths->worst.relative);
    for (const LevelResult& level : paired.alone) {
        const float share = clamped(level.worst.relative);
        if (level.name == counter_level)
            s[level.place.starts_with("number 0 ") ? Figure::first_counter : Figure::high_counters] = share;
        if (level.name == size_level) s[Figure::sizes] = share;
    }
    s[Figure::diverged] = clamped(paired.diverged_fraction);
}

void put_scene(Signature& s, EffectSet effects) {
    const auto any = [&](std::initializer_list<Effect> some) {
        return std::ranges::any_of(some, [&](Effect effect) { return effects.has(effect); }) ? 1.0F : 0.0F;
    };
    s[Figure::scene_light_sampling] = any({Effect::light_sampling});
    s[Figure::scene_emission] = any({Effect::emission, Effect::background});
    s[Figure::scene_dielectric] = any({Effect::translucent, Effect::boundary});
    s[Figure::scene_roulette] = any({Effect::roulette});
    s[Figure::scene_lens_or_time] = any({Effect::lens, Effect::camera_motion, Effect::entity_motion});
    s[Figure::scene_textures] = any({Effect::checker, Effect::noise, Effect::image_texture, Effect::background_image});
    s[Figure::scene_volumes] = any({Effect::medium_absorption, Effect::medium_scattering});
}

}  // namespace

std::string_view figure_name(Figure figure) {
    constexpr std::array<std::string_view, figure_count> names{
#define FIGURE(name) #name,
#include "common/validation/explanation/figures.def"
#undef FIGURE
    };
    return names.at(static_cast<std::size_t>(figure));
}

Signature signature_of(
    const Judgement& judgement, const PairedResult& paired, const PathPartings& partings, EffectSet effects) {
    Signature s;
    put_scene(s, effects);
    put_paths(s, partings);
    if (paired.done)
        put_image(s, paired.image, paired.tiles);
    else
        put_image(s, judgement.level("image"), judgement.level("tiles 16x16"));
    double octaves = 0.0;
    for (const LevelResult& level : judgement.levels)
        if (level.name == "variance of the image")
            for (const RegionComparison& region : level.regions)
                octaves = std::max(octaves, std::abs(std::log2(std::max(1.0 + region.relative, 1e-3))));
    s[Figure::variance] = clamped(octaves / 3.0);
    s[Figure::no_number] = judgement.fixed.mismatches > 0 ? 1.0F : 0.0F;
    put_samples(s, paired);
    return s;
}

}  // namespace tandem
