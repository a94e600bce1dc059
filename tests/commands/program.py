# What the tests of the program share: how it is run, a scene, a folder for each test, and what a refusal looks like.
# Run with TANDEM = the program, SCENES = the folder of the shipped scenes.
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import threading
import time
import unittest

TANDEM = os.environ["TANDEM"]
SCENES = pathlib.Path(os.environ["SCENES"])
THOROUGH = "TANDEM_THOROUGH" in os.environ  # a long run, as tests/thorough.h says
if not THOROUGH:
    # lavapipe computes on one thread: on images of a few pixels its threads wait for each other longer than they compute.
    os.environ.setdefault("LP_NUM_THREADS", "0")

SPHERE = {
    "film": {"width": 16, "height": 16},
    "camera": {"position": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "vertical_field_degrees": 40},
    "background": [0.5, 0.5, 0.5],
    "materials": {"grey": {"kind": "diffuse", "colour": [0.5, 0.5, 0.5]}},
    "entities": [{"name": "ball", "material": "grey",
                  "primitives": [{"sphere": {"centre": [0, 0, 0], "radius": 1}}]}],
}


def as_argument(word):
    return word if isinstance(word, (bytes, str, os.PathLike)) else str(word)


def tandem(*arguments, **options):
    return subprocess.run([TANDEM, *map(os.fsencode, map(as_argument, arguments))], capture_output=True, text=True, timeout=120, **options)


def in_time(*arguments, **options):
    """The same, once more where its --time was too short: the machine may have been away meanwhile."""
    result = tandem(*arguments, **options)
    return tandem(*arguments, **options) if result.returncode == 3 and "are too short" in result.stderr else result


class Stopwatch:
    """Seconds that the machine was there: what looks every 20 ms counts a look's 0.1 s at most, so that a pause of the machine is none."""
    def __enter__(self):
        self.seconds, self._end = 0.0, threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()
        return self

    def _look(self):
        last = time.monotonic()
        while not self._end.wait(0.02):
            now = time.monotonic()
            self.seconds += min(0.1, now - last)
            last = now

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()


def until(condition, what, seconds=60):
    """Looks until it holds; a pause of the machine counts for one look."""
    for _ in range(50 * seconds):
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError(f"waited for {seconds} s: {what}")


def processor_seconds(process):
    """Of a child that has not been waited for."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def at_work(process, seconds=1.0):
    """Waits until it has had the processor for so long, or has begun and then waits for something, so that it had none in
    fifty looks. It then heeds signals, however busy the machine is."""
    seen = []

    def works_or_waits():
        seen.append(processor_seconds(process))
        return seen[-1] >= seconds or seen[-1] > 0.0 and seen[-51:-50] == seen[-1:]

    until(lambda: process.poll() is not None or works_or_waits(), "the program is at work")


class ProgramTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.scene = self.write(SPHERE)

    def write(self, scene, name="scene.json"):
        path = self.folder / name
        path.write_text(scene if isinstance(scene, str) else json.dumps(scene))
        return path

    def changed(self, pointer, value):
        """The sphere scene with the value at a JSON pointer replaced."""
        scene = json.loads(json.dumps(SPHERE))
        *parents, last = pointer.strip("/").split("/")
        place = scene
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place[key]
        place[last] = value
        return self.write(scene, "changed.json")

    def closed_box(self):
        """A room that no path gets out of, and that nothing is absorbed in."""
        return self.write({
            "camera": {"position": [0.1, 0.2, 0.3], "target": [1, 0.4, -0.3], "vertical_field_degrees": 70},
            "materials": {"white": {"kind": "diffuse", "colour": [1, 1, 1]}, "lamp": {"kind": "emissive", "radiance": [1, 1, 1]}},
            "entities": [{"material": "white", "primitives": [{"cuboid": {"minimum": [-1, -1, -1], "maximum": [1, 1, 1]}}]},
                         {"material": "lamp", "primitives": [{"sphere": {"centre": [0.5, 0.5, 0.5], "radius": 0.001}}]}]},
            "box.json")

    def refused(self, result, *mentions, status=2):
        self.assertEqual(result.returncode, status, result.stderr)
        lines = result.stderr.strip().splitlines()
        self.assertEqual(len(lines), 1, result.stderr)
        for mention in mentions:
            self.assertIn(mention, lines[0])

    def left_behind(self):
        return sorted(p.name for p in self.folder.iterdir() if p.suffix != ".json" or p.name == "out.json")
