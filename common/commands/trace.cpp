// tandem trace: one path, vertex by vertex, on several backends, and where they part.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/commands/trace_picture.h"
#include "common/error.h"
#include "common/text.h"
#include "common/validation/verify/trace_comparison.h"

namespace tandem {

namespace {

struct TraceArguments {
    std::string scene, device, precision, vulkan_precision, svg;
    std::vector<std::string> backends;  // empty: all that can follow the path
    std::vector<std::uint32_t> pixel;
    std::uint64_t sample = 0;
    RenderOptions options;
};

struct Traced {
    std::string name;
    RendererInfo info;
    PathTrace trace;
};

// All traces and how each lies to the first.
struct Result {
    const Scene& scene;
    RenderSettings settings;
    PlacedPrimitives placed;
    std::vector<Traced> traces;
    std::vector<std::string> left_out;  // "oracle: reason"
};

// The oracle samples no lights (MODEL.md section 9.1): where others do, its path is theirs, its radiance not.
CompareRadiance comparable(const Result& result, const Traced& a, const Traced& b) {
    const bool one_oracle = (a.name == "oracle") != (b.name == "oracle");
    return one_oracle && result.settings.integrator != Integrator::path ? CompareRadiance::no : CompareRadiance::yes;
}

TraceComparison compared(const Result& result, const Traced& a, const Traced& b) {
    return compare_traces(a.trace, b.trace, comparable(result, a, b));
}

std::string text_of(const glm::dvec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

std::string quoted(const std::string& name) { return name.empty() ? "" : fmt::format(" \"{}\"", printable(name)); }

// "primitive 3 of "floor", material "white"", "a medium", "nothing".
std::string met(const Result& result, const TracedVertex& vertex) {
    if (vertex.in_medium) return "a medium";
    if (vertex.primitive >= result.placed.size()) return "nothing";
    const std::string entity = result.scene.entities[result.placed[vertex.primitive].entity].name;
    const std::string material =
        vertex.material < result.scene.materials.size() ? result.scene.materials[vertex.material].name : "";
    return fmt::format("primitive {}{}{}", vertex.primitive, entity.empty() ? "" : " of" + quoted(entity),
        material.empty() ? "" : ", material" + quoted(material));
}

// The oracle tells the direction alone, others where the light was not seen.
bool is_told(const TracedLight& light) { return light.pdf > 0.0; }

void print_light(const TracedVertex& vertex, const char* indent) {
    const TracedLight& light = vertex.next_event;
    if (vertex.light == glm::dvec3(0.0))
        return fmt::print("{}a shadow ray to {} brought nothing\n", indent, text_of(light.direction));
    fmt::print("{}a light seen to {} brought {}\n", indent, text_of(light.direction), text_of(vertex.light));
    if (!is_told(light)) return;
    fmt::print("{}  of radiance {}, pdf {:.6g}, MIS weight {:.6g}, BSDF with cosine {}{}\n", indent,
        text_of(light.radiance), light.pdf, light.weight, text_of(light.response),
        light.transmittance == glm::dvec3(1.0) ? "" : ", transmittance " + text_of(light.transmittance));
}

void print_whole(const Result& result, const std::string& name, const TracedVertex& vertex) {
    fmt::print("  {:<8}{}: {}\n", name, met(result, vertex), event_name(result.scene, vertex));
    constexpr const char* indent = "          ";
    if (std::isfinite(vertex.t))
        fmt::print("{}t {:.6g}, position {}{}\n", indent, vertex.t, text_of(vertex.position),
            vertex.in_medium ? "" : ", normal " + text_of(vertex.normal));
    if (vertex.end == PathEnd::goes_on)
        fmt::print("{}goes on to {}, pdf {}, weight {}\n", indent, text_of(vertex.next_direction),
            vertex.pdf > 0.0 ? fmt::format("{:.6g}", vertex.pdf) : "none", text_of(weight_of(vertex)));
    if (vertex.survival > 0.0 && vertex.survival < 1.0)
        fmt::print("{}left by roulette with probability {:.6g}\n", indent, vertex.survival);
    if (vertex.found_weight > 0.0 && vertex.found_weight < 1.0)
        fmt::print("{}the light met there has MIS weight {:.6g}\n", indent, vertex.found_weight);
    if (vertex.next_event.direction != glm::dvec3(0.0)) print_light(vertex, indent);
    fmt::print("{}throughput {}, radiance so far {}\n", indent, text_of(vertex.throughput), text_of(vertex.radiance));
}

void print_distance(const std::string& name, const std::string& base, const VertexDistance& d, bool radiance) {
    fmt::print(
        "  {:<8}as {}; ulp apart: position {:.0f}, normal {:.0f}, direction {:.0f}, pdf {:.0f}, throughput "
        "{:.0f}{}\n",
        name, base, d.position_ulp, d.normal_ulp, d.direction_ulp, d.pdf_ulp,
        std::max(d.throughput_ulp, d.next_throughput_ulp),
        radiance ? fmt::format(", radiance {:.0f}", d.radiance_ulp) : "");
}

// The first backend whole, the others by their distance from it until they part.
void print_vertices(const Result& result, bool verbose) {
    const Traced& base = result.traces.front();
    std::size_t most = 0;
    std::vector<TraceComparison> comparisons;
    for (const Traced& traced : result.traces) {
        most = std::max(most, traced.trace.vertices.size());
        comparisons.push_back(compared(result, base, traced));
    }
    for (std::size_t k = 0; k < most; ++k) {
        fmt::print("\nvertex {}\n", k);
        for (std::size_t i = 0; i < result.traces.size(); ++i) {
            const Traced& traced = result.traces[i];
            const TraceComparison& comparison = comparisons[i];
            const bool parted = comparison.first_divergence && *comparison.first_divergence <= k;
            if (k >= traced.trace.vertices.size()) {
                if (parted || i == 0) fmt::print("  {:<8}has ended\n", traced.name);
                continue;
            }
            if (i > 0 && !parted && k < comparison.vertices.size())
                print_distance(traced.name, base.name, comparison.vertices[k],
                    comparable(result, base, traced) == CompareRadiance::yes);
            if (i == 0 || parted || verbose) print_whole(result, traced.name, traced.trace.vertices[k]);
        }
    }
}

void print_header(const Result& result, const TraceArguments& arguments) {
    const RenderSettings& settings = result.settings;
    fmt::print("{}: pixel ({}, {}) of {} x {}, sample {}, seed {}, integrator {}, at most {} bounces\n",
        escaped(result.scene.name), arguments.pixel[0], arguments.pixel[1], settings.width, settings.height,
        arguments.sample, settings.seed, integrator_name(settings.integrator), settings.bounces);
    for (const Traced& traced : result.traces)
        fmt::print("  {:<8}{}, {}\n", traced.name, traced.info.device, traced.info.driver);
    for (const std::string& reason : result.left_out) fmt::print("  left out: {}\n", reason);
}

void print_conclusion(const Result& result) {
    fmt::print("\n");
    bool radiance_left_out = false;
    for (const Traced& traced : result.traces)
        fmt::print("radiance, {:<8}{}\n", traced.name + ":", text_of(traced.trace.radiance));
    for (std::size_t b = 1; b < result.traces.size(); ++b)
        for (std::size_t a = 0; a < b; ++a) {
            const Traced &x = result.traces[a], &y = result.traces[b];
            const TraceComparison comparison = compared(result, x, y);
            radiance_left_out = radiance_left_out || comparable(result, x, y) == CompareRadiance::no;
            fmt::print("{} and {}: {}{}\n", x.name, y.name,
                comparison.first_divergence ? fmt::format("separate at vertex {}: ", *comparison.first_divergence) : "",
                comparison.reason);
        }
    if (radiance_left_out)
        fmt::print(
            "The oracle does no next-event estimation: its path is compared, its radiance is not (integrator {}).\n",
            integrator_name(result.settings.integrator));
}

nlohmann::json json_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

nlohmann::json index_or_null(std::uint32_t index) {
    return index == no_index ? nlohmann::json() : nlohmann::json(index);
}

nlohmann::json positive_or_null(double value) { return value > 0.0 ? nlohmann::json(value) : nlohmann::json(); }

nlohmann::json json_of_light(const TracedVertex& vertex) {
    const TracedLight& light = vertex.next_event;
    if (light.direction == glm::dvec3(0.0)) return {};
    nlohmann::json result{{"direction", json_of(light.direction)}};
    if (!is_told(light)) return result;
    result.update({{"radiance", json_of(light.radiance)}, {"pdf", light.pdf}, {"response", json_of(light.response)},
        {"transmittance", json_of(light.transmittance)}, {"weight", light.weight}});
    return result;
}

nlohmann::json json_of(const Result& result, const Traced& traced) {
    nlohmann::json vertices = nlohmann::json::array();
    for (const TracedVertex& v : traced.trace.vertices) {
        const bool goes_on = v.end == PathEnd::goes_on, hit = std::isfinite(v.t);
        const auto if_any = [](bool any, const glm::dvec3& value) { return any ? json_of(value) : nlohmann::json(); };
        vertices.push_back({{"event", event_name(result.scene, v)}, {"ray_origin", json_of(v.origin)},
            {"ray_direction", json_of(v.direction)}, {"t", hit ? nlohmann::json(v.t) : nlohmann::json()},
            {"position", if_any(hit, v.position)}, {"normal", if_any(hit && !v.in_medium, v.normal)},
            {"primitive", index_or_null(v.primitive)}, {"material", index_or_null(v.material)},
            {"in_medium", v.in_medium}, {"throughput", json_of(v.throughput)}, {"radiance", json_of(v.radiance)},
            {"next_direction", if_any(goes_on, v.next_direction)},
            {"next_throughput", if_any(goes_on, v.next_throughput)}, {"weight", if_any(goes_on, weight_of(v))},
            {"light", json_of(v.light)}, {"next_event", json_of_light(v)},
            {"shading_normal", if_any(v.shading_normal != glm::dvec3(0.0), v.shading_normal)},
            {"found_weight", positive_or_null(v.found_weight)}, {"survival", positive_or_null(v.survival)},
            {"pdf", positive_or_null(goes_on ? v.pdf : 0.0)}});
    }
    return {{"backend", traced.name}, {"device", traced.info.device}, {"driver", traced.info.driver},
        {"vertices", vertices}, {"radiance", json_of(traced.trace.radiance)}};
}

nlohmann::json json_of(const Result& result, const Traced& a, const Traced& b) {
    const TraceComparison comparison = compared(result, a, b);
    nlohmann::json vertices = nlohmann::json::array();
    for (const VertexDistance& d : comparison.vertices)
        vertices.push_back({{"position_ulp", d.position_ulp}, {"normal_ulp", d.normal_ulp},
            {"throughput_ulp", d.throughput_ulp}, {"next_direction_ulp", d.direction_ulp}, {"pdf_ulp", d.pdf_ulp},
            {"next_throughput_ulp", d.next_throughput_ulp}, {"radiance_ulp", d.radiance_ulp}});
    return {{"backends", {a.name, b.name}}, {"vertices", vertices}, {"reason", comparison.reason},
        {"radiance_compared", comparable(result, a, b) == CompareRadiance::yes},
        {"first_divergence",
            comparison.first_divergence ? nlohmann::json(*comparison.first_divergence) : nlohmann::json()}};
}

nlohmann::json json_of(const Result& result, const TraceArguments& arguments) {
    nlohmann::json report{{"scene", result.scene.name}, {"pixel", arguments.pixel}, {"sample", arguments.sample},
        {"seed", result.settings.seed}, {"width", result.settings.width}, {"height", result.settings.height},
        {"integrator", integrator_name(result.settings.integrator)}, {"mis", result.settings.mis},
        {"light_sampling", light_sampling_names[static_cast<std::size_t>(result.settings.light_sampling)]},
        {"filter", pixel_filter_names[static_cast<std::size_t>(result.settings.filter)]},
        {"bounces", result.settings.bounces}, {"left_out", result.left_out}, {"traces", nlohmann::json::array()},
        {"comparisons", nlohmann::json::array()}};
    for (std::size_t b = 0; b < result.traces.size(); ++b) {
        report["traces"].push_back(json_of(result, result.traces[b]));
        for (std::size_t a = 0; a < b; ++a)
            report["comparisons"].push_back(json_of(result, result.traces[a], result.traces[b]));
    }
    return report;
}

Traced trace_by(const Backend& backend, const TraceArguments& arguments, const Result& result) {
    BackendOptions options;
    if (backend.name == "vulkan") options.device = arguments.device;
    if (backend.name == "cpu") options.precision = precision_from(arguments.precision);
    if (backend.name == "vulkan") options.precision = precision_from(arguments.vulkan_precision);
    if (options.precision == Precision::half_storage)
        throw InputError(
            "--vulkan-precision: half-storage rounds what is kept between kernels, and a trace follows its path within "
            "one; leave it out");
    const auto renderer = backend.create(options);
    return {backend.name, renderer->info(),
        renderer->prepare(result.scene, result.settings)
            ->trace(arguments.pixel[0], arguments.pixel[1], {arguments.sample, arguments.sample + 1})
            .front()};
}

// Unless they are named, backends are left out that cannot follow such paths, or have no device.
void trace_by_all(const BackendList& backends, const TraceArguments& arguments, Result& result) {
    const auto leave_out = [&](const Backend& backend, const std::exception& error) {
        result.left_out.push_back(fmt::format("{}: {}", backend.name, error.what()));
    };
    for (const Backend& backend : backends) {
        if (backend.name == backend_to_read) continue;
        try {
            result.traces.push_back(trace_by(backend, arguments, result));
        } catch (const UnsupportedError& error) {
            leave_out(backend, error);
        } catch (const DeviceError& error) {
            if (!arguments.device.empty()) throw;
            leave_out(backend, error);
        }
    }
}

void write_picture(const Result& result, const TraceArguments& arguments, const CommandContext& context) {
    std::vector<DrawnPath> paths;
    for (const Traced& traced : result.traces) paths.push_back({traced.name, &traced.trace});
    const std::string title = fmt::format("{}: pixel ({}, {}) of {} x {}, sample {}", result.scene.name,
        arguments.pixel[0], arguments.pixel[1], result.settings.width, result.settings.height, arguments.sample);
    write_text_file(
        arguments.svg, trace_picture(result.scene, result.settings, title, arguments.pixel, paths), context.read);
}

// Options that would change nothing.
void check_options(const TraceArguments& arguments) {
    if (!arguments.options.accumulation.empty())
        throw InputError("--accumulation: one sample has nothing to add up; leave the option out");
    const auto check = [&](const char* option, const std::string& value, const char* backend) {
        if (!value.empty() && !arguments.backends.empty() &&
            std::ranges::find(arguments.backends, backend) == arguments.backends.end())
            throw InputError(
                fmt::format("{}: the {} backend is not named by --backends; add it there, or leave the option out",
                    option, backend));
    };
    check("--precision", arguments.precision, "cpu");
    check("--vulkan-precision", arguments.vulkan_precision, "vulkan");
    check("--device", arguments.device, "vulkan");
}

ExitStatus trace(const TraceArguments& arguments, const CommandContext& context) {
    check_options(arguments);
    refuse_adaptive_sampling(arguments.options);
    const NothingToKeep at_work(context.interrupts);
    std::vector<std::string> inputs;
    const Scene scene = scene_from(arguments.scene, inputs);
    Result result{scene, settings_from(arguments.options, scene), placed_primitives(scene), {}, {}};
    check_outputs(context, {{"--svg", arguments.svg}}, inputs);
    if (arguments.pixel[0] >= result.settings.width || arguments.pixel[1] >= result.settings.height)
        throw InputError(
            fmt::format("--pixel {},{}: lies outside the image of {} x {}; name a pixel from 0,0 (upper left) on, or "
                        "another --size",
                arguments.pixel[0], arguments.pixel[1], result.settings.width, result.settings.height));
    for (const std::string& name : arguments.backends)
        result.traces.push_back(trace_by(find_backend(context.program.backends, name), arguments, result));
    if (arguments.backends.empty()) trace_by_all(context.program.backends, arguments, result);
    if (result.traces.empty()) throw UnsupportedError("no backend can trace this path: " + result.left_out.front());
    print_header(result, arguments);
    print_vertices(result, context.verbose);
    print_conclusion(result);
    if (!arguments.svg.empty()) write_picture(result, arguments, context);
    write_json(context, json_of(result, arguments));
    return ExitStatus::fine;
}

}  // namespace

void add_trace_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("trace", "Trace one path, vertex by vertex, on several backends");
    const auto arguments = std::make_shared<TraceArguments>();
    command->add_option("scene", arguments->scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    command->add_option("--pixel", arguments->pixel, "Pixel; 0,0 is the upper left one")
        ->required()
        ->expected(2)
        ->delimiter(',')
        ->type_name("X,Y");
    command->add_option("--sample", arguments->sample, "Sample of the pixel, counted from 0")
        ->check(whole_between(0, std::uint64_t{1} << 40))
        ->capture_default_str();
    command
        ->add_option("--backends", arguments->backends,
            "cpu, vulkan, oracle or first, separated by commas. The first named is the base of comparison (default: "
            "all but first that can)")
        ->delimiter(',')
        ->type_name("NAME");
    command->add_option("--device", arguments->device, device_help);
    command->add_option("--precision", arguments->precision, "Precision of the cpu backend: single, double or mixed");
    command->add_option("--vulkan-precision", arguments->vulkan_precision,
        "Precision of the vulkan backend: single, double, contracted or mixed. Its records are single");
    command->add_option("--svg", arguments->svg, "Draw the paths, from above and as the camera sees them, to this .svg")
        ->type_name("FILE");
    add_render_options(*command, arguments->options);
    add_common_options(*command, context,
        "  tandem trace scenes/cornell-thesis.json --size 128 --pixel 64,90 --sample 5\n"
        "  tandem trace scenes/glass.json --pixel 10,20 --backends oracle,cpu --json path.json\n"
        "  tandem trace scenes/nested-glass.json --pixel 160,100 --svg path.svg\n"
        "All backends draw the same random numbers. Their paths are the same until rounding separates them. "
        "Distances are in ulp of single precision. -v prints every backend's figures.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return trace(*arguments, context); }; });
}

}  // namespace tandem
