# `tandem verify --candidate exec:COMMAND`: another program is judged. One that crashes, hangs or gives no image is told
# in one line, and leaves no process behind. Run by ctest with TANDEM = the program, SCENES = the folder of the shipped
# scenes.
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from xml.etree import ElementTree

from program import SCENES, SPHERE, TANDEM, ProgramTest, Stopwatch, tandem, until

SOURCE = pathlib.Path(__file__).resolve().parents[2]
FAKE = pathlib.Path(__file__).with_name("fake_renderer.py")
ASKED = "{width} {height} {samples} {seed} {out:pfm}"


class Programs(ProgramTest):
    def command(self, mode, asked=ASKED):
        return f"exec:{shlex.quote(sys.executable)} {FAKE} {mode} {self.folder / mode}.log {asked}".strip()

    def verify(self, candidate, *options, reference=None, time=60, samples=128):
        return tandem("verify", self.scene, "--reference", reference or self.command("plain"), "--candidate", candidate,
                      "--oracle", "none", "--time", time, "--samples", samples, *options)

    def lines(self, mode, begins):
        path = self.folder / f"{mode}.log"
        return [line for line in path.read_text().splitlines() if line.startswith(begins)] if path.exists() else []

    def failed(self, result, *mentions):
        """Status 1, one line about the scene that says what happened, and no verdict."""
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        told = [line for line in result.stdout.splitlines() if line.startswith("scene: not judged: exec: ")]
        self.assertEqual(len(told), 1, result.stdout)
        for mention in mentions:
            self.assertIn(mention, told[0])
        self.assertIn("Verdict: failed", result.stdout)

    def ended(self, pids):
        """Whether no process of these numbers is left, soon."""
        def alive(pid):
            try:
                return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] not in "ZX"
            except OSError:
                return False
        for _ in range(50):
            if not any(map(alive, pids)):
                return True
            time.sleep(0.1)
        return False

    def test_two_programs_agree_and_are_named(self):
        report, junit = self.folder / "out.json", self.folder / "out.xml"
        result = self.verify(self.command("other"), "--json", report, "--junit", junit, "--margin", "5%", "--tile-margin", "50%",
                             "--report", self.folder / "report")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("fake_renderer.py (reference) and fake_renderer.py (candidate) agree within", result.stdout)
        scene = json.loads(report.read_text())["scenes"][0]
        self.assertEqual(scene["candidate"]["device"], self.command("other"))
        self.assertFalse(scene["criteria"]["same_estimator"])
        self.assertIsNone(scene["paired"])
        self.assertIsNone(scene["failure"])
        self.assertEqual(ElementTree.parse(junit).getroot().get("failures"), "0")

    def test_sums_that_drift_by_millionths_are_no_miss_of_the_closed_form(self):
        sky = SPHERE | {"camera": SPHERE["camera"] | {"target": [0, 0, 8]}, "background": [1, 1, 1], "render": {"bounces": 2},
                        "expect": {"radiance": [1, 1, 1], "formula": "the sky's"}}
        self.scene = self.write(sky)
        result = self.verify(self.command("drifts"), reference="cpu")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_a_factor_is_found_and_named(self):
        result = self.verify(self.command("bright"), samples=1024)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("disagree", result.stdout)
        self.assertIn("it looks like a constant exposure factor of 1.1", result.stdout)

    def test_values_encoded_as_srgb_are_found_and_named(self):
        result = self.verify(self.command("sRGB"), samples=1024)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("sRGB", result.stdout.split("disagree")[1])

    def test_each_image_has_a_seed_of_its_own(self):
        result = self.verify(self.command("no-seed"))
        self.failed(result, "fake_renderer.py gave the same image for the seeds ")

    def test_what_is_no_image_is_told(self):
        for mode, mention in [("no-image", "succeeded, but wrote no image to {out}"),
                              ("wrong-size", "wrote an image of 8x16 pixels, not 16x16; give it {width} and {height}"),
                              ("garbage", "wrote no readable image: ")]:
            with self.subTest(mode=mode):
                self.failed(self.verify(self.command(mode)), "exec: fake_renderer.py " + mention)

    def test_nan_is_disagreement(self):
        result = self.verify(self.command("nan"))
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("of the candidate are NaN, infinite or negative", result.stdout)

    def test_negative_colours_are_noise_where_the_program_renders_spectra(self):
        margins = "--margin", "10%", "--tile-margin", "50%"
        result = self.verify(self.command("spectral-too"), *margins)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("of the candidate are NaN, infinite or negative", result.stdout)
        for command, options in ((self.command("spectral-too"), ["--negative-colours"]), (self.command("spectral", ""), [])):
            result = self.verify(command, *options, *margins, samples=1024)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.refused(tandem("verify", self.scene, "--candidate", "cpu", "--negative-colours"), "says it of a program")

    def test_a_crash_is_told_with_the_last_words(self):
        report, junit = self.folder / "out.json", self.folder / "out.xml"
        result = self.verify(self.command("crash"), "--json", report, "--junit", junit, "--report", self.folder / "report")
        self.failed(result, "fake_renderer.py was ended by signal 6 (Aborted): the sky has fallen")
        scene = json.loads(report.read_text())["scenes"][0]
        self.assertIn("the sky has fallen", scene["failure"])
        self.assertEqual(scene["notes"], ["it wrote: loading", "it wrote: the sky has fallen"])
        self.assertEqual(ElementTree.parse(junit).find(".//error").get("type"), "failed")
        self.assertTrue((self.folder / "report" / "report.json").exists())

    def test_a_crash_takes_no_other_scene_with_it(self):
        other = self.write(json.loads(self.scene.read_text()), "other.json")
        result = tandem("verify", self.scene, other, "--reference", self.command("plain"), "--candidate",
                        self.command("crash-at-once"), "--time", 20, "--samples", 128)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertEqual(result.stdout.count("not judged: exec: fake_renderer.py was ended by signal 6"), 2, result.stdout)

    def test_a_program_that_hangs_is_ended_with_all_that_it_started(self):
        for asked in (ASKED, ""):
            with self.subTest(asked=asked):
                with Stopwatch() as watch:
                    result = self.verify(self.command("hang", asked), time=4)
                self.failed(result, "gave no image within ", " s, and was ended")
                self.assertLess(watch.seconds, 20)
                pids = [line.split()[1] for line in self.lines("hang", "pid")]
                self.assertEqual(len(pids), 2)
                self.assertTrue(self.ended(pids), pids)
                os.remove(self.folder / "hang.log")

    def test_ctrl_c_ends_the_program(self):
        for mode in ("hang", "slow"):
            with self.subTest(mode=mode), subprocess.Popen(
                    [TANDEM, "verify", self.scene, "--reference", self.command("plain"), "--candidate", self.command(mode),
                     "--time", "60", "--oracle", "none"], stdout=subprocess.PIPE, text=True) as process:
                until(lambda: self.lines(mode, "image"), "the program renders")
                time.sleep(0.3)
                with Stopwatch() as watch:
                    process.send_signal(signal.SIGINT)
                    output, _ = process.communicate(timeout=40)
                self.assertLess(watch.seconds, 10)
                self.assertEqual(process.returncode, 3, output)
                self.assertTrue(self.ended([line.split()[1] for line in self.lines(mode, "pid")]))

    def test_the_budget_holds(self):
        with Stopwatch() as watch:
            result = self.verify(self.command("slow"), time=4, samples=1 << 20)
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertLess(watch.seconds, 12)

    def test_a_program_that_stays_up_is_started_once(self):
        report = self.folder / "out.json"
        result = self.verify(self.command("resident", ""), "--json", report, "--margin", "5%", "--tile-margin", "50%")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(len(self.lines("resident", "start")), 1)
        self.assertGreater(len(self.lines("resident", "image")), 4)
        self.assertIn(" and fake agree within", result.stdout)
        self.assertEqual(json.loads(report.read_text())["scenes"][0]["candidate"]["driver"], "7")

    def test_a_program_that_stays_up_tells_why_it_cannot(self):
        self.failed(self.verify(self.command("refuses", "")), "exec: fake: no glass here")
        self.failed(self.verify(self.command("crash", "")), "exec: fake was ended by signal 6 (Aborted): the sky has fallen")
        result = self.verify(self.command("bad-hello", ""), time=1)
        self.refused(result, 'gave no first line {"tandem": 1} within 1 s')

    def test_programs_that_draw_the_models_numbers_get_pairs(self):
        report = self.folder / "out.json"
        result = self.verify(self.command("follows", ""), "--json", report, reference=self.command("follows", ""))
        self.assertIn(result.returncode, (0, 3), result.stdout + result.stderr)
        paired = json.loads(report.read_text())["scenes"][0]["paired"]
        self.assertEqual(paired["identical_fraction"], 1.0)
        result = self.verify(self.command("other"), "--follows-model")
        self.refused(result, "has no {first_sample}")

    def test_tandem_itself_is_a_program(self):
        report = self.folder / "out.json"
        command = f"exec:{TANDEM} render {{scene}} --size {{width}}x{{height}} --samples {{samples}} --seed {{seed}} -o {{out}}"
        result = self.verify(command, "--json", report, reference="cpu", samples=256)
        self.assertIn(result.returncode, (0, 3), result.stdout + result.stderr)
        self.assertIn("CPU and tandem ", result.stdout)

    def test_variance_in_any_of_three_forms_is_read(self):
        try:
            import numpy  # noqa: F401
        except ImportError:
            self.skipTest("no python3-numpy")
        script = self.write("""
import numpy, sys
out, kind, samples, seed = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
values = 2 * numpy.random.default_rng(seed).random((samples, 16, 16, 3))
numpy.save(out, numpy.concatenate([values.mean(0), values.var(0, ddof=1)], axis=2) if kind == "npy" else values.mean(0))
""", "noise.py")
        for kind in ("npy", "plain"):
            with self.subTest(kind=kind):
                command = f"exec:{shlex.quote(sys.executable)} {script} {{out:npy}} {kind} {{samples}} {{seed}}"
                report = self.folder / "out.json"
                result = self.verify(command, "--json", report, "--margin", "3%", "--tile-margin", "50%", reference=command, samples=256)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_bad_commands_are_refused_before_work(self):
        python = shlex.quote(sys.executable)
        for command, *mentions in [
                ("exec:", "no command"),
                ("exec:no-such-program-anywhere {out} {samples} {seed}", "no program 'no-such-program-anywhere'"),
                (f"exec:{self.folder}/none.py {{out}} {{samples}} {{seed}}", "no program"),
                (f"exec:{self.scene} {{out}} {{samples}} {{seed}}", "is not executable"),
                (f"exec:{python} x {{out}} {{samples}} {{sed}}", "unknown placeholder {sed}", "did you mean seed?"),
                (f"exec:{python} x {{out}} {{seed}}", "has no {samples}"),
                (f"exec:{python} x {{samples}} {{seed}}", "has no {out}"),
                (f"exec:{python} x {{out}} {{samples}}", "has no {seed}"),
                (f"exec:{python} 'x {{out}} {{samples}} {{seed}}", "open '"),
                ("exec:sh -c 'render {scene} > {out}' {samples} {seed}", "{scene} within the text of sh -c would be read as code")]:
            with self.subTest(command=command):
                self.refused(self.verify(command), "exec: ", *mentions)

    def test_what_a_program_is_not_told_is_refused(self):
        for options, mention in [(["--bounces", 3], "is not told --bounces; add {bounces}"), (["--clamp", 3], "is not told --clamp"),
                                 (["--filter", "tent"], "is not told --filter; add {filter}"),
                                 (["--integrator", "whitted"], "is not told --integrator"),
                                 (["--precision", "double"], "precisions"), (["--kernel", "stages"], "kernels")]:
            with self.subTest(options=options):
                self.refused(self.verify(self.command("plain"), *options), "exec: ", mention)
        self.refused(tandem("render", self.scene, "-o", self.folder / "o.exr", "--backend", self.command("plain")),
                     "exec: only verify takes a command")
        self.refused(tandem("trace", self.scene, "--pixel", "1,1", "--backend", self.command("plain")), "")

    def test_values_stay_one_word(self):
        scene = self.write(json.loads(self.scene.read_text()), "a b; touch owned.json")
        script = self.write("import sys\nprint(len(sys.argv), sys.argv[1:4], file=sys.stderr)\nsys.exit(3)\n", "words.py")
        result = tandem("verify", scene, "--reference", "cpu", "--candidate", f"exec:{shlex.quote(sys.executable)} {script} "
                        "{scene} 'two words {seed}' {{x}} {samples} {out}", "--time", 5, cwd=self.folder)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn(f"ended with status 3: 6 ['{scene}', 'two words ", result.stdout)
        self.assertIn("', '{x}']", result.stdout)
        self.assertFalse((self.folder / "owned.json").exists())


