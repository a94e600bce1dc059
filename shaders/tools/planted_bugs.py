#!/usr/bin/env python3
"""Writes the values of tandem::PlantedBug as GLSL constants (shaders/kernels/planted.glsl).

usage: planted_bugs.py common/render/planted_bugs.h OUT.glsl
"""

import re
import sys


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        body = re.search(r"enum class PlantedBug[^{]*\{(.*?)\};", file.read(), re.DOTALL).group(1)
    names = [name for name in re.findall(r"^\s*(\w+)", body, re.MULTILINE) if name != "count"]
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.writelines(f"const uint bug_{name} = {value};\n" for value, name in enumerate(names))


main()
