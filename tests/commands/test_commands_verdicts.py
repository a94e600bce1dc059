# What `tandem verify`, `compare` and `judges` say of images, in text, JSON and JUnit.
# Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import os
import random
import re
import signal
import struct
import subprocess
import unittest
import zlib
from xml.etree import ElementTree

from program import SCENES, TANDEM, ProgramTest, Stopwatch, at_work, tandem


class Verdicts(ProgramTest):
    def test_judges_of_one_seed_are_refused_before_they_speak(self):
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for image, samples in zip(images, (4, 8)):
            self.assertEqual(tandem("render", self.scene, "-o", image, "--samples", samples).returncode, 0)
        result = tandem("judges", *images)
        self.refused(result, "was made with seed")
        self.assertEqual(result.stdout, "")

    def test_interrupted_verify_is_undecided_and_says_so_in_its_json(self):
        figures = self.folder / "out.json"
        with subprocess.Popen([TANDEM, "verify", SCENES / "cornell-classic.json", self.scene, "--margin", "1e-9", "--json",
                               figures], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            at_work(running, 3.0)
            running.send_signal(signal.SIGINT)
            _, errors = running.communicate(timeout=100)
            self.assertEqual(running.returncode, 3, errors)
        report = json.loads(figures.read_text())
        self.assertEqual(report["verdict"], "undecided")
        self.assertEqual(len(report["scenes"]), 1)

    def test_a_scene_that_fails_leaves_the_verdicts_of_the_others(self):
        figures = self.folder / "out.json"
        result = tandem("verify", SCENES / "cornell-classic.json", SCENES / "fog.json", "--reference", "cpu", "--candidate", "cpu",
                        "--integrator", "bidirectional", "--size", "8", "--time", "2", "--json", figures)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("medium-absorption", result.stderr)
        report = json.loads(figures.read_text())
        self.assertEqual((len(report["scenes"]), report["not_run"], report["verdict"]), (1, ["fog"], "undecided"))

    def test_what_compare_calls_negligible_is_an_option(self):
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for seed, image in enumerate(images):
            tandem("render", self.scene, "-o", image, "--seed", seed)
        figures = self.folder / "out.json"
        tandem("compare", *images, "--negligible", "0.01%", "--tile-negligible", "0.002", "--json", figures)
        criteria = json.loads(figures.read_text())["scenes"][0]["criteria"]
        self.assertAlmostEqual(criteria["negligible_image_relative"], 1e-4)
        self.assertAlmostEqual(criteria["negligible_tile_relative"], 2e-3)
        self.refused(tandem("compare", *images, "--negligible", "-1"), "--negligible")

    def test_verify_agrees_with_the_promised_json(self):
        figures = self.folder / "out.json"
        result = tandem("verify", self.scene, "--json", figures, "--time", 60)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        report = json.loads(figures.read_text())
        self.assertEqual(report["verdict"], "agree")
        self.assertEqual(set(report["device"]), {"name", "driver", "api"})
        for key in ["scene", "verdict", "relative_difference", "relative_difference_low", "relative_difference_high",
                    "margin_relative", "worst_tile_relative", "samples_reference", "samples_candidate",
                    "seconds_reference", "seconds_candidate", "minimum_detectable_relative"]:
            self.assertIn(key, report["scenes"][0])

    def test_a_total_time_is_kept_and_what_is_undecided_has_a_forecast(self):
        figures, report = self.folder / "out.json", self.folder / "out.xml"
        noisy = ["verify", SCENES / "cornell-classic.json", self.scene, "--size", "16", "--margin", "1e-6", "--json", figures,
                 "--junit", report]
        with Stopwatch() as watch:
            result = tandem(*noisy, "--total-time", "12s")
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertLess(watch.seconds, 1.1 * 12 + 3.0)  # what comes before: devices, scenes, self-tests
        scenes = json.loads(figures.read_text())["scenes"]
        self.assertEqual(len(scenes), 2)
        # On a machine under load a scene may have had no look, and no forecast then.
        told = [scene["forecast_seconds"] for scene in scenes if scene["looks"]]
        self.assertTrue(told, result.stdout)
        for forecast in told:
            self.assertGreater(forecast, 12)
        needs = r"they need about .* more: --total-time \d+min" if len(told) == 2 else "some need a time that cannot be forecast"
        self.assertRegex(result.stdout, "of 2 scenes are undecided after .*; " + needs)
        self.assertIn("(margin 0.00010 %)", result.stdout)
        self.refused(tandem(*noisy, "--total-time", "8 parsec"), "write 600, 90s, 10min or 2h")
        self.refused(tandem(*noisy, "--total-time", "8s", "--convergence"), "--convergence")

    def test_each_scene_is_looked_at_under_the_validation_layer_where_there_is_one(self):
        figures = self.folder / "out.json"
        short = ["verify", self.scene, "--oracle", "none", "--json", figures]
        result = tandem(*short, "--time", "20")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("Validation layer: 1 scene without a message", result.stdout)
        self.assertEqual(json.loads(figures.read_text())["validation_layer"], [])
        result = tandem(*short, "--time", "20", env={**os.environ, "VK_LAYER_PATH": "/nonexistent"})
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("not used: validation was asked for, but VK_LAYER_KHRONOS_validation is not installed", result.stdout)
        self.assertIn("1 left out as their time is short", tandem(*short, "--time", "5").stdout)
        self.assertNotIn("Validation layer", tandem(*short, "--time", "20", "--no-layer").stdout)

    def test_a_preset_has_its_scenes_and_names_may_take_their_place(self):
        self.refused(tandem("verify"), "--preset: smoke, driver or full")
        figures = self.folder / "out.json"
        (self.folder / "scenes").symlink_to(SCENES)
        # So little time that each scene has one turn at most: which scenes they are is what is asked.
        result = tandem("verify", "--preset", "driver", "--total-time", "2s", "--oracle", "none", "--json", figures, cwd=self.folder)
        told = json.loads(figures.read_text())
        self.assertEqual(len(told["scenes"]) + len(told["not_run"]), len(list(SCENES.glob("*.json"))), result.stderr)
        result = tandem("verify", self.scene, "--preset", "smoke", "--total-time", "20s", "--json", figures, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(len(json.loads(figures.read_text())["scenes"]), 1)

    def test_compare_tells_same_from_brighter(self):
        brighter = self.changed("/background", [0.51, 0.51, 0.51])
        for name, scene, seed in [("a", self.scene, 1), ("b", self.scene, 2), ("c", brighter, 3)]:
            result = tandem("render", scene, "-o", self.folder / f"{name}.exr", "--samples", 4096, "--seed", seed)
            self.assertEqual(result.returncode, 0, result.stderr)
        same = tandem("compare", self.folder / "a.exr", self.folder / "b.exr")
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        other = tandem("compare", self.folder / "a.exr", self.folder / "c.exr")
        self.assertEqual(other.returncode, 1, other.stdout + other.stderr)
        lines = other.stdout.splitlines()
        reason = re.search(r"disagree: (.*?)(;|$)", lines[0])[1]
        self.assertEqual(other.stdout.count(reason), 1, other.stdout)  # in the sentence alone
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "a.exr"), "the same file")

    def test_png_of_16_bits_is_decoded_and_a_gamma_is_taken_from_the_file(self):
        def png(name, seed, gamma=None):
            """32x32 pixels of 0.5, give or take a hundredth, as encoded values of 16 bits."""
            noise, side = random.Random(seed), 32
            rows = b"".join(b"\0" + b"".join(struct.pack(">H", round(65535 * noise.gauss(0.5, 0.01))) for _ in range(3 * side))
                            for _ in range(side))
            chunks = [(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 2, 0, 0, 0))]
            chunks += [(b"gAMA", struct.pack(">I", round(100000 / gamma)))] if gamma else []
            chunks += [(b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
            path = self.folder / name
            path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
                struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks))
            return path

        a, b, c = ([png(f"{name}{k}.png", f"{name}{k}", gamma) for k in range(3)]
                   for name, gamma in (("a", None), ("b", None), ("c", 1.8)))
        same = tandem("compare", *a, "vs", *b)
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        self.assertIn("values of 16 bits are decoded to linear light from sRGB", same.stdout)
        other = tandem("compare", *a, "vs", *c, "--json", self.folder / "out.json")
        self.assertEqual(other.returncode, 1, other.stdout + other.stderr)  # 0.5^1.8 is more than 0.214
        self.assertIn("from a gamma of 1.8", other.stdout)
        scene = json.loads((self.folder / "out.json").read_text())["scenes"][0]
        self.assertAlmostEqual(scene["relative_difference"], 0.5**1.8 / 0.21404 - 1, delta=0.01)

    def test_variances_are_said_of_a_side_and_the_old_option_holds_for_both(self):
        for name in ("a", "b"):
            tandem("render", self.scene, "-o", self.folder / f"{name}.exr", "--samples", 256, "--seed", ord(name))
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for options in (["--variance-of-a", "sample"], ["--variance-of-a", "mean", "--variance-of-b", "sample"]):
            result = tandem("compare", *images, *options)
            self.assertIn(result.returncode, [0, 1, 3], result.stderr)
            self.assertEqual(result.stderr, "")
        self.assertIn("holds for both sides", tandem("compare", *images, "--variance-of", "sample").stderr)
        self.refused(tandem("compare", *images, "--variance-of-b", "median"), "--variance-of-b")

    def test_a_scene_without_light_is_undecided(self):
        dark = self.changed("/background", [0, 0, 0])
        result = tandem("verify", dark, "--size", "8", "--samples", 256, "--time", 20, "--candidate", "oracle", "--oracle", "none")
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertIn("both are black, so nothing was compared", result.stdout)

    def test_compare_refuses_images_that_do_not_match(self):
        for name, size in [("a", 16), ("b", 24)]:
            tandem("render", self.scene, "-o", self.folder / f"{name}.exr", "--size", size)
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "b.exr"), "16", "24")
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "missing.exr"), "missing.exr")
        self.refused(tandem("compare", self.folder / "a.exr", self.scene), "scene.json")

    def junit(self, path):
        """The one testsuite, its attributes and testcases, as a parser sees them."""
        root = ElementTree.parse(path).getroot()
        self.assertEqual(root.tag, "testsuites")
        suite, = root
        return suite.attrib, suite.findall("testcase")

    def test_verify_writes_junit_with_the_outvoted_side(self):
        closed = self.changed("/expect", {"radiance": [0.6, 0.6, 0.6], "formula": "a < b & \"c\""})
        report, figures = self.folder / "junit.xml", self.folder / "out.json"
        result = tandem("verify", self.scene, closed, "--junit", report, "--json", figures, "--time", 20)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        suite, (good, bad) = self.junit(report)
        self.assertEqual((suite["tests"], suite["failures"], suite["errors"]), ("2", "1", "0"))
        self.assertEqual((good.get("name"), bad.get("name")), ("scene", "changed"))
        self.assertIsNone(good.find("failure"))
        # Both backends miss this closed form, which is none; the oracle, too.
        message = bad.find("failure").get("message")
        self.assertIn("the closed form a < b & \"c\" sides with neither", message)
        self.assertIn("the oracle contradicts neither, and misses the closed form too", message)
        self.assertIn("closed form, candidate", bad.find("failure").text)
        self.assertEqual(json.loads(figures.read_text())["scenes"][1]["outvoted"], "both")

    def test_undecided_scenes_are_errors_in_junit(self):
        report = self.folder / "junit.xml"
        result = tandem("verify", self.scene, "--junit", report, "--margin", "1e-9", "--samples", 128)
        self.assertEqual(result.returncode, 3, result.stderr)
        suite, (case,) = self.junit(report)
        self.assertEqual(suite["errors"], "1")
        self.assertEqual(case.find("error").get("type"), "undecided")

    def test_compare_writes_junit(self):
        brighter = self.changed("/background", [0.51, 0.51, 0.51])
        for name, scene, seed in [("a", self.scene, 1), ("b", brighter, 2)]:
            tandem("render", scene, "-o", self.folder / f"{name}.exr", "--samples", 1024, "--seed", seed)
        report = self.folder / "junit.xml"
        result = tandem("compare", self.folder / "a.exr", self.folder / "b.exr", "--junit", report)
        self.assertEqual(result.returncode, 1, result.stderr)
        _, (case,) = self.junit(report)
        self.assertIsNotNone(case.find("failure"))

    def test_a_closed_form_that_does_not_hold_is_left_out_with_the_reason(self):
        result = tandem("verify", SCENES / "furnace.json", "--bounces", 3, "--time", 30)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("closed form is left out: it holds at 12 bounces, not at 3", result.stdout)

    def test_the_oracle_can_be_left_out(self):
        wrong = self.changed("/expect", {"radiance": [0.6, 0.6, 0.6], "formula": "no"})
        result = tandem("verify", wrong, "--oracle", "none", "--time", 20)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertNotIn("oracle", result.stdout)
        self.refused(tandem("verify", wrong, "--oracle", "nobody"), "nobody")

    def test_a_refused_verify_leaves_no_report_folder(self):
        report = self.folder / "report"
        self.refused(tandem("verify", self.scene, "--candidate", "nobody", "--report", report), "nobody")
        self.refused(tandem("compare", "absent.exr", "vs", "absent.exr", "--report", report), "absent.exr")
        self.assertFalse(report.exists())


if __name__ == "__main__":
    unittest.main()
