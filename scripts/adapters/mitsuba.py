#!/usr/bin/python3
"""Mitsuba 3 for `tandem verify`: renders what `tandem export --to mitsuba` writes.

    tandem verify scenes/cornell-classic.json --size 64 --candidate \\
      'exec:scripts/adapters/mitsuba.py {scene} {width} {height} {samples} {seed} {bounces} {threads} {out}'

$MITSUBA is the program; without it, mitsuba on PATH. $MITSUBA_VARIANT is one of RGB, else scalar_rgb. $TANDEM is tandem.
Debian has no Mitsuba: build it from its sources. Never yet tried with Mitsuba. scenes/format/EXPORT.md says what Mitsuba means otherwise than Tandem.
"""
import os

from exported import adapter, run


def image_of(mitsuba, scene, image, arguments):
    # Mitsuba adds the seed to the numbers of pixels: seeds that follow each other would share their random numbers.
    seed = arguments.seed * 0x9E3779B1 % 2**32
    return run([mitsuba, "-m", os.environ.get("MITSUBA_VARIANT", "scalar_rgb"), "-t", arguments.threads,
                "-D", f"samples={arguments.samples}", "-D", f"seed={seed}", "-o", image, scene])


adapter(__doc__, "MITSUBA", "mitsuba", "mitsuba", image_of)
