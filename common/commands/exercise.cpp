// tandem exercise: the list of exercises, a file to begin with, and its mark.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/trace_picture.h"
#include "common/error.h"
#include "common/exercise/class_marks.h"
#include "common/exercise/mark_picture.h"
#include "common/exercise/submission.h"
#include "common/processors.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

namespace fs = std::filesystem;

struct ExerciseArguments {
    std::string action;
    std::vector<std::string> what;  // numbers or files; of `mark`, folders
    std::uint64_t seed = 0;
    std::vector<std::size_t> due;
    std::optional<unsigned> jobs;
    std::string junit, gradescope, coderunner;
};

std::string file_name(const Exercise& exercise, std::size_t number) {
    return fmt::format("{:02}-{}.glsl", number, exercise.slug);
}

std::optional<std::size_t> number_in(const std::string& text) {
    const bool digits = !text.empty() && text.size() < 4 &&
                        std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
    return digits ? std::optional<std::size_t>(std::stoul(text)) : std::nullopt;
}

// The number of an exercise that there is. Throws InputError.
std::size_t checked_number(const CommandContext& context, std::size_t number, const std::string& given) {
    const std::size_t count = context.program.exercises.size();
    if (number >= 1 && number <= count) return number;
    throw InputError(fmt::format("'{}' is no exercise; there are 1 to {}, see tandem exercise list", given, count));
}

// "3", "ray-sphere".
std::size_t number_from(const CommandContext& context, const std::string& text) {
    if (const auto number = number_in(text)) return checked_number(context, *number, text);
    std::vector<std::string> slugs;
    for (const Exercise& exercise : context.program.exercises) slugs.emplace_back(exercise.slug);
    const auto found = std::ranges::find(slugs, text);
    if (found == slugs.end())
        throw InputError(
            fmt::format("'{}' is no exercise; {}see tandem exercise list", text, did_you_mean(text, slugs)));
    return static_cast<std::size_t>(found - slugs.begin()) + 1;
}

// "03-ray-sphere.glsl" begins with its number.
std::size_t number_of_file(const CommandContext& context, const fs::path& file) {
    const std::string name = file.filename().string();
    const auto number = number_in(name.substr(0, name.find_first_not_of("0123456789")));
    if (!number)
        throw InputError(
            fmt::format("{}: the name does not begin with the number of an exercise; call it as "
                        "tandem exercise start does",
                file.string()));
    return checked_number(context, *number, name);
}

ExitStatus list_exercises(const CommandContext& context) {
    nlohmann::json report = nlohmann::json::array();
    std::size_t number = 0;
    for (const Exercise& exercise : context.program.exercises) {
        fmt::print("{:>2}  {:<20} {} (lesson {})\n", ++number, exercise.slug, exercise.title, exercise.lesson);
        report.push_back(
            {{"number", number}, {"slug", exercise.slug}, {"title", exercise.title}, {"lesson", exercise.lesson}});
    }
    write_json(context, report);
    return ExitStatus::fine;
}

ExitStatus start_exercises(const ExerciseArguments& arguments, const CommandContext& context) {
    if (arguments.what.empty()) throw InputError("which exercise? tandem exercise start 1; see tandem exercise list");
    std::vector<std::size_t> numbers;
    for (const std::string& word : arguments.what) {
        numbers.push_back(number_from(context, word));
        const std::string file = file_name(context.program.exercises[numbers.back() - 1], numbers.back());
        if (fs::exists(fs::symlink_status(file)))
            throw InputError(file + ": it is there already, and is not overwritten; move it away to begin anew");
    }
    for (const std::size_t number : numbers) {
        const Exercise& exercise = context.program.exercises[number - 1];
        const std::string file = file_name(exercise, number);
        write_text_file(file, starter_of(exercise, number));
        fmt::print("{}: {}\n", file, exercise.title);
    }
    return ExitStatus::fine;
}

struct Submission {
    fs::path file;
    std::size_t number;
};

// A number stands for the file that `start` writes.
Submission submission_from(const CommandContext& context, const std::string& word) {
    if (fs::exists(word)) return {word, number_of_file(context, word)};
    if (word.ends_with(".glsl")) throw InputError(word + ": there is no such file; tandem exercise start makes one");
    const std::size_t number = number_from(context, word);
    const std::string file = file_name(context.program.exercises[number - 1], number);
    if (!fs::exists(file))
        throw InputError(fmt::format("{}: there is no such file; tandem exercise start {} makes it", file, number));
    return {file, number};
}

PicturedMark mark_of(const CommandContext& context, const Submission& submission, std::uint64_t seed) {
    const Exercise& exercise = context.program.exercises[submission.number - 1];
    try {
        return pictured_mark_of(exercise, read_submission(submission.file), seed);
    } catch (const RefusedSubmission& refusal) {
        return {.mark = {.kind = MarkKind::wrong,
                    .summary = std::string("it is not read: ") + refusal.what(),
                    .evidence = {},
                    .errs_like = {}}};
    }
}

