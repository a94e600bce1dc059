// Which effects a scene calls for under given settings. A renderer leaves out the code, buffers and path state of all
// others. This never changes the image.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

struct RenderSettings;

enum class Effect : std::uint32_t {
#define EFFECT(name, absent) name,
#include "common/render/effects.def"
#undef EFFECT
    count
};
inline constexpr std::uint32_t effect_count = static_cast<std::uint32_t>(Effect::count);
static_assert(effect_count <= 64);

class EffectSet {
public:
    constexpr EffectSet() = default;
    constexpr EffectSet(std::initializer_list<Effect> effects) {
        for (const Effect effect : effects) bits_ |= bit(effect);
    }
    [[nodiscard]] static constexpr EffectSet all() { return from_bits((std::uint64_t{1} << effect_count) - 1); }
    [[nodiscard]] static constexpr EffectSet from_bits(std::uint64_t bits) {
        EffectSet set;
        set.bits_ = bits;
        return set;
    }
    [[nodiscard]] constexpr bool has(Effect effect) const { return (bits_ & bit(effect)) != 0; }
    [[nodiscard]] constexpr bool covers(EffectSet other) const { return (other.bits_ & ~bits_) == 0; }
    [[nodiscard]] constexpr EffectSet with(Effect effect) const { return from_bits(bits_ | bit(effect)); }
    [[nodiscard]] constexpr EffectSet without(Effect effect) const { return from_bits(bits_ & ~bit(effect)); }
    [[nodiscard]] constexpr EffectSet without(EffectSet other) const { return from_bits(bits_ & ~other.bits_); }
    [[nodiscard]] constexpr EffectSet united(EffectSet other) const { return from_bits(bits_ | other.bits_); }
    [[nodiscard]] constexpr std::uint64_t bits() const { return bits_; }
    [[nodiscard]] constexpr int size() const { return std::popcount(bits_); }
    constexpr bool operator==(const EffectSet&) const = default;

private:
    static constexpr std::uint64_t bit(Effect effect) { return std::uint64_t{1} << static_cast<std::uint32_t>(effect); }
    std::uint64_t bits_ = 0;
};

// "nested-dielectrics"; the name that commands and reports use.
[[nodiscard]] std::string_view effect_name(Effect effect);

// The effects of a set by name, comma-separated.
[[nodiscard]] std::string effect_names(EffectSet set);

// One effect's finding: needed and by what ("material \"glass\""), or absent and why ("no entity moves").
struct EffectFinding {
    Effect effect = Effect::count;
    bool needed = false;
    std::string reason;
};

// The effects of vertices that next events light.
[[nodiscard]] EffectSet light_receiving_effects();

// All effects in order. What no ray can meet (an unused material, a texture of none, a black light) calls for nothing.
[[nodiscard]] std::vector<EffectFinding> find_effects(const Scene& scene, const RenderSettings& settings);
[[nodiscard]] EffectSet needed_effects(const Scene& scene, const RenderSettings& settings);

// What a renderer is to simulate: settings.effects, or what the scene calls for; what `supported` lacks besides is
// dropped. Throws UnsupportedError for:
// - an effect that the scene calls for and that settings.effects leaves out.
// - one that the scene calls for and that `supported` lacks (naming `backend`).
// - punctual lights that the integrator cannot find, or not behind a boundary or glass (MODEL.md section 8.3).
[[nodiscard]] EffectSet effects_to_simulate(
    const Scene& scene, const RenderSettings& settings, EffectSet supported, std::string_view backend);

}  // namespace tandem
