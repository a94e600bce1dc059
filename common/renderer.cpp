#include "common/renderer.h"

#include <algorithm>

#include "common/error.h"

namespace tandem {

RenderSettings default_settings(const Scene& scene) {
    RenderSettings settings;
    settings.width = scene.film.width;
    settings.height = scene.film.height;
    settings.integrator = scene.defaults.integrator;
    settings.bounces = scene.defaults.bounces;
    settings.roulette_start = scene.defaults.roulette_start;
    settings.ray_min = scene.defaults.ray_min;
    settings.ray_max = scene.defaults.ray_max;
    return settings;
}

const Backend& find_backend(const BackendList& backends, const std::string& name) {
    const auto found = std::ranges::find(backends, name, &Backend::name);
    if (found != backends.end()) return *found;
    std::string known;
    for (const Backend& backend : backends) known += (known.empty() ? "" : ", ") + backend.name;
    throw InputError("no backend '" + name + "'; choose one of " + known);
}

}  // namespace tandem
