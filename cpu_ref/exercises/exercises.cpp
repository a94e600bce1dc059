#include "cpu_ref/exercises/exercises.h"

namespace tandem {

std::span<const Exercise> exercises() {
    static const std::vector<Exercise> all = [] {
        std::vector<Exercise> list;
        for (const auto& part :
            {exercises_of_geometry(), exercises_of_sampling(), exercises_of_scattering(), exercises_of_light()})
            list.insert(list.end(), part.begin(), part.end());
        return list;
    }();
    return all;
}

}  // namespace tandem
