#!/usr/bin/env python3
"""Writes SPIR-V modules into a C++ file that defines tandem::shader_code (vulkan/framework/shader_library.h), or into a
header of arrays NAME_words.

usage: embed_spirv.py OUT.cpp PLANTED_BUGS(0|1) STAGE=FILE.spv...
       embed_spirv.py OUT.cpp variants STAGE:VARIANT=FILE.spv...
       embed_spirv.py OUT.h header NAME=FILE.spv...
"""

import struct
import sys


def words_of(name, path):
    with open(path, "rb") as file:
        data = file.read()
    words = struct.unpack(f"<{len(data) // 4}I", data)
    lines = [f"constexpr std::uint32_t {name}_words[] = {{"]
    lines += ["    " + ", ".join(f"{word:#x}" for word in words[i : i + 12]) + "," for i in range(0, len(words), 12)]
    return lines + ["};"]


def main():
    out, planted_bugs, modules = sys.argv[1], sys.argv[2], [argument.split("=", 1) for argument in sys.argv[3:]]
    if planted_bugs == "header":
        lines = ["#pragma once", "", "#include <cstdint>", "", "namespace tandem {", ""]
        for name, path in modules:
            lines += words_of(name, path)
        with open(out, "w", encoding="utf-8") as file:
            file.write("\n".join([*lines, "", "}  // namespace tandem", ""]))
        return
    lines = ['#include "vulkan/framework/shader_library.h"', "", "namespace tandem {", "", "namespace {", ""]
    for name, path in modules:
        lines += words_of(name.replace(":", "_"), path)
    lines += ["", "}  // namespace", ""]
    if planted_bugs == "variants":
        lines += ["std::span<const std::uint32_t> shader_variant([[maybe_unused]] Stage stage,",
                  "    [[maybe_unused]] ShaderVariant variant) {"]
        for name, _ in modules:
            stage, variant = name.split(":")
            lines.append(f"    if (stage == Stage::{stage} && variant == ShaderVariant::{variant}) "
                         f"return {stage}_{variant}_words;")
        lines += ["    return {};", "}", ""]
    else:
        lines += ["std::span<const std::uint32_t> shader_code(Stage stage) {", "    switch (stage) {"]
        lines += [f"        case Stage::{name}: return {name}_words;" for name, _ in modules]
        lines += ["    }", "    return {};", "}", ""]
        lines += [f"bool shaders_hold_planted_bugs() {{ return {'true' if planted_bugs == '1' else 'false'}; }}", ""]
    lines += ["}  // namespace tandem", ""]
    with open(out, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


main()
