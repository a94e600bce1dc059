#include "common/exercise/class_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "common/deadline.h"
#include "common/exercise/submission.h"
#include "common/stopwatch.h"
#include "common/text.h"
#include "common/validation/report/junit.h"

namespace tandem {

namespace {

namespace fs = std::filesystem;

// 3 of "03-ray-sphere.glsl"; 0: it is no submission.
std::size_t exercise_of(const fs::path& file, std::size_t count) {
    const std::string name = file.filename().string();
    const std::size_t digits = name.find_first_not_of("0123456789");
    if (file.extension() != ".glsl" || digits == 0 || digits > 3 || digits == std::string::npos) return 0;
    const std::size_t number = std::stoul(name.substr(0, digits));
    return number <= count ? number : 0;
}

// By exercise, the first file by name in the folder and those within it.
std::map<std::size_t, std::string> files_of(const fs::path& folder, std::size_t count, bool deep) {
    std::set<fs::path> files;
    const auto add = [&](const fs::directory_entry& entry) {
        if (exercise_of(entry.path(), count) > 0) files.insert(entry.path());
    };
    if (deep)
        for (const auto& entry : fs::recursive_directory_iterator(folder)) add(entry);
    else
        for (const auto& entry : fs::directory_iterator(folder)) add(entry);
    std::map<std::size_t, std::string> first;
    for (const fs::path& file : files) first.try_emplace(exercise_of(file, count), fs::relative(file, folder).string());
    return first;
}

Mark mark_of_file(const Exercise& exercise, const fs::path& file, std::uint64_t seed) {
    const auto refused = [](const std::string& reason) {
        return Mark{.kind = MarkKind::wrong, .summary = "it is not read: " + reason, .evidence = {}, .errs_like = {}};
    };
    if (!fs::is_regular_file(fs::symlink_status(file))) return refused("it is no file of its own");
    try {
        return mark_of(exercise, read_submission(file), seed);
    } catch (const RefusedSubmission& refusal) {
        return refused(refusal.what());
    } catch (const InputError& error) {
        return refused(error.what());
    }
}

std::string title_of(const StudentMark& mark, std::span<const Exercise> exercises) {
    return fmt::format("{:02} {}", mark.exercise, exercises[mark.exercise - 1].title);
}

}  // namespace

std::size_t Student::right() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(marks, [](const StudentMark& m) { return m.mark.kind == MarkKind::right; }));
}

std::vector<Student> students_of(
    const fs::path& folder, std::span<const Exercise> exercises, std::vector<std::size_t> due) {
    if (!fs::is_directory(folder))
        throw InputError(folder.string() + ": is no folder; name one that holds submissions");
    std::map<std::string, std::map<std::size_t, std::string>> handed_in;
    bool one = false;
    if (const auto own = files_of(folder, exercises.size(), false); !own.empty()) {
        one = true;
        handed_in[fs::canonical(folder).filename().string()] = own;
    } else {
        for (const auto& entry : fs::directory_iterator(folder))
            if (fs::is_directory(entry.symlink_status()))
                handed_in[entry.path().filename().string()] = files_of(entry.path(), exercises.size(), true);
    }
    std::set<std::size_t> any;
    for (const auto& [name, files] : handed_in)
        for (const auto& [number, file] : files) any.insert(number);
    if (any.empty())
        throw InputError(
            folder.string() +
            ": holds no submission; a student's folder holds files that are named as tandem exercise start "
            "does, 03-ray-sphere.glsl");
    if (due.empty()) due.assign(any.begin(), any.end());
    std::vector<Student> students;
    for (const auto& [name, files] : handed_in) {
        Student& student = students.emplace_back(Student{name, one ? folder : folder / name, {}});
        for (const std::size_t number : due) {
            StudentMark& mark = student.marks.emplace_back(StudentMark{.exercise = number, .file = {}, .mark = {}});
            if (const auto found = files.find(number); found != files.end())
                mark.file = found->second;
            else
                mark.mark.summary = "nothing was handed in";
        }
    }
    return students;
}

