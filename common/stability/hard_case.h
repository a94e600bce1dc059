// A hard case of scenes/hard/catalogue.json: the scene or the rays, the expected result, and its error bound. Ray cases
// are made by generators with a fixed seed. Image cases are scene files.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/render/ray_batch.h"
#include "common/scene/scene.h"

namespace tandem::stability {

// Seeded, and the same on every machine.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : engine_(seed) {}
    [[nodiscard]] double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  // [0, 1)
    [[nodiscard]] double between(double low, double high) { return low + (high - low) * unit(); }
    [[nodiscard]] std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
    [[nodiscard]] glm::dvec3 direction();  // uniform on the unit sphere
    [[nodiscard]] glm::dmat3 rotation();   // about a random axis

private:
    std::mt19937_64 engine_;
};

enum class Must { hit, miss, either };

// A ray, and what has to come of it. Whatever is hit is held to the primitive's surface (surface_distance.h).
struct JudgedRay {
    GivenRay ray{};
    Must must = Must::either;
    std::uint32_t primitive = no_index;  // that must be hit, or any
    std::optional<double> t{};           // that must be found, exactly
    bool leaves = false;                 // a wrong hit is a self-hit
    bool leads_on = false;               // the hit is a way station: `follow` makes the next ray of it
};

// One scene of a case, and its rays.
struct RayWork {
    Scene scene;
    std::function<JudgedRay(Dice&)> aim;
    // The ray after a hit; nothing: there is none.
    std::function<std::optional<JudgedRay>(const JudgedRay&, const RayHit&, Dice&)> follow;
    // The same hit must be found in another scene by a ray scaled by this power of two, to the bit.
    std::optional<double> scaled_twin;
    Scene twin;
    double scale = 0.0;  // of coordinates, for ulp; 0: the largest of the ray's and the scene's
};

// What kernels a case is about.
enum class Subject { triangles, convex, guards, images, changes };

struct ArmPattern {  // empty fields: any
    std::string backend, precision, kernel;
    bool seldom = false;  // fails for so few rays that it may also pass
};

using Parameters = std::map<std::string, double>;

struct HardCase {
    std::string id, name, generator, source;
    std::string bound_text;  // the derivation, short
    Subject subject = Subject::triangles;
    Parameters parameters;
    std::uint64_t rays = 0, seed = 0;
    double bound = 0.0;            // ulp of the largest coordinate
    double bound_vulkan = 0.0;     // that of the Vulkan renderer in single precision, where it differs; else equal
    double bound_double = 0.0;     // that of double precision, where it differs; else equal
    bool counts_as_aimed = false;  // at edges and vertices
    std::vector<ArmPattern> expected_failures;
    std::string change;  // metamorphic cases: a name of change_names, of these scenes
    std::vector<std::string> scene_files;
    std::string scene_file;  // image cases
    std::uint64_t samples = 0;
    std::optional<std::uint32_t> bounces;  // in place of the file's
    bool every_pixel = false;              // is held to the closed form by itself: all paths carry the same
};

// The rays of a case. Throws InputError for an unknown generator or a parameter that it lacks.
[[nodiscard]] std::vector<RayWork> make_ray_work(const HardCase& hard_case);

}  // namespace tandem::stability
