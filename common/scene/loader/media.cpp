// Participating media of a scene file, and their density grids (MODEL.md section 10).
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "common/error.h"
#include "common/scene/loader/parts.h"

namespace tandem::scene_json {

namespace {

// Their product with a length still fits single precision.
constexpr double greatest_coefficient = 1e9, greatest_density = 1e9;
constexpr std::uint64_t greatest_cells = std::uint64_t{1} << 24;
constexpr std::uint32_t greatest_cells_along = 4096;

glm::dvec3 read_coefficient(const Value& medium, std::string_view key) {
    if (!medium.has(key)) return glm::dvec3(0.0);
    const Value value = medium.member(key);
    if (value.json().is_array()) return value.vector(0.0, greatest_coefficient);
    return glm::dvec3(value.number(0.0, greatest_coefficient));
}

void check_box(const Value& value, const DensityGrid& grid) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(grid.low[axis] < grid.high[axis]))
            value.refuse(fmt::format("the box of the grid is empty along {}", "xyz"[axis]), "let low be below high");
}

// Version 3 of Mitsuba's volume files: "VOL", a byte 3, then little-endian int32: encoding (1: float32), cells along x,
// y, z, channels. Then come float32: the box, low then high, and the values, x fastest.
class VolumeFile {
public:
    VolumeFile(const Value& file, const std::filesystem::path& folder)
        : file_(file), name_(file.relative_file()), bytes_(read_named_file(folder / name_, file.place(), name_)) {}

    DensityGrid read(double scale) const {
        if (bytes_.size() < header_bytes || !bytes_.starts_with("VOL\x03"))
            refuse("is no volume file of version 3", "begin it with VOL and a byte 3");
        if (value<std::int32_t>(4) != 1) refuse("does not hold float32 values", "write it with encoding 1");
        if (value<std::int32_t>(20) != 1) refuse("has more channels than one, or none", "write densities alone");
        DensityGrid grid;
        std::uint64_t count = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto cells = value<std::int32_t>(8 + 4 * axis);
            if (cells < 1 || cells > static_cast<std::int32_t>(greatest_cells_along))
                refuse(fmt::format("has {} cells along {}", cells, "xyz"[axis]),
                    fmt::format("write 1 to {}", greatest_cells_along));
            grid.cells[axis] = static_cast<std::uint32_t>(cells);
            count *= grid.cells[axis];
            const auto place = static_cast<int>(axis);
            grid.low[place] = finite(value<float>(24 + 4 * axis));
            grid.high[place] = finite(value<float>(36 + 4 * axis));
        }
        if (count > greatest_cells || bytes_.size() != header_bytes + 4 * count)
            refuse(fmt::format("should hold {} values and does not", count), "write it again");
        grid.density.reserve(count);
        for (std::uint64_t i = 0; i < count; ++i) {
            const double density = scale * static_cast<double>(value<float>(header_bytes + 4 * i));
            if (!(density >= 0.0 && density <= greatest_density))  // false for what is no number
                refuse(fmt::format("value {} gives the density {}", i, density),
                    fmt::format("keep densities from 0 to {}", shown(greatest_density)));
            grid.density.push_back(static_cast<float>(density));
        }
        return grid;
    }

private:
    static constexpr std::size_t header_bytes = 48;
    static_assert(std::endian::native == std::endian::little);

    template <class T>
    T value(std::uint64_t offset) const {
        T result;
        std::memcpy(&result, bytes_.data() + offset, sizeof(T));
        return result;
    }
    double finite(float coordinate) const {
        if (!(std::abs(coordinate) <= greatest_length)) refuse("its box is not finite", "write it again");
        return coordinate;
    }
    [[noreturn]] void refuse(const std::string& reason, const std::string& mend) const {
        file_.refuse(printable(name_) + ": " + reason, mend);
    }

    Value file_;
    std::string name_, bytes_;
};

DensityGrid read_inline_grid(const Value& value) {
    value.only({"cells", "low", "high", "density"});
    DensityGrid grid;
    const Value cells = value.required("cells");
    if (cells.array_size() != 3)
        cells.refuse(fmt::format("has {} elements", cells.array_size()), "write an array of three numbers");
    std::uint64_t count = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        grid.cells[axis] = cells.element(axis).integer(1, greatest_cells_along);
        count *= grid.cells[axis];
    }
    grid.low = read_point(value.required("low"));
    grid.high = read_point(value.required("high"));
    const Value density = value.required("density");
    if (density.array_size() != count)
        density.refuse(fmt::format("has {} elements", density.array_size()), fmt::format("write {} numbers", count));
    grid.density.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        grid.density.push_back(static_cast<float>(density.element(i).number(0.0, greatest_density)));
    return grid;
}

DensityGrid read_grid(const Value& value, const std::filesystem::path& folder) {
    DensityGrid grid;
    if (value.has("file")) {
        value.only({"file", "scale"});
        const double scale = optional_number(value, "scale", 0.0, greatest_density, 1.0);
        grid = VolumeFile(value.member("file"), folder).read(scale);
    } else {
        grid = read_inline_grid(value);
    }
    check_box(value, grid);
    return grid;
}

}  // namespace

Medium read_medium(const Value& value, const std::string& name, const std::filesystem::path& folder) {
    value.only({"absorption", "scattering", "anisotropy", "grid"});
    Medium medium;
    medium.name = name;
    if (!value.has("absorption") && !value.has("scattering"))
        value.refuse("a medium that neither absorbs nor scatters is none", "give it absorption or scattering");
    medium.absorption = read_coefficient(value, "absorption");
    medium.scattering = read_coefficient(value, "scattering");
    if (value.has("anisotropy")) {
        const Value anisotropy = value.member("anisotropy");
        if (medium.scattering == glm::dvec3(0.0)) anisotropy.refuse("the medium does not scatter", "remove it");
        medium.anisotropy = anisotropy.number(-0.99, 0.99);
        // Below, section 10's inverse divides a difference that single precision has lost by it.
        if (medium.anisotropy != 0.0 && std::abs(medium.anisotropy) < 0.01)
            anisotropy.refuse(
                fmt::format("{} is too near 0", shown(medium.anisotropy)), "write 0, or a magnitude from 0.01 to 0.99");
    }
    if (value.has("grid")) medium.grid = std::make_shared<DensityGrid>(read_grid(value.member("grid"), folder));
    return medium;
}

}  // namespace tandem::scene_json