void mark_all(std::vector<Student>& students, std::span<const Exercise> exercises, std::uint64_t seed,
    unsigned at_a_time, const std::function<void(double)>& tell, const std::stop_token& stop) {
    struct Task {
        fs::path file;
        StudentMark* mark;
    };
    std::vector<Task> tasks;
    for (Student& student : students)
        for (StudentMark& mark : student.marks)
            if (!mark.file.empty()) tasks.push_back({student.folder / mark.file, &mark});
    std::atomic<std::size_t> next = 0, done = 0;
    std::mutex guard;
    std::exception_ptr failure;
    const auto work = [&] {
        for (std::size_t i = next++; i < tasks.size() && !stop.stop_requested(); i = next++) {
            try {
                const Stopwatch watch;
                tasks[i].mark->mark = mark_of_file(exercises[tasks[i].mark->exercise - 1], tasks[i].file, seed);
                tasks[i].mark->seconds = watch.seconds();
            } catch (...) {
                const std::lock_guard lock(guard);
                if (!failure) failure = std::current_exception();
                next = tasks.size();
            }
            const std::lock_guard lock(guard);
            tell(static_cast<double>(++done) / static_cast<double>(tasks.size()));
        }
    };
    {
        std::vector<std::jthread> workers;
        for (unsigned i = 0; i < at_a_time; ++i) workers.emplace_back(work);
    }
    if (failure) std::rethrow_exception(failure);
    if (stop.stop_requested()) throw StoppedError("stopped; no marks were written");
}

std::string feedback_of(const Mark& mark) {
    std::string text = fmt::format("{}: {}\n", name_of(mark.kind), mark.summary);
    for (const std::string& line : mark.evidence) text += "  " + line + "\n";
    for (std::size_t i = 0; i < mark.errs_like.size(); ++i)
        text += fmt::format("  {} {}\n", i == 0 ? "errs like:" : "       or:", mark.errs_like[i]);
    return text;
}

std::string class_junit(const std::vector<Student>& students, std::span<const Exercise> exercises) {
    std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";
    for (const Student& student : students) {
        std::string cases;
        std::size_t undecided = 0;
        for (const StudentMark& mark : student.marks) {
            cases += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"",
                xml_escaped(student.name), xml_escaped(title_of(mark, exercises)), mark.seconds);
            const bool open = mark.mark.kind == MarkKind::undecided;
            undecided += open;
            if (mark.mark.kind == MarkKind::right)
                cases += "/>\n";
            else
                cases += fmt::format(">\n      <{0} type=\"{1}\" message=\"{2}\">{3}</{0}>\n    </testcase>\n",
                    open ? "error" : "failure", name_of(mark.mark.kind), xml_escaped(mark.mark.summary),
                    xml_escaped(feedback_of(mark.mark)));
        }
        xml += fmt::format("  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\">\n{}  </testsuite>\n",
            xml_escaped(student.name), student.marks.size(), student.marks.size() - student.right() - undecided,
            undecided, cases);
    }
    return xml + "</testsuites>\n";
}

nlohmann::json gradescope_results(const Student& student, std::span<const Exercise> exercises) {
    nlohmann::json tests = nlohmann::json::array();
    for (const StudentMark& mark : student.marks) {
        const bool right = mark.mark.kind == MarkKind::right;
        tests.push_back({{"name", title_of(mark, exercises)}, {"number", std::to_string(mark.exercise)},
            {"score", right ? 1.0 : 0.0}, {"max_score", 1.0}, {"status", right ? "passed" : "failed"},
            {"output", feedback_of(mark.mark)}, {"output_format", "text"}});
    }
    return {{"score", static_cast<double>(student.right())}, {"tests", tests}};
}

nlohmann::json coderunner_results(const Student& student, std::span<const Exercise> exercises) {
    nlohmann::json rows = {{"iscorrect", "Exercise", "Mark", "iscorrect"}};
    for (const StudentMark& mark : student.marks) {
        const bool right = mark.mark.kind == MarkKind::right;
        rows.push_back({right, title_of(mark, exercises), feedback_of(mark.mark), right});
    }
    return {{"fraction", static_cast<double>(student.right()) / static_cast<double>(student.marks.size())},
        {"testresults", rows}};
}

}  // namespace tandem
