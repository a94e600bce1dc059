#!/usr/bin/env python3
"""Leaves a SPIR-V module's floating-point arithmetic no choice: the same bits whatever surrounds an operation.

Specialised and general kernels are to give the same bits, and a compiler decides by its surroundings how it rounds what the
language leaves open. Two things are open. It may contract a * b + c into one rounding: forbidden
here for every operation, as if all of the GLSL were `precise`. And it may expand a compound operation (dot, a product
of matrices, normalize, length, cross, mix) as it likes, which that decoration does not prevent. NVIDIA's 580 on an H200
contracts within OpDot or not from case to case. So 12 of 23 shipped scenes had different bits. Here they are written
out, sums of products by fused multiply-adds; since then all scenes agree there.

usage: exact_arithmetic.py MODULE.spv
"""

import struct
import sys

HEADER_WORDS = 5
EXT_INST_IMPORT, EXT_INST, TYPE_FLOAT, TYPE_VECTOR, TYPE_MATRIX = 11, 12, 22, 23, 24
DECORATE, MEMBER_DECORATE, COMPOSITE_CONSTRUCT, COMPOSITE_EXTRACT = 71, 72, 80, 81
F_NEGATE, F_SUB, F_MUL, F_DIV, VECTOR_TIMES_SCALAR = 127, 131, 133, 136, 142
VECTOR_TIMES_MATRIX, MATRIX_TIMES_VECTOR, DOT = 144, 145, 148
NO_CONTRACTION = 42
# OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, OpFRem, OpFMod, products of vectors, scalars and matrices
ARITHMETIC = {127, 129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148}
# Instructions of GLSL.std.450: those below, and those that round once, not at all, or to the device's own accuracy.
SQRT, INVERSE_SQRT, F_MIX, FMA, PACK_HALF, PACK_DOUBLE, UNPACK_HALF = 31, 32, 46, 50, 58, 59, 62
LENGTH, CROSS, NORMALIZE = 66, 68, 69
LIBRARY = set(range(13, 31))  # sin to log2: in planted bugs alone, as a test makes sure
SIMPLE = LIBRARY | {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, SQRT, INVERSE_SQRT, 37, 38, 39, 40, 41, 42, 43, 44, 45, FMA, 53, PACK_HALF, PACK_DOUBLE, UNPACK_HALF, 73, 74, 75, 79, 80, 81}


def instructions(words):
    at = HEADER_WORDS
    while at < len(words):
        count, opcode = words[at] >> 16, words[at] & 0xFFFF
        yield opcode, words[at : at + count]
        at += count


