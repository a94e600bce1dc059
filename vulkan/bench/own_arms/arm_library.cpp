#include "vulkan/bench/own_arms/arm_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <span>

#include "common/files/read_file.h"
#include "common/text.h"

namespace tandem {

namespace {

constexpr const char* symbol = "tandem_arm_library";

std::string text_or_nothing(const char* text) { return text == nullptr ? "" : text; }

// Why the arm cannot be used; empty if it can.
std::string fault_of(const TandemArm& arm, std::set<std::string>& names) {
    const std::string name = text_or_nothing(arm.name);
    if (name.empty()) return "an arm has no name";
    if (!names.insert(name).second) return "two arms are called '" + name + "'";
    if (arm.make == nullptr) return "the arm '" + name + "' has no make()";
    if ((arm.record == nullptr) == (arm.run == nullptr))
        return "the arm '" + name + "' needs record() or run(), one of them";
    return {};
}

std::string fault_of(const TandemArmLibrary& told) {
    if (text_or_nothing(told.name).empty()) return "it has no name";
    if (text_or_nothing(told.unit).empty()) return "it names no unit of work";
    if (told.arms == nullptr || told.arm_count < 2) return "it has fewer than two arms";
    if (told.work == nullptr || told.work_count == 0) return "it says no amount of work";
    if (told.extensions == nullptr && told.extension_count > 0) return "its list of extensions is null";
    double before = 0.0;
    for (const double work : std::span(told.work, told.work_count)) {
        if (!std::isfinite(work) || !(work > before)) return "its amounts of work are not above 0 and ascending";
        before = work;
    }
    std::set<std::string> names;
    for (const TandemArm& arm : std::span(told.arms, told.arm_count))
        if (std::string fault = fault_of(arm, names); !fault.empty()) return fault;
    return {};
}

}  // namespace

ArmLibrary::ArmLibrary(const std::string& file, Entering entering) : file_(file), entering_(std::move(entering)) {
    std::error_code error;
    if (!std::filesystem::exists(file, error))
        throw input_error(file, "", "no such file", "give a shared library that is made with <tandem/arm.h>");
    enter("loading the library");
    void* const library = ::dlopen(std::filesystem::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL);
    enter("");
    if (library == nullptr)
        throw input_error(file, "", std::string("cannot be loaded: ") + ::dlerror(),
            "give a shared library that is made with <tandem/arm.h>");
    using Entry = const TandemArmLibrary* (*)();
    const auto entry = reinterpret_cast<Entry>(::dlsym(library, symbol));
    if (entry == nullptr)
        throw input_error(file, "", std::string("exports no ") + symbol + "()",
            "define it as <tandem/arm.h> declares it, in C++ as extern \"C\"");
    enter(std::string(symbol) + "()");
    told_ = entry();
    enter("");
    check();
}

void ArmLibrary::check() const {
    if (told_ == nullptr) throw input_error(file_, "", std::string(symbol) + "() returned null", "");
    if (told_->version != TANDEM_ARM_VERSION)
        throw input_error(file_, "",
            fmt::format(
                "is of version {} of <tandem/arm.h>; this program has version {}", told_->version, TANDEM_ARM_VERSION),
            "compile it with this program's header");
    if (const std::string fault = fault_of(*told_); !fault.empty())
        throw input_error(file_, "", "is not what <tandem/arm.h> asks for: " + fault, "");
}

std::string ArmLibrary::hash() const { return hash_of(read_file(file_)); }

}  // namespace tandem
