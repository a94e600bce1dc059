// A user's own arms: a shared library with the interface of tandem/arm.h, loaded and checked. Each call of its
// functions is recorded first, so that the report of a crash names the function.
#pragma once

#include <functional>
#include <string>

#include "common/error.h"
#include "vulkan/bench/own_arms/tandem/arm.h"

namespace tandem {

// Is told what is about to be called, "many-fills: run()", and, empty, that it has returned.
using Entering = std::function<void(const std::string& where)>;

class ArmLibrary {
public:
    // Throws InputError where the file is no such library or what it says is not whole. It stays loaded: what it
    // registered with the system may outlive this object.
    ArmLibrary(const std::string& file, Entering entering);

    [[nodiscard]] const std::string& file() const { return file_; }
    [[nodiscard]] const TandemArmLibrary& told() const { return *told_; }
    [[nodiscard]] std::string hash() const;  // of the file

    // Calls a function of an arm that returns text, or null where all is well. Throws Error with the text.
    template <class Function>
    void call(const TandemArm& arm, const char* name, Function function) const {
        if (const char* failure = tell(arm, name, function); failure != nullptr)
            throw Error(file_ + ": " + arm.name + ": " + name + "() failed: " + failure);
    }
    // The same without a judgement of what is returned.
    template <class Function>
    [[nodiscard]] const char* tell(const TandemArm& arm, const char* name, Function function) const {
        enter(std::string(arm.name) + ": " + name + "()");
        const char* text = nullptr;
        try {
            text = function();
        } catch (const std::exception& failure) {
            enter("");
            throw Error(file_ + ": " + arm.name + ": " + name + "() threw an exception: " + failure.what());
        }
        enter("");
        return text;
    }

private:
    void enter(const std::string& where) const {
        if (entering_) entering_(where);
    }
    void check() const;

    std::string file_;
    Entering entering_;
    const TandemArmLibrary* told_ = nullptr;
};

}  // namespace tandem
