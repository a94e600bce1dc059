// Another program that renders images on request: started for each, or kept up and asked by lines of JSON
// (README.md has the protocol).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/external/child.h"
#include "common/external/command_words.h"
#include "common/image/image_io.h"

namespace tandem {

// The program crashed, hung, or gave what is no image of the request: the fault is its own.
class ProgramFailure : public Error {
public:
    ProgramFailure(const std::string& what, std::vector<std::string> log = {}) : Error(what), log_(std::move(log)) {}
    // The last lines that it wrote, where the reason does not say them all.
    [[nodiscard]] const std::vector<std::string>& log() const { return log_; }

private:
    std::vector<std::string> log_;
};

class ExternalProgram {
public:
    // `command` as CommandWords takes it. A request may take `limit_seconds`. Starts a program that stays up, and hears
    // who it is. Throws InputError and ProgramFailure.
    ExternalProgram(const std::string& command, double limit_seconds);
    ~ExternalProgram();
    ExternalProgram(const ExternalProgram&) = delete;
    ExternalProgram& operator=(const ExternalProgram&) = delete;

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] const std::string& version() const { return version_; }
    [[nodiscard]] const std::string& command() const { return words_.text(); }
    [[nodiscard]] bool stays_up() const { return words_.stays_up(); }
    // Whether it says that it draws the numbers of MODEL.md section 3.
    [[nodiscard]] bool follows_numbers() const { return follows_numbers_; }
    // Whether it says that its colours may be negative.
    [[nodiscard]] bool may_be_negative() const { return may_be_negative_; }
    // Whether a request tells it that value.
    [[nodiscard]] bool is_told(const std::string& placeholder) const;

    // The image of the request, whose `out` is chosen here; nothing when stopped. `tick` is called while it waits.
    // Throws ProgramFailure.
    [[nodiscard]] std::optional<Image> render(
        ImageRequest request, const std::stop_token& stop, const std::function<void()>& tick);

private:
    [[nodiscard]] bool answered(const ImageRequest& request, const std::function<bool()>& go_on);
    [[nodiscard]] bool ran(const ImageRequest& request, const std::function<bool()>& go_on);
    void start();
    [[nodiscard]] std::optional<std::string> next_object(const std::function<bool()>& go_on);
    [[nodiscard]] Image image_of(const ImageRequest& request) const;
    [[nodiscard]] ProgramFailure failure(const std::string& what) const;

    CommandWords words_;
    std::string name_, version_, ending_;
    bool follows_numbers_ = false, may_be_negative_ = false;
    double limit_seconds_;
    std::filesystem::path folder_;  // for images and what the program writes to its standard error
    std::unique_ptr<Child> resident_;
    std::string chatter_;                // lines of its standard output that are no JSON
    double slowest_ = 0.0, most_ = 0.0;  // seconds and samples of requests so far
};

}  // namespace tandem
