// Typed errors of every room. Each carries a reason and a remedy. The program maps them to exit statuses (0 fine, 1
// disagree, 2 unusable input, 3 undecided, 4 no usable device). Nothing in a library prints or exits.
#pragma once

#include <stdexcept>
#include <string>

namespace tandem {

// Base of the errors that Tandem itself raises; what() is one line for a person.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// Unusable input or arguments (exit status 2). Where it stems from a file, what() reads
// "FILE: JSON-POINTER: reason; mend", as made by `input_error`.
class InputError : public Error {
public:
    using Error::Error;
};

// A combination that a backend does not offer (exit status 2): says what and why.
class UnsupportedError : public Error {
public:
    using Error::Error;
};

// No Vulkan device that can be used (exit status 4): says which was refused for which missing feature.
class DeviceError : public Error {
public:
    using Error::Error;
};

// One line "file: pointer: reason; mend"; an empty pointer or mend is left out.
[[nodiscard]] InputError input_error(
    const std::string& file, const std::string& json_pointer, const std::string& reason, const std::string& mend);

}  // namespace tandem
