# What `cmake --install` gives, as its user meets it: scenes from any folder, the CMake package in a project of its own, the
# report. Run by ctest with TANDEM = the program, BINARY = the build folder that is installed from.
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

BINARY = pathlib.Path(os.environ["BINARY"])
SOURCE = pathlib.Path(__file__).resolve().parents[2]
PREFIX = pathlib.Path(tempfile.mkdtemp())
unittest.addModuleCleanup(shutil.rmtree, PREFIX)
PROGRAM = PREFIX / "bin" / "tandem"
FINE, DISAGREE, UNUSABLE, UNDECIDED, NO_DEVICE = range(5)
NO_DRIVER = {**os.environ, "VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}


def setUpModule():
    subprocess.run(["cmake", "--install", BINARY, "--prefix", PREFIX], check=True, capture_output=True, timeout=60)


class Elsewhere(unittest.TestCase):
    """In an empty folder."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def run_(self, *words, **options):
        return subprocess.run(list(map(str, words)), cwd=self.folder, capture_output=True, text=True, timeout=120, **options)


class Installed(Elsewhere):
    def test_scenes_are_found_by_name_and_by_path(self):
        for scene in ("furnace", "furnace.json", "scenes/furnace.json", "closed-forms/polygon-light", "model"):
            with self.subTest(scene):
                result = self.run_(PROGRAM, "render", scene, "-o", "image.pfm", "--size", 8, "--samples", 4)
                self.assertEqual(result.returncode, FINE, result.stderr)
        exr = self.run_(PROGRAM, "render", "furnace", "-o", "image.exr", "--size", 8, "--samples", 4)  # by the image module
        self.assertEqual(exr.returncode, FINE, exr.stderr)
        for scene in ("hard", "README", "../LICENSE", "nowhere"):  # a folder, and what is no scene
            with self.subTest(scene):
                result = self.run_(PROGRAM, "render", scene, "-o", "none.pfm", "--size", 8, "--samples", 4)
                self.assertEqual(result.returncode, UNUSABLE, result.stderr)
                self.assertTrue(result.stderr.startswith(f"tandem: {scene}: no such file"), result.stderr)

    def test_a_file_of_the_folder_comes_before_one_that_is_shipped(self):
        (self.folder / "furnace.json").write_text("{")
        result = self.run_(PROGRAM, "render", "furnace.json", "-o", "image.pfm")
        self.assertEqual(result.returncode, UNUSABLE, result.stderr)

    def test_presets_benchmarks_and_hard_cases_work_anywhere(self):
        result = self.run_(PROGRAM, "verify", "--preset", "smoke", "--total-time", "2s", "--junit", "smoke.xml", "--oracle", "none")
        self.assertIn(result.returncode, (FINE, UNDECIDED), result.stdout + result.stderr)
        cases = [case.get("name") for case in ElementTree.parse(self.folder / "smoke.xml").getroot().iter("testcase")]
        self.assertEqual(len(cases), 6)
        self.assertEqual(self.run_(PROGRAM, "stability", "--case", "2", "--backend", "cpu", "--time", 20).returncode, FINE)
        result = self.run_(PROGRAM, "bench", "--family", "barriers", "--size", "16x16", "--time", 1)
        self.assertNotEqual(result.returncode, UNUSABLE, result.stderr)

    def test_a_program_alone_says_that_it_has_no_scenes(self):
        shutil.copy(PROGRAM, self.folder / "tandem")
        result = self.run_("./tandem", "verify", "--preset", "smoke")
        self.assertEqual(result.returncode, UNUSABLE)
        self.assertIn("there is no scene in scenes/", result.stderr)

    def test_what_goes_with_the_program_is_there(self):
        for name in ("share/tandem/scenes/format/scene.schema.json", "share/tandem/scenes/format/FORMAT.md",
                     "share/tandem/scenes/hard/catalogue.json", "share/tandem/python/pyproject.toml", "share/doc/tandem/copyright"):
            self.assertTrue((PREFIX / name).is_file(), name)
        result = self.run_(PROGRAM, "compare", "--help")
        self.assertEqual(result.returncode, FINE)

    def test_own_arms_are_compiled_measured_and_drawn(self):
        shutil.copy(PREFIX / "share/tandem/arms/template.c", self.folder / "my.c")
        compiled = self.run_("cc", "-shared", "-fPIC", f"-I{PREFIX / 'include'}", "-o", "my.so", "my.c", "-lvulkan")
        self.assertEqual(compiled.returncode, 0, compiled.stderr)
        result = self.run_(PROGRAM, "bench", "--arm-library", "my.so", "--time", 2, "--replicates", 1, "--json", "my.json")
        self.assertEqual(result.returncode, FINE, result.stderr)
        result = self.run_("/usr/bin/python3", PREFIX / "bin" / "tandem-report", "my.json")
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertIn("many-fills", (self.folder / "my.html").read_text())

    def test_the_overview_of_costs_is_made(self):
        stored = pathlib.Path(__file__).resolve().parents[1] / "records" / "accuracy"
        for machine in ("cpu", "h200"):
            shutil.copytree(stored / machine, self.folder / "results" / machine)
        result = self.run_("/usr/bin/python3", PREFIX / "bin" / "tandem-report", "results")
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertIn("lamps", (self.folder / "results" / "overview.html").read_text())

    def test_the_report_is_made(self):
        self.run_(PROGRAM, "verify", "furnace", "--candidate", "cpu", "--reference", "oracle", "--no-paired", "--size", 8,
                  "--samples", 64, "--report", "report")
        result = self.run_("/usr/bin/python3", PREFIX / "bin" / "tandem-report", "report")
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertIn("furnace", (self.folder / "report" / "report.html").read_text())


class CMakePackage(Elsewhere):
    def configure(self, *lines):
        (self.folder / "CMakeLists.txt").write_text("\n".join([
            "cmake_minimum_required(VERSION 3.25)", "project(mine NONE)", "enable_testing()", "find_package(Tandem 0.1 REQUIRED)",
            *lines]))
        return self.run_("cmake", "-S", ".", "-B", "build", f"-DCMAKE_PREFIX_PATH={PREFIX}")

    def outcomes(self, **options):
        """By test: run, fail or notrun (skipped), as CTest's own JUnit file tells."""
        self.run_("ctest", "--test-dir", "build", "--output-junit", "ctest.xml", **options)
        cases = ElementTree.parse(self.folder / "build" / "ctest.xml").getroot().iter("testcase")
        return {case.get("name"): case.get("status") for case in cases}

    def test_verdicts_of_a_program_become_tests(self):
        # The candidate is the program itself: with fewer bounces it is another image.
        candidate = f"exec:{PROGRAM} render {{scene}} -o {{out}} --samples {{samples}} --seed {{seed}} --size 16 --bounces"
        result = self.configure(
            f"tandem_add_render_test(NAME same SCENE cornell-classic CANDIDATE \"{candidate} {{bounces}}\" TIME 30",
            "  ARGS --size 16 --margin 10% --tile-margin 50% --oracle none)",
            f"tandem_add_render_test(NAME dark SCENE cornell-classic CANDIDATE \"{candidate} 0\" TIME 30 ARGS --size 16 --oracle none)")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.outcomes(), {"same": "run", "dark": "fail"})
        for file in ("same.junit.xml", "same.json", "same.report/report.json", "dark.junit.xml"):
            self.assertTrue((self.folder / "build" / file).exists(), file)

    def test_undecided_and_no_device_are_told_apart(self):
        undecided = "SCENE furnace glass CANDIDATE cpu REFERENCE oracle TIME 1 ARGS --size 16 --margin 0.0001% --samples 64"
        result = self.configure(
            f"tandem_add_render_test(NAME undecided {undecided})",
            f"tandem_add_render_test(NAME undecided-skipped SKIP undecided {undecided})",
            f"tandem_add_render_test(NAME undecided-both SKIP both {undecided})",
            "tandem_add_render_test(NAME device SCENE furnace)",
            "tandem_add_render_test(NAME device-both SCENE furnace SKIP both)",
            "tandem_add_render_test(NAME device-needed SCENE furnace SKIP none)")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.outcomes(env=NO_DRIVER), {
            "undecided": "fail", "undecided-skipped": "notrun", "undecided-both": "notrun",
            "device": "notrun", "device-both": "notrun", "device-needed": "fail"})

    def test_what_is_unknown_is_refused(self):
        for words, mention in [("NAME a SCENE furnace CANDIDAT cpu", "CANDIDAT"), ("NAME a", "give SCENE or PRESET"),
                               ("SCENE furnace", "names no files"), ("NAME a SCENE furnace SKIP maybe", "SKIP 'maybe' is unknown")]:
            with self.subTest(words):
                result = self.configure(f"tandem_add_render_test({words})")
                self.assertNotEqual(result.returncode, 0)
                self.assertIn(mention, " ".join(result.stderr.split()))


class Page(unittest.TestCase):
    """What scripts/package/README.md tells a reader to type."""

    def test_every_command_of_the_page_runs(self):
        page = (SOURCE / "scripts" / "package" / "README.md").read_text()
        text = "".join(re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S))
        built = re.sub(r"^scripts/(build|setup).*\n", "", text, flags=re.M)
        self.assertIn("tandem_add_render_test", built)
        with tempfile.TemporaryDirectory() as folder:
            build = pathlib.Path(folder) / "build"
            build.mkdir()
            for name in ("scenes", "scripts"):
                os.symlink(SOURCE / name, pathlib.Path(folder) / name)
            os.symlink(BINARY, build / "release")
            result = subprocess.run(["bash", "-ec", built], cwd=folder, capture_output=True, text=True, timeout=200)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            self.assertIn("100% tests passed, 0 tests failed out of 1", result.stdout)
            self.assertTrue((build / "mine/build/box.report/report.html").exists())


if __name__ == "__main__":
    unittest.main()