void print_mark(const std::string& file, const Mark& mark) {
    fmt::print("{}: {}", escaped(file), feedback_of(mark));
    std::fflush(stdout);
}

// "03-ray-sphere.glsl": writes 03-ray-sphere.png into the current folder, and says what to look at. Returns its name.
std::string write_picture(
    const Submission& submission, const std::optional<MarkPicture>& picture, const CommandContext& context) {
    if (!picture) return {};
    const std::string file = submission.file.stem().string() + ".png";
    try {
        write_png(file, image_of(*picture), 1.0, context.read);
    } catch (const InputError& error) {
        fmt::print(stderr, "tandem: no picture: {}\n", escaped(error.what()));
        return {};
    }
    fmt::print("  see    {}: right, yours, and the difference (red: yours is more, blue: less)\n         {}\n",
        escaped(file), picture->shows);
    std::fflush(stdout);
    return file;
}

// "03-ray-sphere.glsl": writes 03-ray-sphere.svg, as write_picture does its picture.
std::string write_paths(
    const Submission& submission, const std::optional<PartedPaths>& paths, const CommandContext& context) {
    if (!paths) return {};
    const std::string file = submission.file.stem().string() + ".svg";
    const ExercisePath& right = paths->right;
    const std::string title(context.program.exercises[submission.number - 1].title);
    try {
        write_text_file(file,
            trace_picture(right.scene, default_settings(right.scene), title, {right.pixel[0], right.pixel[1]},
                {{"right", &right.path}, {"yours", &paths->yours}}),
            context.read);
    } catch (const InputError& error) {
        fmt::print(stderr, "tandem: no picture: {}\n", escaped(error.what()));
        return {};
    }
    fmt::print("  see    {}: where your path parts from the right one\n", escaped(file));
    std::fflush(stdout);
    return file;
}

ExitStatus check_exercises(const ExerciseArguments& arguments, const CommandContext& context) {
    if (arguments.what.empty()) throw InputError("what is to be checked? tandem exercise check 1, or a file");
    const NothingToKeep at_work(context.interrupts);
    std::vector<Submission> submissions;
    std::vector<std::string> inputs;
    for (const std::string& word : arguments.what) {
        submissions.push_back(submission_from(context, word));
        inputs.push_back(submissions.back().file.string());
    }
    check_outputs(context, {}, inputs);
    nlohmann::json report = nlohmann::json::array();
    ExitStatus status = ExitStatus::fine;
    for (const Submission& submission : submissions) {
        const Stopwatch watch;
        const PicturedMark pictured = mark_of(context, submission, arguments.seed);
        const Mark& mark = pictured.mark;
        print_mark(submission.file.string(), mark);
        const std::string picture = write_picture(submission, pictured.picture, context);
        const std::string paths = write_paths(submission, pictured.paths, context);
        if (mark.kind == MarkKind::wrong) status = ExitStatus::disagree;
        if (mark.kind == MarkKind::undecided && status == ExitStatus::fine) status = ExitStatus::undecided;
        report.push_back({{"file", submission.file.string()}, {"exercise", submission.number},
            {"mark", name_of(mark.kind)}, {"summary", mark.summary}, {"evidence", mark.evidence},
            {"errs_like", mark.errs_like}, {"ran", mark.ran}, {"seconds", watch.seconds()}});
        if (!picture.empty()) report.back()["picture"] = picture;
        if (!paths.empty()) report.back()["paths"] = paths;
    }
    write_json(context, report);
    return status;
}

// A row a student: + right, x wrong, ? undecided, . not handed in.
void print_table(const std::vector<Student>& students) {
    std::size_t width = 0;
    for (const Student& student : students) width = std::max(width, escaped(student.name).size());
    fmt::print("{:{}}", "", width);
    for (const StudentMark& mark : students.front().marks) fmt::print(" {:>2}", mark.exercise);
    fmt::print("  right\n");
    for (const Student& student : students) {
        fmt::print("{:{}}", escaped(student.name), width);
        for (const StudentMark& mark : student.marks) {
            constexpr const char* signs = "+x?";  // as MarkKind has them
            fmt::print("  {}", mark.file.empty() ? '.' : signs[static_cast<std::size_t>(mark.mark.kind)]);
        }
        fmt::print("  {} of {}\n", student.right(), student.marks.size());
    }
    std::fflush(stdout);
}

