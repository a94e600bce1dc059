// What is refused, and in which words.
#pragma once

#include <concepts>
#include <string>

#include "common/error.h"

namespace tandem {

// What the error says that `call` throws; empty: none.
template <class Refused = InputError, std::invocable Call>
std::string refusal(const Call& call) {
    try {
        call();
    } catch (const Refused& error) {
        return error.what();
    }
    return {};
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace tandem