# Two bodies on a floor under the sky: edges, and all light by scattering, so that the oracle can judge soon.
GARDEN = {
    "film": {"width": 32, "height": 32},
    "camera": {"position": [0.5, 2, 6], "target": [0, 0.6, 0], "up": [0, 1, 0], "vertical_field_degrees": 32},
    "background": {"down": [0.2, 0.2, 0.2], "up": [0.6, 0.8, 1]},
    "render": {"bounces": 4},
    "materials": {"floor": {"kind": "diffuse", "colour": [0.3, 0.3, 0.3]}, "red": {"kind": "diffuse", "colour": [0.8, 0.2, 0.1]},
                  "blue": {"kind": "diffuse", "colour": [0.1, 0.3, 0.8]}},
    "entities": [
        {"material": "floor", "primitives": [{"quad": {"corner": [-4, 0, 4], "edges": [[8, 0, 0], [0, 0, -8]]}}]},
        {"material": "red", "primitives": [{"sphere": {"centre": [-0.8, 0.71, 0], "radius": 0.7}}]},
        {"material": "blue", "transform": [{"rotate": {"axis": [0, 1, 0], "degrees": 30}}, {"translate": [0.9, 0.01, 0]}],
         "primitives": [{"cuboid": {"minimum": [-0.5, 0, -0.5], "maximum": [0.5, 1.4, 0.5]}}]}],
}


