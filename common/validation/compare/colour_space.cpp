#include "common/validation/compare/colour_space.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace tandem {

namespace {

using TransferCurve = Transfer::Curve;

struct Synonym {
    std::string_view name;  // lower case, letters and digits alone
    std::string_view primaries;
    TransferCurve curve = TransferCurve::linear;
    double exponent = 1.0;
};

constexpr std::string_view rec709 = "Rec. 709";

// Names of OpenImageIO, of OpenColorIO's configurations for ACES and of Blender. README.md lists them for users.
constexpr std::array synonyms{Synonym{"linear", rec709}, Synonym{"scenelinear", rec709}, Synonym{"linrec709", rec709},
    Synonym{"linrec709scene", rec709}, Synonym{"linsrgb", rec709}, Synonym{"linearsrgb", rec709},
    Synonym{"srgblinear", rec709}, Synonym{"linearrec709", rec709}, Synonym{"linearbt709", rec709},
    Synonym{"linearrec709srgb", rec709}, Synonym{"utilitylinearsrgb", rec709}, Synonym{"utilitylinearrec709", rec709},
    Synonym{"srgb", rec709, TransferCurve::srgb}, Synonym{"srgbtexture", rec709, TransferCurve::srgb},
    Synonym{"srgbtx", rec709, TransferCurve::srgb}, Synonym{"srgbrec709scene", rec709, TransferCurve::srgb},
    Synonym{"srgbrec709display", rec709, TransferCurve::srgb}, Synonym{"srgbdisplay", rec709, TransferCurve::srgb},
    Synonym{"srgbencodedrec709srgb", rec709, TransferCurve::srgb},
    Synonym{"utilitysrgbtexture", rec709, TransferCurve::srgb}, Synonym{"g22rec709", rec709, TransferCurve::power, 2.2},
    Synonym{"g22rec709scene", rec709, TransferCurve::power, 2.2},
    Synonym{"g18rec709", rec709, TransferCurve::power, 1.8},
    Synonym{"g18rec709scene", rec709, TransferCurve::power, 1.8}, Synonym{"acescg", "ACEScg"},
    Synonym{"acesacescg", "ACEScg"}, Synonym{"linap1", "ACEScg"}, Synonym{"linap1scene", "ACEScg"},
    Synonym{"aces20651", "ACES2065-1"}, Synonym{"acesaces20651", "ACES2065-1"}, Synonym{"linap0", "ACES2065-1"},
    Synonym{"linap0scene", "ACES2065-1"}, Synonym{"linrec2020", "Rec. 2020"}, Synonym{"linrec2020scene", "Rec. 2020"},
    Synonym{"linearrec2020", "Rec. 2020"}, Synonym{"linearbt2020", "Rec. 2020"}};

std::string lower(std::string_view text) {
    std::string result;
    for (const char c : text) result += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return result;
}

std::string bare(std::string_view text) {
    std::string result = lower(text);
    std::erase_if(result, [](char c) { return !((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')); });
    return result;
}

// "Gamma2.2", as a PNG file's gamma is told.
std::optional<double> exponent_of(std::string_view name) {
    constexpr std::string_view gamma = "gamma";
    double value = 0.0;
    const auto [end, error] =
        std::from_chars(name.data() + std::min(gamma.size(), name.size()), name.data() + name.size(), value);
    const bool whole = error == std::errc{} && end == name.data() + name.size();
    return lower(name).starts_with(gamma) && whole && value > 0.0 ? std::optional(value) : std::nullopt;
}

}  // namespace

double Transfer::decoded(double value) const {
    const double size = std::abs(value);
    switch (curve) {
        case TransferCurve::linear:
            return value;
        case TransferCurve::srgb:  // [IEC 61966-2-1]
            return std::copysign(size <= 0.04045 ? size / 12.92 : std::pow((size + 0.055) / 1.055, 2.4), value);
        case TransferCurve::power:
            break;
    }
    return std::copysign(std::pow(size, exponent), value);
}

double Transfer::encoded(double light) const {
    const double size = std::abs(light);
    switch (curve) {
        case TransferCurve::linear:
            return light;
        case TransferCurve::srgb:
            return std::copysign(size <= 0.0031308 ? 12.92 * size : 1.055 * std::pow(size, 1.0 / 2.4) - 0.055, light);
        case TransferCurve::power:
            break;
    }
    return std::copysign(std::pow(size, 1.0 / exponent), light);
}

double Transfer::slope(double value) const {
    const double size = std::abs(value);
    switch (curve) {
        case TransferCurve::linear:
            return 1.0;
        case TransferCurve::srgb:
            return size <= 0.04045 ? 1.0 / 12.92 : 2.4 / 1.055 * std::pow((size + 0.055) / 1.055, 1.4);
        case TransferCurve::power:
            break;
    }
    return exponent * std::pow(size, exponent - 1.0);
}

ColourSpace colour_space_of(const Image& image) {
    if (image.colour_space.empty())
        return image.greatest_integer > 0 ? ColourSpace{std::string(rec709), {TransferCurve::srgb, 1.0}}
                                          : ColourSpace{};
    if (const std::optional<double> exponent = exponent_of(image.colour_space))
        return {std::string(rec709), {TransferCurve::power, *exponent}};
    // Chromaticities beside the name (image_io_oiio.cpp) are other primaries; the curve is still the name's.
    const std::size_t comma = image.colour_space.find(", chromaticities");
    const std::string name = image.colour_space.substr(0, comma);
    const std::string rest = comma == std::string::npos ? "" : image.colour_space.substr(comma + 2);
    const auto found = std::ranges::find(synonyms, bare(name), &Synonym::name);
    if (found == synonyms.end()) return {lower(image.colour_space), {}};
    return {rest.empty() ? std::string(found->primaries) : rest, {found->curve, found->exponent}};
}

}  // namespace tandem
