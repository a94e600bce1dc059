#include "common/validation/explanation/pixel_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <functional>

namespace tandem {

namespace {

constexpr double least_inside = 0.5, most_outside = 0.05;
constexpr std::size_t least_pixels = 4;  // fewer are at any places by chance

struct Found {
    std::string text;
    double contrast = 0.0;  // share touched inside, less that outside
};

class Patterns {
public:
    Patterns(const std::vector<bool>& touched, std::uint32_t width, std::uint32_t height)
        : touched_(touched), width_(width), height_(height) {}

    std::string run() {
        const auto all = static_cast<std::size_t>(std::ranges::count(touched_, true));
        if (all < least_pixels) return "";
        if (static_cast<double>(all) >= 0.95 * static_cast<double>(touched_.size())) return every_pixel;
        from_a_number_on();
        box();
        for (std::uint32_t period = 2; period <= 64; period *= 2) {
            repeated(period, "column", [&](std::size_t i) { return i % width_; });
            repeated(period, "row", [&](std::size_t i) { return i / width_; });
        }
        for (std::uint32_t period = 8; period <= 1024; period *= 2)
            if (width_ % period != 0)  // else these are columns
                repeated(period, "pixel", [](std::size_t i) { return i; });
        return found_.text;
    }

private:
    // At equal contrast the first pattern stays, which is the simplest.
    void consider(const std::string& text, const std::function<bool(std::size_t)>& inside) {
        double in = 0.0, of_in = 0.0, out = 0.0, of_out = 0.0;
        for (std::size_t i = 0; i < touched_.size(); ++i) {
            const double one = touched_[i] ? 1.0 : 0.0;
            (inside(i) ? in : out) += one;
            (inside(i) ? of_in : of_out) += 1.0;
        }
        if (of_in == 0.0 || of_out == 0.0) return;
        const double within = in / of_in, beyond = out / of_out, contrast = within - beyond;
        // What leaves out most of what is touched says nothing of it.
        if (in < least_inside * (in + out)) return;
        if (within < least_inside || beyond > most_outside || contrast <= found_.contrast + 1e-3) return;
        found_ = {text, contrast};
    }

    // The number before which and from which on the shares differ most.
    void from_a_number_on() {
        const auto all = static_cast<double>(std::ranges::count(touched_, true));
        const auto size = static_cast<double>(touched_.size());
        double before = 0.0, most = 0.0;
        std::size_t best = 0;
        for (std::size_t i = 0; i + least_pixels <= touched_.size(); ++i) {
            const auto n = static_cast<double>(i);
            const double contrast = (all - before) / (size - n) - (n > 0.0 ? before / n : 1.0);
            if (touched_[i] && contrast > most) {
                most = contrast;
                best = i;
            }
            before += touched_[i] ? 1.0 : 0.0;
        }
        if (best == 0) return;
        if (best % width_ == 0) return rows_from(best / width_);
        const std::string power = std::has_single_bit(best) ? fmt::format(" = 2^{}", std::countr_zero(best)) : "";
        consider(fmt::format("all pixels from number {}{} on, counted along rows", best, power),
            [=](std::size_t i) { return i >= best; });
    }

    void rows_from(std::size_t first) {
        const std::size_t number = first * width_, rows = height_ - first;
        const std::string power =
            std::has_single_bit(number) ? fmt::format(", from pixel 2^{} on", std::countr_zero(number)) : "";
        consider(rows == 1 ? "the last row" + power : fmt::format("the last {} rows{}", rows, power),
            [=](std::size_t i) { return i >= number; });
    }

