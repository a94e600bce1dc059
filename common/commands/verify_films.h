// `tandem verify` for a film that does not fit into memory: bins of its pixels are judged.
#pragma once

#include <optional>
#include <vector>

#include "common/commands/verify_sides.h"
#include "common/render/binned_film.h"

namespace tandem {

struct VerifiedFilm {
    RenderSettings settings;       // of what is judged: the film, or its bins
    std::optional<FilmSize> film;  // that takes more than the limit; empty: settings' own
};

// `settings` as they are where the film fits into `limit` bytes, else 128 bins along its longer side. Throws
// InputError, with the mend, where these options allow no bins.
[[nodiscard]] VerifiedFilm film_within(
    std::uint64_t limit, const RenderSettings& settings, const VerifyArguments& arguments, bool several_devices);

// What the bins will take, with the scene on all sides. Throws InputError where that exceeds `limit`. No film: nothing.
void check_bins(const VerifiedFilm& of, const Scene& scene, const std::string& file,
    const std::vector<const Renderer*>& renderers, std::uint64_t limit, bool verbose);

}  // namespace tandem
