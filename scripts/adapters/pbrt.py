#!/usr/bin/python3
"""pbrt, version 4, for `tandem verify`: renders what `tandem export --to pbrt` writes.

    tandem verify scenes/cornell-classic.json --size 64 --negative-colours --candidate \\
      'exec:scripts/adapters/pbrt.py {scene} {width} {height} {samples} {seed} {bounces} {threads} {out:pfm}'

$PBRT is the program; without it, pbrt on PATH. $TANDEM is tandem. Debian has no pbrt: build it from its sources.
pbrt renders spectra: the noise of a pixel may leave the gamut, so its colours may be negative.
Scenes whose camera stands in a medium are rendered in one thread: pbrt's threads race for its media, and it crashes.
Tried with pbrt-v4: tests/records/renderers/RENDERERS.md. scenes/format/EXPORT.md says what pbrt means otherwise than Tandem.
"""
from exported import adapter, run


def image_of(pbrt, scene, image, arguments):
    # The job that makes the camera asks GetMedium for its medium, which erases from the map that CreateMedia walks through.
    camera_in_medium = "\nMediumInterface" in scene.read_text().split("\nCamera", 1)[0]
    threads = 1 if camera_in_medium else arguments.threads
    return run([pbrt, "--quiet", "--spp", arguments.samples, "--seed", arguments.seed, "--nthreads", threads,
                "--outfile", image, scene])


adapter(__doc__, "PBRT", "pbrt", "pbrt", image_of)
