// tandem view: a window in which a scene is rendered better and better while the camera moves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"
#include "common/files/write_file.h"
#include "common/image/image_io.h"
#include "common/render/adaptive_sampling.h"
#include "common/text.h"

namespace tandem {

namespace {

struct ViewArguments {
    std::string scene, backend = "vulkan", device, kernel, precision, output, save;
    std::string present_mode{present_mode_names[0]};
    RenderOptions options;
    std::optional<std::uint64_t> samples;
    std::uint64_t frames = 0;
    unsigned threads = 0;
    bool split = false, full_screen = false, validation = false;
    double exposure = 1.0;
};

// The backends that are shown, from left to right.
std::vector<std::string> backends_of(const ViewArguments& arguments) {
    if (arguments.split) return {"cpu", "vulkan"};
    return {arguments.backend};
}

std::unique_ptr<ProgressiveView> make_view(const ViewArguments& arguments, const std::string& name, const Scene& scene,
    const RenderSettings& settings, const CommandContext& context) {
    const Backend& backend = find_backend(context.program.backends, name);
    const bool vulkan = name == "vulkan";
    const BackendOptions options{.device = vulkan ? arguments.device : "",
        .precision = precision_from(arguments.precision),
        .kernel = vulkan ? arguments.kernel : "",
        .threads = name == "cpu" ? arguments.threads : 0,
        .validation = vulkan && arguments.validation};
    return std::make_unique<ProgressiveView>(
        backend.create(options), scene, settings, arguments.samples.value_or(numbers_alike));
}

// The files that F2 writes: the view as a scene, what is seen, and each backend's estimate.
struct SavedFiles {
    std::string scene, picture;
    std::vector<std::string> estimates;
};

SavedFiles saved_files(const ViewArguments& arguments) {
    SavedFiles files{arguments.save + ".json", arguments.save + ".png", {}};
    for (const std::string& backend : backends_of(arguments))
        files.estimates.push_back(arguments.save + "-" + backend + ".exr");
    return files;
}

std::vector<Output> outputs_of(const ViewArguments& arguments, const SavedFiles& saved) {
    std::vector<Output> outputs{{"-o", arguments.output, OutputKind::image}};
    if (saved.scene.empty()) return outputs;
    outputs.push_back({"--save", saved.scene});
    outputs.push_back({"--save", saved.picture, OutputKind::image});
    for (const std::string& file : saved.estimates) outputs.push_back({"--save", file, OutputKind::image});
    return outputs;
}

// Without variances where the scatter of samples does not tell them.
Image image_from(const ProgressiveView& view, const Estimate& estimate, const ViewArguments& arguments) {
    const bool independent = arguments.options.generator != generator_names[static_cast<std::size_t>(Generator::sobol)];
    return image_of(film_of(estimate),
        {{"tandem:samples", std::to_string(estimate.count())}, {"tandem:backend", view.info().backend},
            {"tandem:device", view.info().device}},
        independent);
}

void write_seen(
    const std::string& file, const ViewSession& session, const Appearance& appearance, const FilesRead& read) {
    const Image seen = session.seen(appearance.split);
    if (seen.width == 0) throw Error("there is no picture to save yet");
    write_png(file, seen, appearance.exposure, read);
}

// What the user asks for in the window. Checked each time: until he asks, nothing of it need be writable.
std::string save_all(const SavedFiles& files, const ViewArguments& arguments, const ViewSession& session,
    const Appearance& appearance, const CommandContext& context, const std::vector<std::string>& inputs) {
    check_outputs(context, outputs_of(arguments, files), inputs);
    write_seen(files.picture, session, appearance, context.read);
    write_text_file(files.scene, scene_text_with(arguments.scene, session.camera(), files.scene), context.read);
    std::string text = "saved: " + files.scene + ", " + files.picture;
    for (std::size_t i = 0; i < session.view_count(); ++i) {
        const Estimate estimate = session.view(i).estimate();
        write_image(files.estimates[i], image_from(session.view(i), estimate, arguments), context.read);
        text += ", " + files.estimates[i];
    }
    return text;
}

void write_output(
    const ViewArguments& arguments, const ViewSession& session, const Appearance& appearance, const FilesRead& read) {
    const std::string& file = arguments.output;
    if (is_png(file)) {
        write_seen(file, session, appearance, read);
        return;
    }
    const Estimate estimate = session.view(0).estimate();
    if (estimate.pixel_count() == 0) throw Error("-o: the window was closed before there was a picture");
    write_image(file, image_from(session.view(0), estimate, arguments), read);
}

nlohmann::json to_json(const ViewSession& session, const WindowReport& report) {
    nlohmann::json backends = nlohmann::json::array();
    for (std::size_t i = 0; i < session.view_count(); ++i) {
        const ViewState state = session.view(i).state();
        const RendererInfo& info = session.view(i).info();
        backends.push_back({{"backend", info.backend}, {"device", info.device}, {"samples", state.samples},
            {"seconds", state.seconds}, {"prepare_seconds", state.prepare_seconds}, {"failure", state.failure}});
    }
    const auto vector = [](const glm::dvec3& v) { return nlohmann::json{v.x, v.y, v.z}; };
    const double rate = report.seconds > 0.0 ? static_cast<double>(report.frames - 1) / report.seconds : 0.0;
    return {{"scene", session.scene().name}, {"width", session.width()}, {"height", session.height()},
        {"backends", backends}, {"window_device", report.device}, {"frames", report.frames},
        {"seconds", report.seconds}, {"frames_per_second", rate}, {"slow_frame_seconds", report.slow_frame_seconds},
        {"swapchains", report.swapchains}, {"swapchain_images", report.swapchain_images},
        {"present_mode", present_mode_names[static_cast<std::size_t>(report.present_mode)]},
        {"camera", {{"position", vector(session.camera().position)}, {"target", vector(session.camera().target)}}}};
}

void print_report(const nlohmann::json& report) {
    for (const nlohmann::json& side : report.at("backends")) {
        if (const auto failure = side.at("failure").get<std::string>(); !failure.empty())
            fmt::print(stderr, "tandem: {}: {}\n", side.at("backend").get<std::string>(), escaped(failure));
        else
            fmt::print("{}: {} samples a pixel of {}x{} in {:.2f} s since the camera moved\n",
                side.at("backend").get<std::string>(), side.at("samples").get<std::uint64_t>(),
                report.at("width").get<unsigned>(), report.at("height").get<unsigned>(),
                side.at("seconds").get<double>());
    }
    fmt::print("window: {} frames, {:.3g} a second (95 % came within {:.0f} ms), {}, {} swapchain images\n",
        report.at("frames").get<std::uint64_t>(), report.at("frames_per_second").get<double>(),
        1e3 * report.at("slow_frame_seconds").get<double>(), report.at("present_mode").get<std::string>(),
        report.at("swapchain_images").get<unsigned>());
}

// A window in which the whole image fits, enlarged if it is small; as large as most screens at most.
void choose_window_size(const RenderSettings& settings, WindowOptions& options) {
    constexpr double wide = 1280.0, high = 720.0;
    double scale = std::min(wide / settings.width, high / settings.height);
    if (scale > 1.0) scale = std::floor(scale);
    options.width = static_cast<std::uint32_t>(std::max(320.0, scale * settings.width));
    options.height = static_cast<std::uint32_t>(std::max(240.0, scale * settings.height));
}

WindowOptions window_options(const ViewArguments& arguments, const RenderSettings& settings, const std::string& title) {
    WindowOptions options;
    options.title = title;
    choose_window_size(settings, options);
    options.device = arguments.device;
    options.full_screen = arguments.full_screen;
    options.frames = arguments.frames;
    options.frames_wait = arguments.samples.has_value();
    options.validation = arguments.validation;
    options.appearance.exposure = arguments.exposure;
    for (std::size_t i = 0; i < present_mode_names.size(); ++i)
        if (arguments.present_mode == present_mode_names[i]) options.present_mode = static_cast<PresentMode>(i);
    return options;
}

ExitStatus view(ViewArguments arguments, const CommandContext& context) {
    if (!context.program.show)
        throw UnsupportedError("this build has no window (TANDEM_WINDOW is off); tandem render writes images");
    refuse_adaptive_sampling(arguments.options);
    NothingToKeep starting(context.interrupts);
    if (!arguments.output.empty()) check_image_ending(arguments.output);
    std::vector<std::string> inputs;
    const Scene scene = scene_from(arguments.scene, inputs);
    const RenderSettings settings = settings_from(arguments.options, scene);
    check_memory(settings);
    const bool named = !arguments.save.empty();
    if (!named) arguments.save = scene.name + "-view";
    const SavedFiles files = saved_files(arguments);
    check_outputs(context, outputs_of(arguments, named ? files : SavedFiles{}), inputs);

    WindowOptions options = window_options(arguments, settings, fmt::format("Tandem: {}", escaped(scene.name)));
    std::vector<std::unique_ptr<ProgressiveView>> views;
    for (const std::string& backend : backends_of(arguments))
        views.push_back(make_view(arguments, backend, scene, settings, context));
    ViewSession session(scene, settings, std::move(views));
    options.save = [&](const Appearance& appearance) {
        return save_all(files, arguments, session, appearance, context, inputs);
    };
    starting.end();
    const WindowReport report = context.program.show(session, options, context.stop);
    session.stop();

    if (!arguments.output.empty()) write_output(arguments, session, report.appearance, context.read);
    const nlohmann::json written = to_json(session, report);
    write_json(context, written);
    print_report(written);
    for (std::size_t i = 0; i < session.view_count(); ++i)
        if (!session.view(i).state().failure.empty()) return ExitStatus::no_device;
    return ExitStatus::fine;
}

void add_what(CLI::App& command, ViewArguments& arguments) {
    command.add_option("scene", arguments.scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    command.add_option("--backend", arguments.backend, "cpu, vulkan, oracle or first")->capture_default_str();
    command.add_flag("--split", arguments.split, "The CPU's image left of a line, Vulkan's right of it");
    command.add_option("--device", arguments.device, device_help);
    command
        .add_option(
            "--samples", arguments.samples, "Samples a pixel, at most; then the image stays (default: no limit)")
        ->check(whole_between(1, numbers_alike));
    command.add_option("--exposure", arguments.exposure, "Factor of the radiance that is shown")
        ->check(above_zero(1e9))
        ->capture_default_str();
    command
        .add_option("--save", arguments.save,
            "F2 writes PREFIX.json, the view as a scene; PREFIX.png, what is seen; and PREFIX-BACKEND.exr (default: "
            "the scene's name and -view)")
        ->type_name("PREFIX");
    command
        .add_option("-o,--output", arguments.output,
            "Image to write when the window closes. .png is what was seen; EXR is the left backend's, as render's")
        ->type_name("FILE");
}

void add_window(CLI::App& command, ViewArguments& arguments) {
    command.add_flag("--full-screen", arguments.full_screen, "Fill the screen");
    command
        .add_option(
            "--present-mode", arguments.present_mode, "Vulkan's present mode: fifo, fifo-relaxed, mailbox or immediate")
        ->check(one_of_names(present_mode_names))
        ->capture_default_str();
    command
        .add_option(
            "--frames", arguments.frames, "Close after this many frames, and after --samples if given. For scripts")
        ->check(whole_between(1, std::uint64_t{1} << 40));
    command.add_option("--precision", arguments.precision, precision_help);
    command.add_option("--kernel", arguments.kernel, kernel_help)->group(rare_options);
    command.add_option("--threads", arguments.threads, "CPU threads (default: all)")
        ->check(whole_between(1, 1024))
        ->group(rare_options);
    command.add_flag("--validation", arguments.validation, "Use Vulkan's validation layers; any message is an error")
        ->group(rare_options);
}

}  // namespace

void add_view_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("view", "Show a scene in a window; mouse and keys move the camera");
    const auto arguments = std::make_shared<ViewArguments>();
    add_what(*command, *arguments);
    add_window(*command, *arguments);
    add_render_options(*command, arguments->options);
    add_common_options(*command, context,
        "  tandem view scenes/glass.json\n"
        "  tandem view scenes/cornell-classic.json --split --size 320\n"
        "  xvfb-run -a tandem view scenes/glass.json --size 320 --samples 64 --frames 10 -o glass.png\n"
        "Drag turns the camera about its target, the wheel goes nearer, W A S D fly. The panel names the other keys.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return view(*arguments, context); }; });
}

}  // namespace tandem