class FirstPathTracer(ProgramTest):
    SOURCE = (SOURCE / "scripts/adapters/first_path_tracer.py").read_text()

    def verify(self, *changes):
        text = self.SOURCE
        for before, after in changes:
            self.assertEqual(text.count(before), 1, before)
            text = text.replace(before, after)
        tracer = self.write(text, "tracer.py")
        return tandem("verify", self.write(GARDEN, "garden.json"), "--time", 60, "--samples", 256, "--margin", "2%", "--tile-margin", "20%",
                      "--candidate", f"exec:/usr/bin/python3 {tracer} {{scene}} {{width}} {{height}} {{samples}} {{seed}} {{out:npy}}")

    def test_it_agrees(self):
        result = self.verify()
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_its_bugs_are_found_and_blamed(self):
        bugs = {
            "cosine dropped": ([("r, phi = np.sqrt(u), ", "r, phi = np.sqrt(1 - u * u), "), ("+ np.sqrt(1 - u)[:, None] * n)", "+ u[:, None] * n)")],
                               "differs"),
            "half a pixel aside": ([("reshape(2, -1) + random", "reshape(2, -1) + [[0], [0.5]] + random")], "about half a pixel"),
            "gamma": ([("np.save(out, np.concatenate([mean, np.maximum(variance, 0)], axis=2))", "np.save(out, mean ** (1 / 2.2))")],
                      "it looks like a gamma"),
            "three bounces too few": ([('.get("bounces", 12)', '.get("bounces", 12) - 3')], "differs")}
        for name, (changes, blame) in bugs.items():
            with self.subTest(bug=name):
                result = self.verify(*changes)
                self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
                self.assertIn(blame, result.stdout)
                self.assertIn("the oracle sides with CPU: tracer.py is off by ", result.stdout)

    def test_it_says_what_it_refuses(self):
        for scene, mention in [("glass", "refuses 'lens_radius' in the camera"), ("textures", "refuses 'textures' in the scene"),
                               ("nested-glass", "first_path_tracer refuses ")]:
            result = tandem("verify", SCENES / f"{scene}.json", "--size", 16, "--time", 5, "--candidate",
                            f"exec:{SOURCE}/scripts/adapters/first_path_tracer.py {{scene}} {{width}} {{height}} {{samples}} {{seed}} {{out:npy}}")
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn(mention, result.stdout)


