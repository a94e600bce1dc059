# The adapters of renderers that Debian does not have. With a name, `test_adapters.py pbrt`: that program's verdict; status 77
# where it is not installed. Without: what they do around the program, with stand-ins.
import copy
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

from program import SCENES, SPHERE, TANDEM, ProgramTest, tandem

ADAPTERS = pathlib.Path(__file__).resolve().parents[2] / "scripts/adapters"
LAMP = SCENES / "closed-forms/polygon-light.json"
PROGRAMS = {"pbrt": "{out:pfm}", "mitsuba": "{out}", "tungsten": "{out:pfm}"}

# Renders pbrt's file by importing it: a second meaning of the text is not at stake, the way of a request is.
PBRT = """#!/bin/sh
while [ $# -gt 1 ]; do
    case $1 in --spp) spp=$2; shift;; --seed) seed=$2; shift;; --nthreads) shift;; --outfile) out=$2; shift;; esac
    shift
done
"$TANDEM" import "$1" -o "$1.json" > /dev/null && exec "$TANDEM" render "$1.json" --backend cpu --samples $spp --seed $seed -o "$out"
"""


def candidate(name, scene="{scene}"):
    return f"exec:{sys.executable} {ADAPTERS}/{name}.py {scene} {{width}} {{height}} {{samples}} {{seed}} {{bounces}} {{threads}} {PROGRAMS[name]}"


def options_of(name):
    return ["--negative-colours"] if name == "pbrt" else []


def there(name):
    return os.environ.get(name.upper()) or shutil.which(name)


def environment(**more):
    """Without the programs of this machine."""
    folders = [folder for folder in os.environ["PATH"].split(":") if not any(os.path.exists(f"{folder}/{name}") for name in PROGRAMS)]
    kept = {key: value for key, value in os.environ.items() if key not in ("PBRT", "MITSUBA", "TUNGSTEN")}
    return kept | {"PATH": ":".join(folders), "TANDEM": os.path.abspath(TANDEM)} | more


class StandInTest(ProgramTest):
    def program(self, name, text):
        path = self.folder / name
        path.write_text(text)
        path.chmod(0o755)
        return str(path)

    def verify(self, name, scene, **more):
        return tandem("verify", scene, "--reference", "cpu", "--size", "16", "--time", "20", "--margin", "5%", "--oracle", "none", "--candidate",
                      candidate(name), env=environment(**more))

    def test_a_request_reaches_the_program_and_its_image_comes_back(self):
        result = self.verify("pbrt", self.scene, PBRT=self.program("pbrt", PBRT))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("pbrt.py agree within", result.stdout)

    def test_a_program_that_is_not_there_is_said(self):
        for name in PROGRAMS:
            with self.subTest(name=name):
                result = self.verify(name, self.scene)
                self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
                self.assertIn(f"there is no {name}: put {name} on PATH, or name the program in ${name.upper()}", result.stdout)

    def test_what_the_export_refuses_is_said(self):
        result = self.verify("pbrt", SCENES / "whitted.json", PBRT=self.program("pbrt", PBRT))
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("it follows whole paths", result.stdout)

    def test_the_last_words_of_a_program_are_told(self):
        for name, status in (("mitsuba", 1), ("tungsten", 0)):  # Tungsten ends with 0 after some errors
            with self.subTest(name=name):
                program = self.program(name, f"#!/bin/sh\necho the flux is low >&2\nexit {status}\n")
                result = self.verify(name, SCENES / "cornell-classic.json", **{name.upper(): program})
                self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
                self.assertIn("the flux is low", result.stdout)

    def test_pbrt_has_one_thread_where_its_camera_stands_in_a_medium(self):
        program = self.program("pbrt", f"#!/bin/sh\necho \"$@\" >> {self.folder}/seen\nexit 1\n")
        for scene in ("fog", "cornell-classic"):
            subprocess.run([sys.executable, ADAPTERS / "pbrt.py", SCENES / f"{scene}.json", "8", "8", "4", "1", "3", "7", self.folder / "a.pfm"],
                           env=environment(PBRT=program), capture_output=True)
        words = (self.folder / "seen").read_text().split()
        self.assertEqual([words[i + 1] for i, word in enumerate(words) if word == "--nthreads"], ["1", "7"])

    def test_mitsuba_gets_seeds_far_apart(self):
        program = self.program("mitsuba", f"#!/bin/sh\necho \"$@\" >> {self.folder}/seen\nexit 1\n")
        for seed in (1, 2):
            subprocess.run([sys.executable, ADAPTERS / "mitsuba.py", self.scene, "8", "8", "4", str(seed), "3", "1", self.folder / "a.exr"],
                           env=environment(MITSUBA=program), capture_output=True)
        seeds = [int(word.removeprefix("seed=")) for word in (self.folder / "seen").read_text().split() if word.startswith("seed=")]
        self.assertEqual(len(seeds), 2)
        self.assertGreater(abs(seeds[0] - seeds[1]), 2**24)

    def test_tungsten_refuses_what_it_would_light_itself(self):
        dark = {key: value for key, value in SPHERE.items() if key != "background"}
        result = self.verify("tungsten", self.write(dark, "dark.json"), TUNGSTEN=self.program("tungsten", "#!/bin/sh\n"))
        self.assertIn("tungsten.py refuses a scene without lights", result.stdout)


class VerdictTest(ProgramTest):
    name = None

    def setUp(self):
        super().setUp()
        self.lamp = json.loads(LAMP.read_text())
        del self.lamp["expect"]
        for material in self.lamp["materials"].values():  # pbrt renders spectra: its products of colours are others
            material |= {key: [sum(material[key]) / 3] * 3 for key in ("colour", "radiance") if key in material}

    def verify(self, scene):
        return tandem("verify", self.write(self.lamp, "lamp.json"), "--reference", "cpu", "--size", "16", "--time", "60", "--margin", "5%", *options_of(self.name),
                      "--candidate", candidate(self.name, scene))

    def test_it_agrees_on_a_lamp(self):
        result = self.verify("{scene}")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_a_lamp_that_is_20_percent_brighter_is_seen(self):
        scene = copy.deepcopy(self.lamp)
        lamps = [material for material in scene["materials"].values() if "radiance" in material]
        self.assertTrue(lamps)
        for lamp in lamps:
            lamp["radiance"] = [1.2 * value for value in lamp["radiance"]]
        result = self.verify(self.write(scene, "brighter.json"))
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("a constant exposure factor of 1.", result.stdout)


if __name__ == "__main__":
    if len(sys.argv) > 1 and sys.argv[1] in PROGRAMS:
        VerdictTest.name = sys.argv.pop(1)
        if not there(VerdictTest.name):
            print(f"skipped: there is no {VerdictTest.name}")
            sys.exit(77)
        unittest.main(argv=[sys.argv[0], "VerdictTest"])
    unittest.main(argv=[sys.argv[0], "StandInTest"])
