# The pictures of the accuracy overview: a small scene is rendered to a folder of its own, and its files have the errors of their
# captions. The search for an equal error, by renders that are made up. Run by ctest with TANDEM = the program, SCENES = the folder,
# SCRIPTS = scripts/.
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import types
import unittest

SCENES, SCRIPTS = (pathlib.Path(os.environ[name]) for name in ("SCENES", "SCRIPTS"))
sys.path.insert(0, str(SCRIPTS / "make"))
import accuracy_pages  # noqa: E402  (after the path is set)
import numpy  # noqa: E402
from PIL import Image  # noqa: E402

SCRIPT = SCRIPTS / "measure/accuracy_pictures"
loader = importlib.machinery.SourceFileLoader("accuracy_pictures", str(SCRIPT))
sys.dont_write_bytecode = True
pictures = importlib.util.module_from_spec(importlib.util.spec_from_loader("accuracy_pictures", loader))
loader.exec_module(pictures)


def arm(knob, setting, options, samples, slope):
    return {"knob": knob, "setting": setting, "options": options, "keeps_estimate": True, "slope": slope, "points": [],
            "seconds_to": [{"relative_error": 0.05, "seconds": 1e-3 * samples, "samples": samples}]}


def linear(path):
    coded = numpy.asarray(Image.open(path).convert("RGB")) / 255
    return numpy.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055)**2.4)


