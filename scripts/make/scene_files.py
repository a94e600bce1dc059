"""What the other scripts in scripts/make share: scene files with a row a line, images and volumes as bytes, and value noise.

Only +, -, * and / and the C library's functions are used, not numpy's, so that every machine writes the same bytes.
"""
import json
import math
import pathlib
import random
import struct
import sys

SCENES = pathlib.Path(__file__).resolve().parent.parent.parent / "scenes"
ROWS = {"textures": dict, "media": dict, "materials": dict, "groups": dict, "lights": list, "entities": list}


def scene_text(scene):
    """JSON with a material, a light or an entity a line."""
    lines = []
    for key, value in scene.items():
        if ROWS.get(key) is dict:
            rows = [f"    {json.dumps(name)}: {json.dumps(item)}" for name, item in value.items()]
            lines.append(f'  "{key}": {{\n' + ",\n".join(rows) + "\n  }")
        elif ROWS.get(key) is list:
            lines.append(f'  "{key}": [\n' + ",\n".join("    " + json.dumps(item) for item in value) + "\n  ]")
        else:
            lines.append(f"  {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def pfm_bytes(rows):
    """Portable float map of rows of (r, g, b) from the top."""
    data = b"".join(struct.pack("<3f", *pixel) for row in reversed(rows) for pixel in row)
    return f"PF\n{len(rows[0])} {len(rows)}\n-1.0\n".encode() + data


def vol_bytes(cells, low, high, values):
    """Mitsuba's volume file, version 3: float32, one channel, x fastest."""
    return b"VOL\x03" + struct.pack("<5i6f", 1, *cells, 1, *low, *high) + struct.pack(f"<{len(values)}f", *values)


class ValueNoise:
    """Smooth noise in [0, 1] of three coordinates, repeated every 32 cells."""

    SIDE = 32

    def __init__(self, seed):
        draw = random.Random(seed)
        self.values = [draw.random() for _ in range(self.SIDE ** 3)]

    def at(self, x, y, z):
        i, j, k = math.floor(x), math.floor(y), math.floor(z)
        a, b, c = x - i, y - j, z - k
        a, b, c = a * a * (3 - 2 * a), b * b * (3 - 2 * b), c * c * (3 - 2 * c)
        i0, i1 = i % self.SIDE, (i + 1) % self.SIDE
        total = 0.0
        for n, weight in ((k, 1 - c), (k + 1, c)):
            for m, height in ((j, 1 - b), (j + 1, b)):
                row = (n % self.SIDE * self.SIDE + m % self.SIDE) * self.SIDE
                total += weight * height * ((1 - a) * self.values[row + i0] + a * self.values[row + i1])
        return total

    def octaves(self, x, y, z, count):
        """The sum of `count` octaves, each of half the size and weight, in [0, 1]."""
        total, weight = 0.0, 0.5
        for _ in range(count):
            total += weight * self.at(x, y, z)
            x, y, z, weight = 2 * x + 5.3, 2 * y + 1.7, 2 * z + 9.1, weight / 2
        return total / (1 - 2 * weight)


def mix(a, b, t):
    return tuple(p + (q - p) * t for p, q in zip(a, b))


def step(low, high, x):
    """Rises smoothly from 0 at `low` to 1 at `high`."""
    t = min(1.0, max(0.0, (x - low) / (high - low)))
    return t * t * (3 - 2 * t)


def write(content, default):
    """To the file that the command line names, or standard output (-), or `default` under scenes/; --help prints what the script is."""
    if sys.argv[1:] in (["-h"], ["--help"]):
        print(sys.modules["__main__"].__doc__.strip())
        return
    target = sys.argv[1] if len(sys.argv) > 1 else str(SCENES / default)
    data = content if isinstance(content, bytes) else content.encode()
    if target == "-":
        sys.stdout.buffer.write(data)
    else:
        pathlib.Path(target).write_bytes(data)
        print(f"written: {target}")
