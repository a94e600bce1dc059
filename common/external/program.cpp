#include "common/external/program.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/stopwatch.h"
#include "common/text.h"
#include "common/validation/compare/colour_space.h"

namespace tandem {

namespace {

constexpr double poll_seconds = 0.05;  // how late a stop may be heeded
constexpr std::size_t most_lines = 20, most_chatter = 8192;
// A request that takes longer than this, and so many times as long as others of its size, hangs.
constexpr double least_hang_seconds = 5.0, hang_factor = 10.0;
// A budget may end before the limit of a first request, which began later; that is no less a hang.
constexpr double most_of_limit = 0.5;

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::size_t begin = 0;
    while (begin < text.size()) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string line = text.substr(begin, end - begin);
        while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
        if (!line.empty()) lines.push_back(std::move(line));
        begin = end + 1;
    }
    return lines;
}

std::string end_of_file(const std::filesystem::path& path, std::size_t most) {
    std::ifstream stream(path, std::ios::binary | std::ios::ate);
    if (!stream) return {};
    const auto size = static_cast<std::size_t>(stream.tellg()), kept = std::min(size, most);
    std::string text(kept, '\0');
    stream.seekg(static_cast<std::streamoff>(size - kept));
    stream.read(text.data(), static_cast<std::streamsize>(kept));
    return text;
}

std::filesystem::path new_folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-exec-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw Error("cannot make a folder " + name + ": " + std::strerror(errno));
    return name;
}

