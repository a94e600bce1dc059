# One image by many processes of mpirun: the same bits for any number, a lost rank costs what was not kept. Skipped, visibly,
# without OpenMPI.
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import unittest

from program import SCENES, TANDEM, THOROUGH, ProgramTest, tandem, until
from test_commands_parts import pixels
from test_farm import running

BOX = SCENES / "cornell-classic.json"
AS_ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none"]
HERE = pathlib.Path(TANDEM).parent


class Ranks(ProgramTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("mpirun") or not (HERE / "libtandem_mpi.so").exists():
            self.skipTest("OpenMPI is not installed, or Tandem was built without it")

    def start(self, *words):
        process = subprocess.Popen([*MPIRUN, *map(str, words)], env=os.environ | AS_ROOT, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, start_new_session=True)
        self.addCleanup(process.poll)
        return process

    def mpirun(self, *words):
        process = self.start(*words)
        out, errors = process.communicate(timeout=300)
        return subprocess.CompletedProcess(words, process.returncode, out, errors)

    def whole(self, *how):
        path = self.folder / "whole.exr"
        self.assertEqual(tandem("render", BOX, "-o", path, *how).returncode, 0)
        return pixels(path)

    def test_any_number_of_ranks_has_the_bits_of_one_process(self):
        how = ("--size", "32", "--samples", "1000")
        whole = self.whole(*how)
        for ranks in (2, 3, 7) if THOROUGH else (3,):
            with self.subTest(ranks=ranks):
                image = self.folder / f"{ranks}.exr"
                result = self.mpirun("-n", ranks, TANDEM, "render", BOX, "-o", image, *how)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(len(result.stdout.splitlines()), 1, result.stdout)  # rank 0 alone speaks
                self.assertEqual(pixels(image), whole)

    def test_after_a_lost_rank_the_same_command_goes_on(self):
        how = ("--size", "64", "--samples", 1 << 11)
        sums = self.folder / "sums.exr"
        # One thread a rank, so that no machine is done before the kill comes.
        words = ["render", BOX, "-o", self.folder / "image.exr", *how, "--resume", sums, "--keep-every", "0.1", "--threads", "1"]
        process = self.start("-n", "3", TANDEM, *words)
        until(lambda: sums.exists() or process.poll() is not None, "sums are kept")
        self.assertIsNone(process.poll(), "too fast to be killed")
        ranks = running(words)
        self.assertEqual(len(ranks), 3)
        os.kill(max(ranks), signal.SIGKILL)
        process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0)
        until(lambda: running(words) == [], "the other ranks end")
        again = self.mpirun("-n", "2", TANDEM, *words)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(pixels(self.folder / "image.exr"), self.whole(*how))

    def test_ranks_of_something_else_are_refused(self):
        out = self.folder / "image.exr"
        result = self.mpirun("-n", "1", TANDEM, "render", BOX, "-o", out, ":", "-n", "1", TANDEM, "render", BOX, "-o", out, "--seed", "4")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("rank 1 has another scene, other options or another version", result.stderr)
        result = self.mpirun("-n", "1", TANDEM, "render", BOX, "-o", out, ":", "-n", "1", TANDEM, "render", self.folder / "none.json", "-o", out)
        self.assertIn("rank 1: ", result.stderr)
        self.assertIn("none.json", result.stderr)
        for words in (["cost", BOX], ["bench"]):
            self.assertIn("mpirun shares out render, verify and stability", self.mpirun("-n", "2", TANDEM, *words).stderr)
        self.assertIn("--total-time", self.mpirun("-n", "2", TANDEM, "verify", BOX, "--total-time", "9s").stderr)
        self.assertFalse(out.exists())

    def test_verdicts_of_ranks_are_those_of_one_process(self):
        """Scenes go to whichever rank is free; one more than there are ranks."""
        scenes = [SCENES / f"{name}.json" for name in ("furnace", "lamps", "cornell-classic")]
        how = ("--samples", "256", "--size", "16", "--oracle", "none", "--no-layer")
        out = lambda which: ("--json", self.folder / f"{which}.json", "--junit", self.folder / f"{which}.xml", "--report", self.folder / which)
        whole = tandem("verify", *scenes, *how, *out("whole"))
        ranks = self.mpirun("-n", "2", TANDEM, "verify", *scenes, *how, *out("ranks"))
        self.assertEqual(ranks.returncode, whole.returncode, ranks.stderr)
        a, b = (json.loads((self.folder / f"{which}.json").read_text()) for which in ("ranks", "whole"))
        # How many other sizes are looked at is up to the time.
        of = lambda report: [(one["scene"], one["verdict"], [level for level in one["levels"] if not level["name"].endswith("other sizes")])
                             for one in report["scenes"]]
        self.assertEqual(of(a), of(b))
        self.assertEqual(ranks.stdout.count("Verdict: "), 1, ranks.stdout)  # rank 0 alone speaks
        names = [sorted(file.name for file in (self.folder / which).iterdir()) for which in ("ranks", "whole")]
        self.assertEqual(names[0], names[1])

    def test_a_scene_that_another_rank_has_otherwise_is_not_judged(self):
        """Each rank has a folder of its own, as machines have."""
        for folder, colour in (("a", 0.5), ("b", 0.6)):
            (self.folder / folder).mkdir()
            for name in ("one.json", "two.json"):
                (self.folder / folder / name).write_text(json.dumps(json.loads(self.scene.read_text()) | {"background": [colour] * 3}))
        words = (TANDEM, "verify", "one.json", "two.json", "--samples", "64", "--size", "8", "--no-layer", "--oracle", "none")
        result = self.mpirun("-n", "1", "--wdir", self.folder / "a", *words, ":", "-n", "1", "--wdir", self.folder / "b", *words)
        self.assertIn("another scene; give all machines the same files", result.stderr)
        self.assertNotEqual(result.returncode, 0)

    def test_a_stop_ends_all(self):
        sums = self.folder / "sums.exr"
        words = ["render", BOX, "-o", self.folder / "image.exr", "--size", "64", "--samples", 1 << 20, "--resume", sums, "--keep-every", "0.5"]
        process = self.start("-n", "2", TANDEM, *words)
        until(sums.exists, "sums are kept")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        until(lambda: running(words) == [], "all ranks end")
        self.assertEqual(tandem("merge", sums, "-o", self.folder / "kept.exr", "--allow-gaps").returncode, 0)


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)
