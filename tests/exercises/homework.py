#!/usr/bin/python3
# Homework for the marker: right answers and wrong ones, for every exercise. Students read this repository, so it is kept
# packed (zlib, base 85), not as text.
#
# Usage: tests/exercises/homework.py unpack > homework.json; edit; tests/exercises/homework.py pack < homework.json
import base64
import itertools
import json
import pathlib
import random
import sys
import zlib

PACKED = pathlib.Path(__file__).with_name("homework.packed")
WIDTH = 120  # of the packed file's lines


def read():
    """{"exercises": {slug: {"prototype", "right": [body], "wrong": [[cause, body]], "held_out": [body]}}, "styles": …}.
    Bodies call N (normalise), S (root), D (dot product) and Q (quotient). A style says what each is made of."""
    return json.loads(zlib.decompress(base64.b85decode("".join(PACKED.read_text().split()))))


def source(homework, slug, body, style=(0, 0, 0, 0)):
    """What a student would hand in."""
    helpers = "".join(f"{signature} {{ return {forms[chosen]}; }}\n" for (signature, forms), chosen in zip(homework["styles"], style))
    return f"{helpers}{homework['exercises'][slug]['prototype']} {{\n    {body}\n}}\n"


def variants(homework, slug, bodies, count, seed=1):
    """So many different texts of these bodies, in the order of a generator with that seed."""
    styles = itertools.product(*(range(len(forms)) for _, forms in homework["styles"]))
    texts = {}  # a body without roots is the same in all styles of them
    for body, style in itertools.product(bodies, styles):
        used = tuple(chosen if f"{signature.split('(')[0].split()[-1]}(" in body else 0
                     for (signature, _), chosen in zip(homework["styles"], style))
        texts[body, used] = source(homework, slug, body, used)
    chosen = list(texts.values())
    random.Random(f"{seed} {slug}").shuffle(chosen)
    return chosen[:count]


def main():
    if sys.argv[1:] == ["unpack"]:
        print(json.dumps(read(), indent=1, ensure_ascii=False))
    elif sys.argv[1:] == ["pack"]:
        text = base64.b85encode(zlib.compress(json.dumps(json.load(sys.stdin), ensure_ascii=False).encode(), 9)).decode()
        PACKED.write_text("".join(text[i:i + WIDTH] + "\n" for i in range(0, len(text), WIDTH)))
    else:
        sys.exit("usage: homework.py unpack | pack")


if __name__ == "__main__":
    main()