class Page(unittest.TestCase):
    """What common/external/README.md tells a reader to type, with the statuses that it promises."""
    def test_every_command_of_the_page_runs(self):
        page = (SOURCE / "common/external/README.md").read_text()
        blocks = re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S)
        text = "".join(blocks).replace("\\\n", " ")
        self.assertGreaterEqual(text.count("tandem verify"), 6)
        # A line's own status is looked at: a verdict is agree unless its comment says otherwise.
        lines = []
        for line in text.splitlines():
            if line.startswith("tandem verify"):
                command, _, comment = line.partition("    # ")
                needed = re.findall(r"needs (\w+)", comment)
                skip = any(not os.environ.get(name.upper()) and not shutil.which(name) for name in needed)
                expected = 1 if comment == "disagree" else 0
                line = "true" if skip else f"status=0; {command} || status=$?; [ $status = {expected} ] || exit 1$status"
                if skip:
                    print(f"skipped: there is no {needed[0]}")
            lines.append(line)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("scenes", "scripts"):
                os.symlink(SOURCE / name, pathlib.Path(folder) / name)
            (pathlib.Path(folder) / "build" / "release").mkdir(parents=True)
            os.symlink(os.path.abspath(TANDEM), pathlib.Path(folder) / "build" / "release" / "tandem")
            result = subprocess.run(["bash", "-ec", "\n".join(lines)], cwd=folder, capture_output=True, text=True, timeout=500)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("a constant exposure factor of 1.0", result.stdout)
        self.assertIn("first_path_tracer.py agree within", result.stdout)
        self.assertIn("from Python: agree ", result.stdout)


if __name__ == "__main__":
    unittest.main()
