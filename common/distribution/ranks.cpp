#include "common/distribution/ranks.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/distribution/device_group.h"
#include "common/error.h"
#include "common/files/load_module.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

using nlohmann::json;

// The first byte of a message.
enum Kind : char {
    hello = 'H',
    render = 'R',
    halt = 'S',
    progress = 'P',
    question = 'Q',
    done = 'D',
    failed = 'F',
    end = 'E'
};

constexpr auto poll = std::chrono::milliseconds(1);

template <class Value>
void put(std::string& message, const Value& value) {
    message.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string text_of(Kind kind, std::string_view text) {
    std::string message(1, kind);
    message.append(text);
    return message;
}

// Reads values off the front.
class Reader {
public:
    explicit Reader(std::string_view bytes) : bytes_(bytes) {}
    template <class Value>
    Value get() {
        Value value{};
        copy(&value, sizeof value);
        return value;
    }
    void copy(void* target, std::size_t count) {
        if (count > bytes_.size()) throw Error("a message of another rank is too short");
        std::memcpy(target, bytes_.data(), count);
        bytes_.remove_prefix(count);
    }

private:
    std::string_view bytes_;
};

std::string message_of(const RenderResult& result) {
    const std::vector<Estimate::Piece> pieces = result.estimate.pieces();
    std::string message(1, done);
    put(message, result.seconds);
    put(message, result.estimate.width());
    put(message, result.estimate.height());
    put(message, result.estimate.invalid());
    put(message, std::uint64_t{pieces.size()});
    for (const Estimate::Piece& piece : pieces) {
        put(message, piece.range);
        message.append(reinterpret_cast<const char*>(piece.moments->data()), piece.moments->size() * sizeof(Moments));
    }
    return message;
}

RenderResult result_of(std::string_view message) {
    Reader reader(message.substr(1));
    RenderResult result;
    result.seconds = reader.get<double>();
    const auto width = reader.get<std::uint32_t>(), height = reader.get<std::uint32_t>();
    result.estimate = Estimate(width, height);
    result.estimate.add_invalid(reader.get<std::uint64_t>());
    for (auto pieces = reader.get<std::uint64_t>(); pieces > 0; --pieces) {
        const auto range = reader.get<SampleRange>();
        Estimate::Plane plane(result.estimate.pixel_count() * channel_count);
        reader.copy(plane.data(), plane.size() * sizeof(Moments));
        result.estimate.add_block(range, std::move(plane));
    }
    return result;
}

const MpiModule* loaded_module() {
    // MPI's own modules look for its names among those of the program.
    const LoadedModule module = load_module(mpi_module_file, mpi_module_name, true);
    if (module.entry == nullptr)
        throw Error(
            fmt::format("mpirun started several processes, but MPI cannot be loaded ({}); build Tandem where "
                        "libopenmpi-dev is installed",
                module.reason));
    return reinterpret_cast<const MpiModule* (*)()>(module.entry)();
}

}  // namespace

namespace {

constexpr std::array size_variables{"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"};  // of OpenMPI, and of others

}  // namespace

bool has_ranks() {
    for (const char* const name : size_variables)
        if (const char* const size = std::getenv(name); size != nullptr && std::atoi(size) > 1) return true;
    return false;
}

Ranks::Ranks() : module_(loaded_module()) {
    if (!module_->start(&rank_, &size_)) throw Error("MPI does not start, or not for threads");
    for (const char* const name : size_variables) ::unsetenv(name);
}

Ranks::~Ranks() {
    if (rank_ == 0)
        for (int other = 1; other < size_; ++other) send(other, std::string(1, end));
    module_->finish();
}

void Ranks::fail(const std::string& reason) { send(0, text_of(failed, reason)); }

void Ranks::send(int to, const std::string& message) {
    const std::lock_guard hold(lock_);
    module_->send(to, message.data(), message.size());
}

bool Ranks::receive(int from, std::string& message) {
    const std::lock_guard hold(lock_);
    std::uint64_t count = 0;
    if (!module_->is_waiting(from, &count)) return false;
    message.resize(count);
    module_->receive(from, message.data(), count);
    return true;
}

std::string Ranks::wait_for(int from, double seconds) {
    const Stopwatch watch;
    std::string message;
    while (!receive(from, message)) {
        if (watch.seconds() > seconds)
            throw Error(fmt::format("rank {} has not answered for {:.0f} s; look at its machine", from, seconds));
        std::this_thread::sleep_for(poll);
    }
    return message;
}

// What rank 0 has of another rank's job.
class RankJob final : public RenderJob {
public:
    RankJob(Ranks& ranks, int rank) : ranks_(ranks), rank_(rank) {}
    [[nodiscard]] RenderResult render(SampleRange range, const RenderControl& control) override {
        std::string message(1, tandem::render);
        put(message, range);
        ranks_.send(rank_, message);
        for (bool halted = false;;) {
            if (!halted && control.stop.stop_requested()) {
                halted = true;
                ranks_.send(rank_, std::string(1, halt));
            }
            if (!ranks_.receive(rank_, message)) {
                std::this_thread::sleep_for(poll);
                continue;
            }
            if (message.front() == done) return result_of(message);
            if (message.front() == failed) throw Error(message.substr(1));
            if (control.progress) control.progress(Reader(std::string_view(message).substr(1)).get<double>());
        }
    }

private:
    Ranks& ranks_;
    int rank_;
};