class Expansion:
    """Takes instructions one by one; `code` is what they become."""

    def __init__(self, bound):
        self.bound, self.code = bound, []
        self.vectors, self.matrices, self.type_of = {}, {}, {}  # type: (its part's type, count); value: type
        self.glsl = None
        self.scalars = set()  # types: float, and double where there is one
        self.doubles = set()  # double and its vectors

    def new_id(self):
        self.bound += 1
        return self.bound - 1

    def emit(self, opcode, result_type, *operands, result=None):
        result = result or self.new_id()
        self.type_of[result] = result_type
        self.code.append([(3 + len(operands)) << 16 | opcode, result_type, result, *operands])
        return result

    def scalar(self, opcode, *operands, result=None):
        """An instruction whose result has the operands' type."""
        return self.emit(opcode, self.type_of[operands[0]], *operands, result=result)

    def function(self, number, *operands, result=None):
        return self.emit(EXT_INST, self.type_of[operands[0]], self.glsl, number, *operands, result=result)

    def parts(self, value):
        part_type, count = (self.vectors | self.matrices)[self.type_of[value]]
        return [self.emit(COMPOSITE_EXTRACT, part_type, value, i) for i in range(count)]

    def each(self, result, make, *values):
        """make(scalars) for each component of the vectors, or once for scalars."""
        if self.type_of[values[0]] in self.scalars:
            return make(*values, result=result)
        parts = [make(*scalars) for scalars in zip(*map(self.parts, values))]
        return self.emit(COMPOSITE_CONSTRUCT, self.type_of[values[0]], *parts, result=result)

    def sum_of_products(self, a, b, result=None):
        total = self.scalar(F_MUL, a[-1], b[-1])
        for i in reversed(range(len(a) - 1)):
            total = self.function(FMA, a[i], b[i], total, result=result if i == 0 else None)
        return total

    def square_length(self, v):
        parts = self.parts(v)
        return self.sum_of_products(parts, parts)

    def cross(self, a, b, result_type, result):
        a, b = self.parts(a), self.parts(b)
        parts = [self.scalar(F_SUB, self.scalar(F_MUL, a[i], b[j]), self.scalar(F_MUL, a[j], b[i]))
                 for i, j in ((1, 2), (2, 0), (0, 1))]
        self.emit(COMPOSITE_CONSTRUCT, result_type, *parts, result=result)

    def mix(self, x, y, share, result=None):
        left = self.function(FMA, self.scalar(F_NEGATE, share), x, x)
        return self.function(FMA, share, y, left, result=result)

    def normalize(self, v, result_type, result):
        if result_type not in self.doubles:
            factor = self.function(INVERSE_SQRT, self.square_length(v))
            self.emit(VECTOR_TIMES_SCALAR, result_type, v, factor, result=result)
            return
        # For inverse roots in double Vulkan asks no more than for those in float.
        length = self.function(SQRT, self.square_length(v))
        self.emit(COMPOSITE_CONSTRUCT, result_type, *[self.scalar(F_DIV, part, length) for part in self.parts(v)],
                  result=result)

    def is_real(self, result_type):
        return result_type in self.scalars or self.vectors.get(result_type, [None])[0] in self.scalars

    def expand(self, opcode, instruction):
        """Whether the instruction has become others."""
        result_type, result, operands = instruction[1], instruction[2], instruction[3:]
        if opcode == DOT:
            self.sum_of_products(*map(self.parts, operands), result=result)
        elif opcode == MATRIX_TIMES_VECTOR:
            rows = zip(*map(self.parts, self.parts(operands[0])))
            v = self.parts(operands[1])
            self.emit(COMPOSITE_CONSTRUCT, result_type, *[self.sum_of_products(row, v) for row in rows], result=result)
        elif opcode == VECTOR_TIMES_MATRIX:
            v, columns = self.parts(operands[0]), map(self.parts, self.parts(operands[1]))
            sums = [self.sum_of_products(v, column) for column in columns]
            self.emit(COMPOSITE_CONSTRUCT, result_type, *sums, result=result)
        elif opcode == EXT_INST and operands[0] == self.glsl:
            number, operands = operands[1], operands[2:]
            if number == NORMALIZE:
                self.normalize(*operands, result_type, result)
            elif number == LENGTH and self.type_of[operands[0]] in self.vectors:
                self.function(SQRT, self.square_length(operands[0]), result=result)
            elif number == CROSS:
                self.cross(*operands, result_type, result)
            elif number == F_MIX:
                self.each(result, self.mix, *operands)
            elif number in SIMPLE:
                return False
            else:
                sys.exit(f"exact_arithmetic.py: instruction {number} of GLSL.std.450 is not known; write it out")
        else:
            return False
        return True

    def take(self, opcode, instruction):
        if opcode == EXT_INST_IMPORT:
            self.glsl = instruction[1]
        elif opcode == TYPE_FLOAT:
            self.scalars.add(instruction[1])
            if instruction[2] == 64:
                self.doubles.add(instruction[1])
        elif opcode in (TYPE_VECTOR, TYPE_MATRIX):
            (self.vectors if opcode == TYPE_VECTOR else self.matrices)[instruction[1]] = instruction[2:]
            if instruction[2] in self.doubles:
                self.doubles.add(instruction[1])
        if len(instruction) > 2 and (instruction[1] in self.scalars or instruction[1] in self.vectors or instruction[1] in self.matrices):
            self.type_of[instruction[2]] = instruction[1]
        compound = opcode in (DOT, MATRIX_TIMES_VECTOR, VECTOR_TIMES_MATRIX, EXT_INST) and self.is_real(instruction[1])
        if not (compound and self.expand(opcode, instruction)):
            self.code.append(instruction)


def main():
    with open(sys.argv[1], "rb") as file:
        data = file.read()
    words = list(struct.unpack(f"<{len(data) // 4}I", data))
    expansion = Expansion(bound=words[3])
    for opcode, instruction in instructions(words):
        expansion.take(opcode, instruction)
    words[3] = expansion.bound
    arithmetic = [i[2] for i in expansion.code if i[0] & 0xFFFF in ARITHMETIC]
    results = set(arithmetic)
    is_ours = lambda i: i[0] & 0xFFFF == DECORATE and i[2] == NO_CONTRACTION
    code = [i for i in expansion.code if not is_ours(i)]
    places = [at for at, i in enumerate(code) if i[0] & 0xFFFF in (DECORATE, MEMBER_DECORATE)]
    if results and not places:
        sys.exit(f"exact_arithmetic.py: {sys.argv[1]} has no decorations to stand beside")
    end = places[-1] + 1 if places else 0
    code[end:end] = [[3 << 16 | DECORATE, result, NO_CONTRACTION] for result in sorted(results)]
    flat = words[:HEADER_WORDS] + [word for instruction in code for word in instruction]
    with open(sys.argv[1], "wb") as file:
        file.write(struct.pack(f"<{len(flat)}I", *flat))


main()