class Files(unittest.TestCase):
    """Of one scene of few bright pixels, so that clipping at 1 changes little."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        (cls.folder / "cpu").mkdir()
        # Both searches begin far off: the baseline with too few samples, Sobol's points with too many.
        report = {"arms": [arm("baseline", "", "", 100, None), arm("generator", "sobol", "--generator sobol", 50, -0.6)],
                  "reference": {"options": "--integrator next-event --bounces 256 --roulette 4 --generator sobol"}}
        report["arms"][1]["seconds_to"][0]["samples"] = 1000
        (cls.folder / "cpu/glass.json").write_text(json.dumps(report))
        cls.result = subprocess.run(
            [sys.executable, SCRIPT, "--name", "cpu", "--folder", cls.folder, "--work", cls.folder / "work", "--size", "40",
             "--times", "0.1,0.3", "--reference", "4", "--most", "10", SCENES / "glass.json"], capture_output=True, text=True, timeout=300)
        cls.kept = cls.folder / "pictures/cpu/glass"
        cls.set = json.loads((cls.kept / "pictures.json").read_text()) if cls.result.returncode == 0 else None

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr)

    def test_every_picture_and_difference_is_a_png_of_the_size(self):
        titles = [picture["title"] for picture in self.set["pictures"]]
        self.assertEqual(titles, ["reference", "0.1 s, generator sobol", "0.1 s, baseline", "0.3 s, generator sobol", "0.3 s, baseline",
                                  "5 %, generator sobol", "5 %, baseline"], self.set["missing"])
        for picture in self.set["pictures"]:
            for key in ("file", "difference"):
                if picture["title"] != "reference" or key == "file":
                    with Image.open(self.kept / picture[key]) as image:
                        self.assertEqual((image.format, image.size), ("PNG", (40, 25)), picture)
        self.assertEqual({path.name for path in self.kept.iterdir()}, {"pictures.json"} | {
            picture[key] for picture in self.set["pictures"] for key in ("file", "difference") if key in picture})

    def test_a_file_has_the_error_of_its_caption(self):
        reference, seen = linear(self.kept / "reference.png"), []
        for picture in self.set["pictures"][1:]:
            error = float(((linear(self.kept / picture["file"]) - reference)**2).mean()**0.5 / reference.mean())
            self.assertAlmostEqual(picture["shown_error"], error, delta=1e-3 * error)
            # Below, eight bits tell; above, much is clipped; "at most" is no error.
            if 0.02 < picture["error"] < 0.2 and not picture["at_most"]:
                self.assertLess(abs(error / picture["error"] - 1), 0.2, picture)
                seen.append(picture["title"])
        self.assertLessEqual({"5 %, generator sobol", "5 %, baseline"}, set(seen))

    def test_pictures_at_equal_error_have_it(self):
        for picture in self.set["pictures"][-2:]:
            self.assertLessEqual(abs(picture["error"] / 0.05 - 1), 0.1, picture)
        self.assertEqual(self.set["missing"], [])

    def test_a_difference_is_blue_where_darker_and_red_where_lighter(self):
        picture = self.set["pictures"][-1]
        change = (linear(self.kept / picture["file"]) - linear(self.kept / "reference.png")).mean(2)
        shown = numpy.asarray(Image.open(self.kept / picture["difference"]).convert("RGB")).astype(int)
        red = shown[..., 0] - shown[..., 2]
        strong = numpy.abs(change) > numpy.quantile(numpy.abs(change), 0.8)
        self.assertGreater((numpy.sign(red) == numpy.sign(change))[strong].mean(), 0.95)

    def test_the_page_takes_them(self):
        (found,) = accuracy_pages.load_pictures(self.folder, "glass")
        self.assertEqual(found["machine"], "cpu")
        for picture in found["pictures"]:
            self.assertTrue(picture["file"].startswith("data:image/png;base64,iVBOR"), picture["file"][:40])


class Search(unittest.TestCase):
    """For an equal error: renders of which the error is known by the samples."""

    def search(self, error_of_samples, known=64, slope=None, fastest=float("inf")):
        job = object.__new__(pictures.Job)
        job.reference, job.uncertainty, self.kept, self.asked = numpy.ones((4, 4, 3)), 1e-4, [], []
        job.set, job.arguments = {"missing": []}, types.SimpleNamespace(most=60)

        def render(_name, _options, _samples, samples, *_rest):
            self.asked.append(samples)
            done = min(samples, fastest)
            return job.reference * (1 + error_of_samples(done)), {"samples": done, "seconds": 0.01 * done}

        job.render = render
        job.keep = lambda _name, _title, _options, _image, _seconds, error: self.kept.append(error)
        job.at_error("best", arm("generator", "sobol", "--generator sobol", known, slope))
        return job.set["missing"]

    def test_it_comes_near_whatever_the_slope(self):
        for power in (0.5, 0.6, 0.75, 0.9, 1):
            for known in (4, 64, 4000):
                for slope in (None, -0.4, -0.5, -0.75, -1.3):
                    # 400 samples have the error that is sought.
                    missing = self.search(lambda n: 0.05 * (400 / n)**power, known, slope)
                    self.assertEqual(missing, [], (power, known, slope, self.asked))
                    self.assertLessEqual(abs(self.kept[0] / 0.05 - 1), 0.1)

    def test_a_slope_that_noise_made_is_not_believed(self):
        self.assertEqual(pictures.slope_between((100, 0.1), (200, 0.12)), -0.5)
        self.assertEqual(pictures.slope_between((100, 0.1), (110, 0.01)), -1)
        self.assertAlmostEqual(pictures.slope_between((100, 0.1), (200, 0.1 / 2**0.7)), -0.7)
        self.assertIsNone(pictures.slope_between((100, 0.1), (100, 0.1)))

    def test_it_says_why_there_is_no_picture(self):
        (late,) = self.search(lambda n: 1 / n**0.5, fastest=100)
        self.assertIn("not reached within 60 s; the last render had 10 % with 100 samples a pixel, after 1 s", late)
        (few,) = self.search(lambda n: 0.02 / n**0.5)
        self.assertIn("not shown, as 2 renders did not come within 10 % of it; the nearest had 2 % with 1 sample a pixel", few)
        (floor,) = self.search(lambda n: 0.08 + 1 / n, known=1000)
        self.assertRegex(floor, r"4 renders did not come within 10 % of it; the nearest had 8\.\d* % with \d+ samples a pixel")
        def no_time(*_words):
            raise pictures.TooLittleTime

        job = object.__new__(pictures.Job)
        job.render, job.set, job.uncertainty, job.arguments = no_time, {"missing": []}, 1e-4, types.SimpleNamespace(most=60)
        job.at_time(1.0, "baseline", arm("baseline", "", "", 100, None))
        job.at_error("baseline", arm("baseline", "", "", 100, None))
        self.assertEqual(job.set["missing"], [
            "1 s, baseline: not shown, as loading and a sample of every pixel take longer",
            "5 %, baseline: not shown, as loading and a sample of every pixel take longer than 60 s"])
        for line in (late, few, floor):
            self.assertEqual(line.count("not reached") + line.count("not shown"), 1, line)

    def test_a_generator_comes_once(self):
        self.assertEqual(pictures.with_generator("--bounces 256 --generator hash"), "--bounces 256 --generator hash")
        self.assertEqual(pictures.with_generator("--bounces 256"), "--bounces 256 --generator sobol")
        self.assertEqual(pictures.with_generator(""), "--generator sobol")


if __name__ == "__main__":
    unittest.main()