namespace {

class RankRenderer final : public Renderer {
public:
    RankRenderer(RendererInfo info, std::function<std::unique_ptr<RenderJob>()> make)
        : info_(std::move(info)), make_(std::move(make)) {}
    [[nodiscard]] RendererInfo info() const override { return info_; }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& /*scene*/, const RenderSettings& /*set*/) override {
        return make_();
    }

private:
    RendererInfo info_;
    std::function<std::unique_ptr<RenderJob>()> make_;
};

}  // namespace

std::unique_ptr<Renderer> Ranks::all(
    std::unique_ptr<Renderer> own, const std::string& task, const std::function<void(const std::string&)>& told) {
    constexpr double most_start_seconds = 600.0;  // for loading the scene and preparing it
    const RendererInfo info = own->info();
    std::vector<std::unique_ptr<Renderer>> members;
    members.push_back(std::move(own));
    for (int other = 1; other < size_; ++other) {
        const std::string message = wait_for(other, most_start_seconds);
        if (message.front() == failed) throw InputError(fmt::format("rank {}: {}", other, message.substr(1)));
        const json answer = json::parse(message.substr(1));
        if (answer.at("task") != task)
            throw InputError(
                fmt::format("rank {} has another scene, other options or another version of the program; "
                            "give all machines the same files",
                    other));
        RendererInfo theirs = info;
        theirs.backend = answer.at("backend").get<std::string>();
        theirs.device = answer.at("device").get<std::string>();
        theirs.driver = answer.at("driver").get<std::string>();
        theirs.api = answer.at("api").get<std::string>();
        members.push_back(
            std::make_unique<RankRenderer>(theirs, [this, other] { return std::make_unique<RankJob>(*this, other); }));
    }
    return device_group(std::move(members), told);
}

void Ranks::serve(RenderJob& job, const RendererInfo& info, const std::string& task, const std::stop_token& stop) {
    const json own{
        {"task", task}, {"backend", info.backend}, {"device", info.device}, {"driver", info.driver}, {"api", info.api}};
    send(0, text_of(hello, own.dump()));
    for (std::string message;;) {
        if (!receive(0, message)) {
            std::this_thread::sleep_for(poll);
            continue;
        }
        if (message.front() == end) return;
        if (message.front() == halt) continue;  // of a render that was done by then
        std::stop_source stopping;
        const std::stop_callback on_stop(stop, [&stopping] { stopping.request_stop(); });
        bool ended = false;
        double told = steady_seconds();
        const RenderControl control{.stop = stopping.get_token(), .progress = [&](double samples) {
                                        constexpr double seconds_between = 0.2;
                                        if (std::string word; receive(0, word)) {
                                            ended = word.front() == end;
                                            stopping.request_stop();
                                        }
                                        if (steady_seconds() - told < seconds_between) return;
                                        told = steady_seconds();
                                        std::string one(1, progress);
                                        put(one, samples);
                                        send(0, one);
                                    }};
        try {
            message = message_of(job.render(Reader(std::string_view(message).substr(1)).get<SampleRange>(), control));
        } catch (const std::exception& error) {
            message = text_of(failed, error.what());
        }
        send(0, message);
        if (ended) return;
    }
}

void Ranks::greet(const std::string& task) {
    constexpr double most_start_seconds = 60.0;
    for (int other = 1; other < size_; ++other) {
        const std::string message = wait_for(other, most_start_seconds);
        if (message.front() == failed) throw InputError(fmt::format("rank {}: {}", other, message.substr(1)));
        if (message.substr(1) != task)
            throw InputError(
                fmt::format("rank {} has another version of the program; give all machines the same files", other));
    }
}

void Ranks::ask(int other, const std::string& request) { send(other, text_of(question, request)); }

std::optional<std::string> Ranks::answer_of(int other) {
    std::string message;
    if (!receive(other, message)) return std::nullopt;
    if (message.front() == failed) throw Error(fmt::format("rank {}: {}", other, message.substr(1)));
    return message.substr(1);
}

void Ranks::answer(const std::string& task, const std::function<std::string(const std::string&)>& work) {
    send(0, text_of(hello, task));
    for (std::string message;;) {
        if (!receive(0, message)) {
            std::this_thread::sleep_for(poll);
            continue;
        }
        if (message.front() == end) return;
        try {
            message = text_of(done, work(message.substr(1)));
        } catch (const std::exception& error) {
            message = text_of(failed, error.what());
        }
        send(0, message);
    }
}

}  // namespace tandem
