// tandem export and tandem import: scenes to other renderers, and from them.
#include "common/scene/export/export.h"

#include <fmt/format.h>

#include <memory>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"
#include "common/scene/export/parts_json.h"
#include "common/scene/import/import.h"
#include "common/scene/loader/scene_loader.h"
#include "common/text.h"

namespace tandem {

namespace {

using scene_export::ExportedFile;
using scene_export::Target;

struct ExportArguments {
    std::string scene, target, out;
    RenderOptions options;  // size and bounces
    bool strict = false;
};

struct ImportArguments {
    std::string file, out;
};

std::filesystem::path path_of(const ExportedFile& file, const std::string& out) {
    return std::filesystem::path(out).parent_path() / file.name;
}

// All of them: those that the first one names go before it.
void write_files(const std::vector<ExportedFile>& files, const std::string& out, const CommandContext& context,
    const std::vector<std::string>& inputs) {
    std::vector<Output> outputs;
    for (const ExportedFile& file : files) outputs.push_back({"-o", path_of(file, out)});
    check_outputs(context, outputs, inputs);
    for (auto file = files.rbegin(); file != files.rend(); ++file)
        write_text_file(path_of(*file, out), file->bytes, context.read);
    for (const ExportedFile& file : files)
        fmt::print("Wrote {} ({:.3g} kB)\n", escaped(path_of(file, out).string()),
            static_cast<double>(file.bytes.size()) / 1e3);
}

nlohmann::json names_of(const std::vector<ExportedFile>& files, const std::string& out) {
    nlohmann::json names = nlohmann::json::array();
    for (const ExportedFile& file : files) names.push_back(path_of(file, out).string());
    return names;
}

ExitStatus run_export(const ExportArguments& arguments, const CommandContext& context) {
    NothingToKeep at_work(context.interrupts);
    const auto target = static_cast<Target>(
        std::ranges::find(scene_export::target_names, arguments.target) - scene_export::target_names.begin());
    check_outputs(context, {{"-o", arguments.out}}, {arguments.scene});
    std::vector<std::string> inputs;
    Scene scene = scene_from(arguments.scene, inputs);
    const RenderSettings settings = settings_from(arguments.options, scene);
    scene.film = {settings.width, settings.height};
    scene.defaults.bounces = settings.bounces;
    const std::string name = std::filesystem::path(arguments.out).filename().string();
    const auto files = export_scene(scene, target, {.name = name, .strict = arguments.strict});
    at_work.end();
    write_files(files, arguments.out, context, inputs);
    const std::vector<std::string> remarks = remarks_on(scene, target);
    for (const std::string& remark : remarks) fmt::print("  {}\n", escaped(remark));
    write_json(context, {{"scene", scene.name}, {"target", arguments.target}, {"files", names_of(files, arguments.out)},
                            {"remarks", remarks}});
    return ExitStatus::fine;
}

ExitStatus run_import(const ImportArguments& arguments, const CommandContext& context) {
    NothingToKeep at_work(context.interrupts);
    check_outputs(context, {{"-o", arguments.out}}, {arguments.file});
    scene_import::ImportedScene imported = scene_import::import_scene(arguments.file, arguments.out);
    std::vector<ExportedFile> files = std::move(imported.files);
    const std::string name = std::filesystem::path(arguments.out).filename().string();
    files.insert(files.begin(), {name, scene_export::text_of(imported.document, 1) + "\n"});
    at_work.end();
    write_files(files, arguments.out, context, imported.inputs);
    for (const std::string& remark : imported.remarks)
        fmt::print(stderr, "tandem: {}: {}\n", escaped(arguments.file), escaped(remark));
    write_json(
        context, {{"file", arguments.file}, {"files", names_of(files, arguments.out)}, {"remarks", imported.remarks}});
    return ExitStatus::fine;
}

}  // namespace

void add_export_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("export", "Write a scene in another renderer's format");
    const auto arguments = std::make_shared<ExportArguments>();
    command->add_option("scene", arguments->scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    command->add_option("--to", arguments->target, "gltf, pbrt (version 4), mitsuba (version 3) or blender")
        ->required()
        ->check(one_of_names(scene_export::target_names));
    command->add_option("-o,--output", arguments->out, "File to write")->required()->type_name("FILE");
    command
        ->add_option(
            "--size", arguments->options.size, "Image size in pixels, WxH or the longer side (default: the scene's)")
        ->type_name("SIZE");
    command
        ->add_option(
            "--bounces", arguments->options.bounces, "Scattering events of a path, at most (default: the scene's)")
        ->check(whole_between(0, 1'000'000));
    command->add_flag("--strict", arguments->strict,
        "gltf: refuse what the format cannot express, instead of keeping it for tandem import");
    add_common_options(*command, context,
        "  tandem export scenes/glass.json --to gltf -o glass.gltf\n"
        "  tandem import glass.gltf -o again.json\n"
        "  tandem verify again.json\n\n"
        "Prints what the target says otherwise than Tandem, and writes it into the file. scenes/format/EXPORT.md has "
        "all "
        "of it.\n"
        "Exit status: 0; 2 for what the target cannot say.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return run_export(*arguments, context); }; });
}

void add_import_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("import", "Make a scene file of a glTF or pbrt scene");
    const auto arguments = std::make_shared<ImportArguments>();
    command->add_option("file", arguments->file, "A .gltf or .glb file (2.0), or a .pbrt file (version 4)")
        ->required()
        ->type_name("FILE");
    command->add_option("-o,--output", arguments->out, "Scene file to write")->required()->type_name("FILE");
    add_common_options(*command, context,
        "  tandem import glass.gltf -o again.json\n"
        "A glTF file keeps its meshes: the scene file names it. stderr says what is not imported.\n"
        "Exit status: 0; 2 for scenes that Tandem cannot express.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return run_import(*arguments, context); }; });
}

}  // namespace tandem
