#!/usr/bin/env python3
"""Turns the block and struct layouts that `spirv-cross --reflect` reads out of SPIR-V into static_asserts. They are on
the structs of the same names in vulkan/renderer/scene/gpu_layout.h. So host and device cannot drift apart unnoticed.

usage: check_layouts.py OUT.h REFLECTION.json...
"""

import json
import sys

SHARED = {"PrimitiveSource", "EntityTransform", "Placed", "Triangle", "Convex", "BvhNode", "Material", "Texture", "Medium", "Light",
          "Environment", "SceneHeader", "Camera", "Settings", "DoubleEntityTransform", "DoubleTriangle", "DoubleConvex",
          "DoubleMedium", "DoubleLight", "DoubleCamera", "DoubleMaterial", "DoubleTexture", "DoubleSceneHeader"}


def collect(reflection, asserts):
    """Adds {struct: {member: offset}} and {struct: stride} of the shared structs that have explicit offsets."""
    for struct in reflection.get("types", {}).values():
        if struct["name"] in SHARED and all("offset" in member for member in struct["members"]):
            asserts.setdefault(struct["name"], {})
            for member in struct["members"]:
                asserts[struct["name"]][member["name"]] = member["offset"]
        for member in struct["members"]:
            element = reflection["types"].get(member["type"])
            if element is not None and element["name"] in SHARED and "array_stride" in member:
                asserts.setdefault(element["name"], {})["sizeof"] = member["array_stride"]


def main():
    asserts = {}
    for path in sys.argv[2:]:
        with open(path, encoding="utf-8") as file:
            collect(json.load(file), asserts)
    missing = SHARED - {name for name, members in asserts.items() if set(members) - {"sizeof"}}
    if missing:
        sys.exit(f"check_layouts.py: no layout found in the SPIR-V for {', '.join(sorted(missing))}")
    lines = ["#pragma once", "#include <cstddef>", '#include "vulkan/renderer/scene/gpu_layout.h"', "namespace tandem::gpu {"]
    for name, members in sorted(asserts.items()):
        for member, offset in members.items():
            what = f"sizeof({name})" if member == "sizeof" else f"offsetof({name}, {member})"
            lines.append(f'static_assert({what} == {offset}, "host and device layouts differ");')
    lines += ["}  // namespace tandem::gpu", ""]
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


main()
