# The Python package of scripts/python, installed as a user installs it, on numpy's images and renderers, and in pytest. Run by
# ctest with TANDEM = the program, SCENES = scenes/, by Debian's own interpreter.
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest

import numpy

SOURCE = pathlib.Path(os.environ["SCENES"]).resolve().parent
INSTALLED = tempfile.mkdtemp()
unittest.addModuleCleanup(shutil.rmtree, INSTALLED)


def setUpModule():
    copy = pathlib.Path(INSTALLED, "source")  # setuptools writes beside what it builds
    shutil.copytree(SOURCE / "scripts/python", copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-deps", "--no-index",
                    "--root-user-action=ignore", "--target", f"{INSTALLED}/site", str(copy)], check=True, timeout=120)
    sys.path.insert(0, f"{INSTALLED}/site")
    global tandem
    import tandem


def images(factor=1.0, count=4, size=32, seed=1):
    """Independent images of a grey wall with noise of 2 %, (count, size, size, 3)."""
    return factor * (0.5 + numpy.random.default_rng(seed).normal(0, 0.01, (count, size, size, 3)))


def wall(scene, width, height, samples, seed, first_sample):
    """What furnace.json shows with no bounces: the background, here with noise of its own."""
    noise = numpy.random.default_rng(seed).normal(0, 0.01 / samples ** 0.5, (height, width, 3))
    return numpy.array([0.25, 0.5, 1.0]) * (1 + noise)