nlohmann::json json_of(const std::vector<Student>& students) {
    nlohmann::json report = nlohmann::json::array();
    for (const Student& student : students) {
        nlohmann::json marks = nlohmann::json::array();
        for (const StudentMark& m : student.marks)
            marks.push_back({{"exercise", m.exercise}, {"file", m.file}, {"mark", name_of(m.mark.kind)},
                {"summary", m.mark.summary}, {"evidence", m.mark.evidence}, {"errs_like", m.mark.errs_like},
                {"seconds", m.seconds}});
        report.push_back({{"student", student.name}, {"right", student.right()}, {"marks", marks}});
    }
    return report;
}

ExitStatus mark_class(const ExerciseArguments& arguments, const CommandContext& context) {
    if (arguments.what.size() != 1) throw InputError("mark takes one folder, with a folder for each student");
    const std::string& folder = arguments.what.front();
    for (const std::size_t number : arguments.due) (void)checked_number(context, number, std::to_string(number));
    std::vector<Student> students = students_of(folder, context.program.exercises, arguments.due);
    for (const auto& [option, file] :
        {std::pair{"--gradescope", arguments.gradescope}, {"--coderunner", arguments.coderunner}})
        if (!file.empty() && students.size() != 1)
            throw InputError(fmt::format("{}: holds the marks of one student, and {} has {}; name a student's folder",
                option, folder, students.size()));
    std::vector<std::string> inputs;
    for (const Student& student : students)
        for (const StudentMark& mark : student.marks)
            if (!mark.file.empty() && fs::is_regular_file(student.folder / mark.file))
                inputs.push_back((student.folder / mark.file).string());
    check_outputs(context,
        {{"--junit", arguments.junit}, {"--gradescope", arguments.gradescope}, {"--coderunner", arguments.coderunner}},
        inputs);
    {
        ProgressLine progress;
        mark_all(
            students, context.program.exercises, arguments.seed, arguments.jobs.value_or(usable_processors()),
            [&](double share) { progress.update(share, "marking"); }, context.stop);
    }
    print_table(students);
    const auto write = [&](const std::string& file, const std::string& text) {
        if (!file.empty()) write_text_file(file, text, context.read);
    };
    const auto text_of = [](const nlohmann::json& json) {
        return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    };
    write(arguments.junit, class_junit(students, context.program.exercises));
    write(arguments.gradescope, text_of(gradescope_results(students.front(), context.program.exercises)));
    write(arguments.coderunner, text_of(coderunner_results(students.front(), context.program.exercises)));
    write_json(context, json_of(students));
    return ExitStatus::fine;
}

ExitStatus act_on(const ExerciseArguments& arguments, const CommandContext& context) {
    if (arguments.action == "list") return list_exercises(context);
    if (arguments.action == "start") return start_exercises(arguments, context);
    if (arguments.action == "check") return check_exercises(arguments, context);
    if (arguments.action == "mark") return mark_class(arguments, context);
    if (arguments.action == "inside" && arguments.what.size() == 1)  // the marker's own process
        return static_cast<ExitStatus>(run_inside(arguments.what.front(), context.program.run_list_shader));
    throw InputError("'" + arguments.action + "' is nothing to do; choose list, start, check or mark");
}

}  // namespace

void add_exercise_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("exercise", "Write parts of a path tracer in GLSL, and have them marked");
    const auto arguments = std::make_shared<ExerciseArguments>();
    command
        ->add_option(
            "ACTION", arguments->action, "list, start (write a file with the task), check (mark it) or mark (a class)")
        ->required();
    command->add_option("EXERCISE", arguments->what,
        "Numbers or names of exercises. check takes files, too; mark takes a folder with a folder for each student");
    command->add_option("--seed", arguments->seed, "Seed of the arguments for which a function is tested")
        ->check(whole_between(0, 1'000'000'000))
        ->capture_default_str();
    command
        ->add_option("--due", arguments->due,
            "Numbers of the exercises that mark counts, separated by commas (default: those that anybody handed in)")
        ->delimiter(',')
        ->type_name("NUMBERS");
    command
        ->add_option(
            "--jobs", arguments->jobs, "Submissions that mark runs at the same time (default: one a processor)")
        ->check(whole_between(1, 1024));
    command->add_option("--junit", arguments->junit, "Write the marks of a class as JUnit XML")->type_name("FILE");
    command
        ->add_option(
            "--gradescope", arguments->gradescope, "Write the marks of one student as Gradescope's results.json")
        ->type_name("FILE");
    command
        ->add_option(
            "--coderunner", arguments->coderunner, "Write the marks of one student for Moodle's CodeRunner, as JSON")
        ->type_name("FILE");
    add_common_options(*command, context,
        "  tandem exercise list\n  tandem exercise start 3\n  tandem exercise check 03-ray-sphere.glsl\n"
        "  tandem exercise mark submissions --due 3,4,5 --junit marks.xml");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return act_on(*arguments, context); }; });
}

}  // namespace tandem
