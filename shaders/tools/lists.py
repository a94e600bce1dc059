#!/usr/bin/env python3
"""Writes as GLSL what the host lists: effects and ids of specialisation constants.

usage: lists.py effects common/render/effects.def OUT.glsl
       lists.py constants vulkan/renderer/kernels/constant_ids.def OUT.glsl
"""

import re
import sys


def names_listed(macro, text):
    return re.findall(rf"^{macro}\((\w+)", text, re.MULTILINE)


def effects(text):
    for bit, name in enumerate(names_listed("EFFECT", text)):
        word = "effects_low" if bit < 32 else "effects_high"
        yield f"const bool has_{name} = ({word} & (1u << {bit % 32})) != 0u;\n"


def constants(text):
    for value, name in enumerate(names_listed("CONSTANT", text)):
        yield f"#define id_{name} {value}\n"


def main():
    kind, source, output = sys.argv[1:]
    with open(source, encoding="utf-8") as file:
        text = file.read()
    with open(output, "w", encoding="utf-8") as file:
        file.writelines({"effects": effects, "constants": constants}[kind](text))


main()