    // Around what has touched neighbours: single pixels, parted by rounding, lie anywhere.
    void box() {
        std::uint32_t x0 = width_, y0 = height_, x1 = 0, y1 = 0;
        for (std::uint32_t y = 0; y < height_; ++y)
            for (std::uint32_t x = 0; x < width_; ++x) {
                if (!at(x, y) || neighbours(x, y) < 2) continue;
                x0 = std::min(x0, x), y0 = std::min(y0, y), x1 = std::max(x1, x + 1), y1 = std::max(y1, y + 1);
            }
        if (x0 >= x1) return;
        trim(x0, y0, x1, y1);
        const std::string columns = x1 == width_ && x0 + 1 == x1 ? std::string("the last column")
                                    : x1 == width_ && x0 > 0     ? fmt::format("the last {} columns", x1 - x0)
                                                                 : fmt::format("columns {} to {}", x0, x1 - 1);
        const std::string rows = y1 == height_ && y0 > 0 ? fmt::format("the last {} rows", y1 - y0)
                                                         : fmt::format("rows {} to {}", y0, y1 - 1);
        const std::string text = y0 == 0 && y1 == height_ ? columns
                                 : x0 == 0 && x1 == width_
                                     ? rows
                                     : fmt::format("x {} to {}, y {} to {}", x0, x1 - 1, y0, y1 - 1);
        consider(text, [=, this](std::size_t i) {
            const std::size_t x = i % width_, y = i / width_;
            return x >= x0 && x < x1 && y >= y0 && y < y1;
        });
    }

    // Takes off sides of the box that are mostly untouched.
    void trim(std::uint32_t& x0, std::uint32_t& y0, std::uint32_t& x1, std::uint32_t& y1) const {
        const auto sparse = [&](std::uint32_t u0, std::uint32_t v0, std::uint32_t u1, std::uint32_t v1) {
            std::uint64_t count = 0;
            for (std::uint32_t v = v0; v < v1; ++v)
                for (std::uint32_t u = u0; u < u1; ++u) count += at(u, v) ? 1 : 0;
            return static_cast<double>(count) < least_inside * (u1 - u0) * (v1 - v0);
        };
        while (x0 + 1 < x1 && sparse(x0, y0, x0 + 1, y1)) ++x0;
        while (x0 + 1 < x1 && sparse(x1 - 1, y0, x1, y1)) --x1;
        while (y0 + 1 < y1 && sparse(x0, y0, x1, y0 + 1)) ++y0;
        while (y0 + 1 < y1 && sparse(x0, y1 - 1, x1, y1)) --y1;
    }

    // Residues of a coordinate that are touched, where they are neighbours.
    void repeated(std::uint32_t period, const char* what, const std::function<std::size_t(std::size_t)>& coordinate) {
        std::vector<double> touched(period), all(period);
        for (std::size_t i = 0; i < touched_.size(); ++i) {
            touched[coordinate(i) % period] += touched_[i] ? 1.0 : 0.0;
            all[coordinate(i) % period] += 1.0;
        }
        std::uint32_t first = period, last = 0, count = 0;
        for (std::uint32_t r = 0; r < period; ++r) {
            if (all[r] == 0.0 || touched[r] < least_inside * all[r]) continue;
            first = std::min(first, r), last = r, ++count;
        }
        if (count == 0 || count == period || last - first + 1 != count) return;
        const std::string which =
            count == 1 ? fmt::format("{} {}", what, first) : fmt::format("{}s {} to {}", what, first, last);
        consider(fmt::format("{} of every {}, counted from 0", which, period), [=](std::size_t i) {
            const std::size_t r = coordinate(i) % period;
            return r >= first && r <= last;
        });
    }

    [[nodiscard]] bool at(std::uint32_t x, std::uint32_t y) const { return touched_[std::size_t{y} * width_ + x]; }
    [[nodiscard]] int neighbours(std::uint32_t x, std::uint32_t y) const {
        int count = 0;
        for (std::uint32_t v = y > 0 ? y - 1 : 0; v <= std::min(y + 1, height_ - 1); ++v)
            for (std::uint32_t u = x > 0 ? x - 1 : 0; u <= std::min(x + 1, width_ - 1); ++u)
                if ((u != x || v != y) && at(u, v)) ++count;
        return count;
    }

    const std::vector<bool>& touched_;
    std::uint32_t width_, height_;
    Found found_;
};

}  // namespace

std::string pixel_pattern(const std::vector<bool>& touched, std::uint32_t width, std::uint32_t height) {
    return Patterns(touched, width, height).run();
}

}  // namespace tandem