std::string said(const nlohmann::json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

ExternalProgram::ExternalProgram(const std::string& command, double limit_seconds)
    : words_(command),
      name_(words_.program_name()),
      ending_(words_.ending()),
      limit_seconds_(limit_seconds),
      folder_(new_folder()) {
    if (!stays_up()) return;
    try {
        start();
    } catch (...) {
        resident_.reset();
        std::error_code error;
        std::filesystem::remove_all(folder_, error);
        throw;
    }
}

ExternalProgram::~ExternalProgram() {
    resident_.reset();
    std::error_code error;
    std::filesystem::remove_all(folder_, error);
}

bool ExternalProgram::is_told(const std::string& placeholder) const { return stays_up() || words_.has(placeholder); }

// Its last words follow the reason, so that the line alone says what happened.
ProgramFailure ExternalProgram::failure(const std::string& what) const {
    std::vector<std::string> lines = lines_of(chatter_ + end_of_file(folder_ / "log", most_chatter));
    if (lines.size() > most_lines) lines.erase(lines.begin(), lines.end() - most_lines);
    const std::string last = lines.empty() ? "" : ": " + printable(lines.back());
    if (lines.size() < 2) lines.clear();
    for (std::string& line : lines) line = "it wrote: " + printable(line);
    return {"exec: " + name_ + " " + what + last, std::move(lines)};
}

void ExternalProgram::start() {
    chatter_.clear();
    resident_ = std::make_unique<Child>(words_.filled({}), folder_ / "log", true);
    const Stopwatch watch;
    const std::optional<std::string> line = next_object([&] {
        if (watch.seconds() > limit_seconds_)
            throw failure(fmt::format("gave no first line {{\"tandem\": 1}} within {:g} s", limit_seconds_));
        return true;
    });
    const nlohmann::json hello = nlohmann::json::parse(line.value_or(""), nullptr, false);
    if (!hello.is_object() || hello.value("tandem", nlohmann::json()) != 1)
        throw failure(
            fmt::format("must say {{\"tandem\": 1}} in its first line, not {}", printable(line.value_or(""))));
    if (const std::string name = said(hello, "name"); !name.empty()) name_ = printable(name);
    version_ = printable(said(hello, "version"));
    if (const std::string ending = said(hello, "ending"); !ending.empty()) ending_ = ending;
    follows_numbers_ = hello.value("follows_model", nlohmann::json(false)) == true;
    may_be_negative_ = hello.value("negative_colours", nlohmann::json(false)) == true;
}

// The next line that is a JSON object; other lines are the chatter of libraries. Nothing: `go_on` says no.
std::optional<std::string> ExternalProgram::next_object(const std::function<bool()>& go_on) {
    for (;;) {
        if (!go_on()) return std::nullopt;
        const std::optional<std::string> line = resident_->line_within(poll_seconds);
        if (line && line->starts_with('{')) return line;
        if (line) {
            chatter_ += *line + "\n";
            if (chatter_.size() > 2 * most_chatter) chatter_.erase(0, most_chatter);
        } else if (resident_->closed()) {
            const bool ended = resident_->ended_within(1.0);
            throw failure(ended ? resident_->how_it_ended() : std::string("closed its standard output"));
        }
    }
}

bool ExternalProgram::answered(const ImageRequest& request, const std::function<bool()>& go_on) {
    if (!resident_) start();
    const nlohmann::json line{{"scene", request.scene.string()}, {"width", request.width}, {"height", request.height},
        {"samples", request.samples}, {"seed", request.seed}, {"first_sample", request.first_sample},
        {"bounces", request.bounces}, {"threads", request.threads}, {"out", request.out.string()}};
    if (!resident_->send(line.dump()))
        throw failure(resident_->ended_within(1.0) ? resident_->how_it_ended() : std::string("takes no more requests"));
    for (;;) {
        const std::optional<std::string> text = next_object(go_on);
        if (!text) return false;
        const nlohmann::json answer = nlohmann::json::parse(*text, nullptr, false);
        if (answer.is_object() && answer.contains("progress")) continue;
        if (const std::string error = answer.is_object() ? said(answer, "error") : ""; !error.empty())
            throw ProgramFailure("exec: " + name_ + ": " + printable(error));
        if (!answer.is_object() || answer.value("done", nlohmann::json(false)) != true)
            throw failure("answered neither {\"done\": true} nor {\"error\": ...} but " + printable(*text));
        return true;
    }
}

bool ExternalProgram::ran(const ImageRequest& request, const std::function<bool()>& go_on) {
    Child child(words_.filled(request), folder_ / "log", false);
    while (!child.ended_within(poll_seconds))
        if (!go_on()) return false;
    if (!child.succeeded()) throw failure(child.how_it_ended());
    return true;
}

std::optional<Image> ExternalProgram::render(
    ImageRequest request, const std::stop_token& stop, const std::function<void()>& tick) {
    request.out = folder_ / ("image." + ending_);
    std::error_code error;
    std::filesystem::remove(request.out, error);
    const Stopwatch watch;
    const double work = static_cast<double>(request.samples) * request.width * request.height;
    const auto go_on = [&] {
        if (watch.seconds() > limit_seconds_)
            throw failure(fmt::format("gave no image within {:g} s, and was ended", limit_seconds_));
        if (tick) tick();
        if (!stop.stop_requested()) return true;
        if (slowest_ == 0.0 && watch.seconds() > most_of_limit * limit_seconds_)
            throw failure(fmt::format("gave no image within {:.2g} s, and was ended", watch.seconds()));
        const double expected = slowest_ * std::max(1.0, work / std::max(most_, 1.0));
        if (slowest_ > 0.0 && watch.seconds() > std::max(least_hang_seconds, hang_factor * expected))
            throw failure(fmt::format("gave no image for {:.0f} s where it took at most {:.2g} s before, and was ended",
                watch.seconds(), slowest_));
        return false;
    };
    try {
        if (!(stays_up() ? answered(request, go_on) : ran(request, go_on))) {
            resident_.reset();  // it is at work on what nobody waits for
            return std::nullopt;
        }
        slowest_ = std::max(slowest_, watch.seconds());
        most_ = std::max(most_, work);
        return image_of(request);
    } catch (const ProgramFailure&) {
        resident_.reset();
        throw;
    }
}

Image ExternalProgram::image_of(const ImageRequest& request) const {
    if (!std::filesystem::exists(request.out))
        throw failure(stays_up() ? "says that it is done, but wrote no image to \"out\""
                                 : "succeeded, but wrote no image to {out}");
    Image image;
    try {
        image = read_image(request.out);
    } catch (const InputError& error) {
        throw failure(std::string("wrote no readable image: ") + error.what());
    }
    const auto size = [](std::uint32_t width, std::uint32_t height) { return fmt::format("{}x{}", width, height); };
    if (image.width != request.width || image.height != request.height)
        throw failure(fmt::format("wrote an image of {} pixels, not {}; give it {{width}} and {{height}}",
            size(image.width, image.height), size(request.width, request.height)));
    if (image.greatest_integer > 0)
        throw failure("wrote an image of integers, which ends at 1; write linear floats as EXR, PFM or NPY");
    const ColourSpace space = colour_space_of(image);
    if (space.transfer.curve != Transfer::Curve::linear)
        throw failure("wrote values encoded as '" + printable(image.colour_space) + "'; write linear light");
    Image ours;
    ours.colour_space = "linear";
    const std::string rec709 = colour_space_of(ours).primaries;
    if (!space.primaries.empty() && space.primaries != rec709)
        throw failure(
            "wrote an image in the colour space '" + printable(image.colour_space) + "'; write linear " + rec709);
    std::filesystem::remove(request.out);
    return image;
}

}  // namespace tandem
