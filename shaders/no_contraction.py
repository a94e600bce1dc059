#!/usr/bin/env python3
"""Decorates every floating-point operation of a SPIR-V module NoContraction, as if all of the GLSL were `precise`.

A compiler that may contract a * b + c into one rounding decides so by what surrounds it, hence differently in specialised
and in general kernels, which are to give the same bits (DESIGN.md section 7). Lavapipe gives
them. NVIDIA's 580 on an H200 does in eight of 18 shipped scenes and in the others parts the two by last bits of a few
values, ten times as many without this; why is not known yet. It is not normalize, length or products of matrices, and not
divisions and roots: with each followed by a correction by fma (q + fma(-b, q, a) / b) the megakernel's images differ in
95 % as many values (2 to 11 % fewer in eight scenes, 2 % more in one), for 16 % of the time on the thesis's scene. The
price of this is 0 to 4 % of the time.

usage: no_contraction.py MODULE.spv
"""

import struct
import sys

HEADER_WORDS = 5
DECORATE, MEMBER_DECORATE = 71, 72
NO_CONTRACTION = 42
# OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, OpFRem, OpFMod, products of vectors, scalars and matrices, OpDot
ARITHMETIC = {127, 129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148}


def instructions(words):
    at = HEADER_WORDS
    while at < len(words):
        count, opcode = words[at] >> 16, words[at] & 0xFFFF
        yield at, opcode, words[at : at + count]
        at += count


def main():
    with open(sys.argv[1], "rb") as file:
        data = file.read()
    words = list(struct.unpack(f"<{len(data) // 4}I", data))
    decorated, arithmetic, end = set(), [], 0
    for at, opcode, instruction in instructions(words):
        if opcode in (DECORATE, MEMBER_DECORATE):
            end = at + len(instruction)
            if opcode == DECORATE and instruction[2] == NO_CONTRACTION:
                decorated.add(instruction[1])
        elif opcode in ARITHMETIC:
            arithmetic.append(instruction[2])
    added = [word for result in arithmetic if result not in decorated
             for word in (3 << 16 | DECORATE, result, NO_CONTRACTION)]
    if added and end == 0:
        sys.exit(f"no_contraction.py: {sys.argv[1]} has no decorations to stand beside")
    with open(sys.argv[1], "wb") as file:
        file.write(struct.pack(f"<{len(words) + len(added)}I", *words[:end], *added, *words[end:]))


main()
