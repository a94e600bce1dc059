#!/usr/bin/python3
"""pbrt, version 4, for `tandem verify`: renders what `tandem export --to pbrt` writes.

    tandem verify scenes/cornell-classic.json --size 64 --candidate \\
      'exec:scripts/adapters/pbrt.py {scene} {width} {height} {samples} {seed} {bounces} {threads} {out:pfm}'

$PBRT is the program; without it, pbrt on PATH. $TANDEM is tandem. Debian has no pbrt: build it from its sources.
Tried with a stand-in alone, never yet with pbrt.
scenes/format/EXPORT.md says what pbrt means otherwise than Tandem.
"""
from exported import adapter, run


def image_of(pbrt, scene, image, arguments):
    return run([pbrt, "--quiet", "--spp", arguments.samples, "--seed", arguments.seed, "--nthreads", arguments.threads,
                "--outfile", image, scene])


adapter(__doc__, "PBRT", "pbrt", "pbrt", image_of)