class Compare(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def test_arrays_of_one_wall_agree(self):
        result = tandem.compare(images(), list(images(seed=2)))
        self.assertEqual(result.verdict, "agree", result)
        self.assertTrue(result.agrees)
        self.assertTrue(result.sentence.startswith("a1.npy: A and B agree within "), result.sentence)
        self.assertLess(abs(result.numbers["relative_difference"]), 0.01)
        self.assertIsNone(result.report)

    def test_a_factor_is_named_and_the_report_is_there(self):
        result = tandem.compare(images(), images(1.1, seed=2), report=self.folder / "report")
        self.assertEqual(result.verdict, "disagree")
        self.assertIn("constant exposure factor of 1.1", result.sentence)
        self.assertAlmostEqual(result.numbers["relative_difference"], 0.1, delta=0.01)
        self.assertTrue((result.report / "report.json").exists())
        self.assertIn(str(result.report), str(result))

    def test_one_array_tells_its_noise_by_the_variance_of_its_means(self):
        variance = numpy.full((32, 32, 3), 1e-4)
        a, b = (numpy.concatenate([images(seed=seed)[0], variance], 2).astype(numpy.float32) for seed in (1, 2))
        self.assertEqual(tandem.compare(a, b).verdict, "agree")

    def test_files_go_with_arrays_and_options(self):
        files = []
        for i, image in enumerate(images()):
            files.append(self.folder / f"{i}.npy")
            numpy.save(files[-1], image)
        self.assertEqual(tandem.compare(files, images(1.02, seed=2), margin="5%", negligible="3%", tile_negligible="5%").verdict,
                         "agree")

    def test_what_is_unusable_is_told(self):
        a = images()
        for sides, error, mention in [((a[0], a[1]), ValueError, "has no channels variance"),
                                      ((a, "missing.exr"), ValueError, "missing.exr: no such file"),
                                      ((a, (a * 255).astype(numpy.uint8)), TypeError, "uint8"),
                                      ((a[..., 0], a[..., 0]), ValueError, "shape"),
                                      ((a, [a[0], "b.exr"]), ValueError, "files and arrays")]:
            with self.subTest(mention=mention), self.assertRaisesRegex(error, mention):
                tandem.compare(*sides)
        with self.assertRaisesRegex(ValueError, "--fancy: no such option"):
            tandem.compare(a, a, fancy=3)

    def test_no_program_is_told(self):
        try:
            os.environ["TANDEM"], kept = "/nonexistent/tandem", os.environ["TANDEM"]
            with self.assertRaisesRegex(FileNotFoundError, "set TANDEM"):
                tandem.compare(images(), images(seed=2))
        finally:
            os.environ["TANDEM"] = kept


class Verify(unittest.TestCase):
    def test_a_callable_is_judged(self):
        asked = []

        def dimmer(*request):
            asked.append(request)
            return 0.9 * wall(*request)

        for render, verdict in ((wall, "agree"), (dimmer, "disagree")):
            with self.subTest(render.__name__):
                result = tandem.verify("furnace", render, size=16, time=20, bounces=0, margin="5%", samples=256)
                self.assertEqual(result.verdict, verdict, result)
                self.assertEqual(result.numbers["candidate"]["name"], render.__name__)
        self.assertEqual(pathlib.Path(asked[0][0]).name, "furnace.json")
        self.assertEqual(asked[0][1:3], (16, 16))
        self.assertGreaterEqual(len({seed for *_, seed, _ in asked}), 8)

    def test_what_a_callable_raises_is_raised(self):
        def broken(*_):
            raise KeyError("a fault of mine")

        with self.assertRaisesRegex(KeyError, "a fault of mine"):
            tandem.verify("furnace", broken, size=16, time=20)
        with self.assertRaisesRegex(ValueError, r"shape \(16, 16\)"):
            tandem.verify("furnace", lambda *_: numpy.ones((16, 16)), size=16, time=20)

    def test_a_backend_and_a_command_are_judged(self):
        self.assertEqual(tandem.verify("furnace", "cpu", "oracle", size=8, time=20, no_paired=True, margin="5%").verdict, "agree")
        failed = tandem.verify("furnace", "exec:false {samples} {seed} {out}", size=8, time=20)
        self.assertEqual(failed.verdict, "failed")
        self.assertIn("not judged: exec: false ended with status 1", failed.sentence)

    def test_no_device_and_no_scene_are_told(self):
        kept = dict(os.environ)
        try:
            os.environ["VK_DRIVER_FILES"] = os.environ["VK_ICD_FILENAMES"] = "/nonexistent"
            with self.assertRaisesRegex(tandem.NoDevice, "Vulkan"):
                tandem.verify("furnace", "vulkan")
        finally:
            os.environ.clear()
            os.environ.update(kept)
        with self.assertRaisesRegex(ValueError, "nowhere"):
            tandem.verify("nowhere", "cpu")


class Pytest(unittest.TestCase):
    def test_a_failure_is_the_sentence_and_the_report(self):
        with tempfile.TemporaryDirectory() as folder:
            test = pathlib.Path(folder, "test_wall.py")
            test.write_text(textwrap.dedent("""
                import numpy
                def images(factor, seed):
                    return factor * (0.5 + numpy.random.default_rng(seed).normal(0, 0.01, (4, 16, 16, 3)))
                def test_same(render_verdict):
                    assert render_verdict.compare(images(1, 1), images(1, 2)).agrees
                def test_brighter(render_verdict):
                    render_verdict.compare(images(1, 1), images(1.1, 2))
                def test_noise(render_verdict):
                    render_verdict.compare(images(1, 1), images(1, 2), margin="0.0001%")
                def test_device(render_verdict, monkeypatch):
                    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent")
                    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent")
                    render_verdict.verify("furnace", size=8)
            """))
            result = subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-rA", "--tandem-reports", "kept", str(test)],
                                    cwd=folder, capture_output=True, text=True, timeout=120,
                                    env={**os.environ, "PYTHONPATH": f"{INSTALLED}/site", "COLUMNS": "500"})
            self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
            self.assertIn("2 failed, 1 passed, 1 skipped", result.stdout)
            report = pathlib.Path(folder).resolve() / "kept/test_wall.py_test_brighter/verdict1"
            self.assertIn("A and B disagree: image: ", result.stdout)
            self.assertIn(f"report: {report} (tandem-report ", result.stdout)
            self.assertTrue((report / "report.json").exists())
            self.assertIn("A and B are undecided: ", result.stdout)


if __name__ == "__main__":
    unittest.main()
