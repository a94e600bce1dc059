# Engines for farms: GNU parallel, and a Slurm of one node that the test starts. A killed item is done again, alone, and the
# results are those of one run. Skipped, visibly, where the engine is not installed.
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree

from program import SCENES, TANDEM, ProgramTest, Stopwatch, tandem, until

from test_commands_parts import pixels

SCRIPTS = pathlib.Path(os.environ["SCRIPTS"])
BOX = SCENES / "cornell-classic.json"


def samples_in(part):
    """Samples a pixel of a part, by its metadata."""
    told = subprocess.run(["oiiotool", "--info", "-v", part], capture_output=True, text=True).stdout
    ranges = re.search(r'tandem:part_ranges: "([^"]*)"', told)
    if not ranges:
        return 0
    return sum(int(end) - int(begin) for begin, end in re.findall(r"(\d+):(\d+)", ranges.group(1)))


def running(words, begin_alone=False):
    """Processes of this program whose arguments are these, or begin like that."""
    found, wanted = [], [os.fsencode(str(word)) for word in words]
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                arguments = (entry / "cmdline").read_bytes().split(b"\0")[:-1]
            except OSError:
                continue
            own = arguments[1:len(wanted) + 1] if begin_alone else arguments[1:]
            if arguments[:1] and os.path.basename(arguments[0]) in (b"tandem", b"exe") and own == wanted:
                found.append(int(entry.name))
    return found


class FarmTest(ProgramTest):
    def plan(self, *words, name="plan.jsonl"):
        result = tandem("plan", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        path = self.folder / name
        path.write_text(result.stdout)
        return path

    def plan_image(self, samples=1024, size=64, pieces=6, more=()):
        self.how = ("--samples", samples, "--size", size)
        return self.plan("render", BOX, *self.how, "--pieces", pieces, *more)

    def assert_image(self, plan):
        merged, whole = self.folder / "merged.exr", self.folder / "whole.exr"
        result = tandem("merge-results", plan, "-o", merged)
        self.assertEqual(result.returncode, 0, result.stderr)
        alone = subprocess.run([TANDEM, "render", BOX, "-o", whole, *map(str, self.how)], capture_output=True, timeout=3600)  # long after 200 kills
        self.assertEqual(alone.returncode, 0)
        self.assertEqual(pixels(merged), pixels(whole))


class Items(FarmTest):
    def test_verdicts_of_items_are_those_of_one_run(self):
        scenes = [SCENES / "furnace.json", SCENES / "lamps.json"]
        how = ("--samples", "256", "--size", "16", "--oracle", "none", "--no-layer")
        plan = self.plan("verify", *scenes, *how)
        for item in (1, 2):
            self.assertEqual(tandem("work", plan, item).returncode, 0)
        out = lambda which: ("--json", self.folder / f"{which}.json", "--junit", self.folder / f"{which}.xml", "--report", self.folder / which)
        merged = tandem("merge-results", plan, *out("merged"))
        whole = tandem("verify", *scenes, *how, *out("whole"))
        self.assertEqual(merged.returncode, whole.returncode, merged.stderr)
        a, b = (json.loads((self.folder / name).read_text()) for name in ("merged.json", "whole.json"))
        self.assertEqual(a["verdict"], b["verdict"])
        for one, other in zip(a["scenes"], b["scenes"], strict=True):
            self.assertEqual(one["levels"], other["levels"])  # thresholds and p of the same bits
            self.assertEqual(one["sentence"], other["sentence"])
        cases = [[(case.get("classname"), case.get("name"), [child.tag for child in case]) for case in
                  xml.etree.ElementTree.parse(self.folder / f"{which}.xml").iter("testcase")] for which in ("merged", "whole")]
        self.assertEqual(cases[0], cases[1])
        self.assertEqual(len(cases[0]), 2)
        # The report: the same pictures by the same names.
        files = {which: {file.name: file.read_bytes() for file in (self.folder / which).glob("*.png")} for which in ("merged", "whole")}
        self.assertEqual(len(files["whole"]), 10)
        self.assertEqual(files["merged"], files["whole"])
        a, b = (json.loads((self.folder / which / "report.json").read_text()) for which in ("merged", "whole"))
        self.assertEqual([scene["images"] for scene in a["scenes"]], [scene["images"] for scene in b["scenes"]])

    def test_an_image_is_merged_in_stages(self):
        plan = self.plan_image(samples=640, size=16, pieces=5)
        results = plan.with_suffix(".results")
        for item in (1, 2, 3, 5):
            self.assertEqual(tandem("work", plan, item).returncode, 0)
        self.refused(tandem("merge-results", plan, "--stage", "2/2"), "1 of 5 items have no result", ": 4;")
        self.assertEqual(tandem("merge-results", plan, "--stage", "1/2").returncode, 0)
        for item in (1, 2, 3):  # the stage holds them
            (results / f"{item:04}.exr").unlink()
        self.refused(tandem("merge-results", plan, "-o", self.folder / "no.exr"), "1 of 5 items have no result", ": 4;")
        self.assertEqual(tandem("work", plan, 4).returncode, 0)
        self.assert_image(plan)  # of a stage and two items
        self.assertEqual(tandem("merge-results", plan, "--stage", "2/2").returncode, 0)
        for item in (4, 5):
            (results / f"{item:04}.exr").unlink()
        self.assert_image(plan)  # of stages alone
        self.refused(tandem("merge-results", plan, "--stage", "3/2"), "'3/2'")
        self.refused(tandem("merge-results", plan, "--stage", "1/6"), "'1/6'")
        self.refused(tandem("merge-results", plan, "--stage", "1/2", "-o", "x.exr"), "leave -o")
        verdicts = self.plan("verify", SCENES / "furnace.json", "--samples", "64", name="verdicts.jsonl")
        self.refused(tandem("merge-results", verdicts, "--stage", "1/1"), "--stage: is for the parts of an image")

    def test_costs_of_items_are_those_of_each_scene(self):
        plan = self.plan("cost", SCENES / "furnace.json", SCENES / "lamps.json", "--knob", "integrator", "--size", "8", "--time", "2", "--no-cache")
        self.assertEqual(len(plan.read_text().splitlines()), 2)
        self.assertEqual(tandem("work", plan, 1).returncode, 0)
        part = tandem("merge-results", plan, "--allow-gaps", "--json", self.folder / "part.json")
        self.assertEqual(part.returncode, 3, part.stderr)
        report = json.loads((self.folder / "part.json").read_text())
        self.assertEqual([os.path.basename(scene) for scene in report["not_run"]], ["lamps.json"])
        self.assertEqual(report["scenes"][0]["arms"][0]["knob"], "baseline")
        self.assertIn("furnace on ", part.stdout)
        alone = self.plan("cost", SCENES / "furnace.json", "--knob", "integrator", "--size", "8", "--time", "2", "--no-cache", name="one.jsonl")
        self.assertEqual(tandem("work", alone, 1).returncode, 0)
        self.assertIn(tandem("merge-results", alone, "--json", self.folder / "one.json").returncode, (0, 3))
        # What tandem cost itself writes.
        self.assertLess({"arms", "recommendations", "confirmations", "reference", "command"}, set(json.loads((self.folder / "one.json").read_text())))
        self.refused(tandem("plan", "cost", SCENES / "furnace.json", "--list"), "--list")
        self.refused(tandem("merge-results", alone, "--junit", self.folder / "x.xml"), "--junit: is for verdicts")

    def test_families_of_items_are_one_bench(self):
        plan = self.plan("bench", "--family", "memory,recording", "--size", "32x32", "--time", "60", "--narrow", "1", "--replicates", "1")
        items = [json.loads(line)["command"] for line in plan.read_text().splitlines()]
        self.assertEqual([(words[2], words[4]) for words in items], [("memory", "30.00"), ("recording", "30.00")])
        for item in (1, 2):
            done = tandem("work", plan, item)
            self.assertEqual(done.returncode, 0, done.stderr)
        merged = tandem("merge-results", plan, "--json", self.folder / "all.json")
        self.assertIn(merged.returncode, (0, 3), merged.stderr)
        report = json.loads((self.folder / "all.json").read_text())
        self.assertEqual({arm["family"] for arm in report["arms"]}, {"memory", "recording"})
        self.assertGreater(len(report["claims"]), 20)  # all of them, as of one run
        # The readings are those of the items, so that bench goes on from the merged file.
        own = [json.loads((plan.with_suffix(".results") / f"{item:04}.json").read_text())["report"]["raw"] for item in (1, 2)]
        self.assertEqual(report["raw"], own[0] + own[1])
        self.refused(tandem("plan", "bench", "--family", "memry"), "'memry'", "memory")

    def test_a_lost_item_of_an_image_goes_on_from_its_sums(self):
        # One thread, so that no machine is done before the kill comes.
        plan = self.plan("render", BOX, "--samples", 1 << 11, "--size", "48", "--pieces", "1", "--keep-every", "0.05", "--threads", "1")
        sums, result = (plan.with_suffix(".results") / name for name in ("0001.sums.exr", "0001.exr"))
        process = subprocess.Popen([TANDEM, "work", plan, "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until(sums.exists, "sums are kept")
        process.kill()
        process.wait()
        self.assertFalse(result.exists(), "too fast to be killed")
        kept = sums.read_bytes()
        begun = samples_in(sums)
        self.assertGreater(begun, 0)
        again = tandem("work", plan, 1)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertNotEqual(result.read_bytes(), kept)
        self.assertFalse(sums.exists())
        self.how = ("--samples", 1 << 11, "--size", 48)
        self.assert_image(plan)

    def test_cases_of_items_are_those_of_one_run(self):
        plan = self.plan("stability", "--case", "2,8-1e6", "--backend", "cpu", "--precision", "single", "--time", "20")
        for item in (1, 2):
            self.assertEqual(tandem("work", plan, item).returncode, 0)
        merged = tandem("merge-results", plan, "--json", self.folder / "merged.json")
        self.assertEqual(merged.returncode, 0, merged.stderr)
        report = json.loads((self.folder / "merged.json").read_text())
        self.assertEqual({case["id"] for case in report["cases"]}, {"2", "8-1e6"})
        self.assertEqual(report["verdict"], "pass")

    def test_what_is_lacking_or_of_another_plan_is_refused(self):
        plan = self.plan("verify", SCENES / "furnace.json", SCENES / "lamps.json", "--samples", "64", "--size", "8", "--no-layer")
        self.assertEqual(tandem("work", plan, 1).returncode, 0)
        self.refused(tandem("merge-results", plan), "1 of 2 items have no result", ": 2;")
        self.refused(tandem("work", plan, 3), "has 2 items and no item 3")
        part = tandem("merge-results", plan, "--allow-gaps", "--json", self.folder / "out.json")
        self.assertEqual(part.returncode, 3, part.stderr)
        self.assertEqual(len(json.loads((self.folder / "out.json").read_text())["not_run"]), 1)
        other = self.plan("verify", SCENES / "furnace.json", "--samples", "128", "--size", "8", "--no-layer", name="plan2.jsonl")
        results = ("--results", plan.with_suffix(".results"))
        self.refused(tandem("merge-results", other, *results), "is a result of another plan")
        self.refused(tandem("work", other, 1, *results), "is a result of another plan")
        self.refused(tandem("work", self.scene, 1), "scene.json", "is no item")
        self.refused(tandem("plan", "render", BOX, "-o", "x.exr"), "--output")
        for words in (["--aov", "albedo"], ["--every", "2x"], ["--sampling", "adaptive"], ["--accumulation", "plain"]):
            self.refused(tandem("plan", "render", BOX, *words), words[0])
        self.refused(tandem("work", plan, 1, "--json", plan), "which is read")
        self.refused(tandem("work", other, 1, "--json", SCENES / "furnace.json"), "which is read")
        self.refused(tandem("merge-results", plan, "--allow-gaps", "--json", plan), "which is read")
        self.refused(tandem("plan", "verify", self.folder / "none.json"), "none.json")

    def test_every_preset_is_planned_as_items_that_can_be_done(self):
        for preset in ("smoke", "driver", "full"):
            plan = self.plan("verify", "--preset", preset)
            words = json.loads(plan.read_text().splitlines()[0])["command"]
            self.assertNotIn("", words, preset)
            self.assertEqual("--size" in words, preset != "full")
        plan.write_text(plan.read_text().splitlines()[0] + "\n")  # alone, and its time is two hours' share
        self.assertNotIn("--size", tandem("work", plan, 1, "--limit", "1").stderr)

    def test_cases_that_were_not_all_run_are_undecided(self):
        plan = self.plan("stability", "--case", "2,8-1e6", "--backend", "cpu", "--time", "0.001")
        for item in (1, 2):
            self.assertEqual(tandem("work", plan, item).returncode, 0)
        merged = tandem("merge-results", plan, "--json", self.folder / "merged.json")
        self.assertEqual(merged.returncode, 3, merged.stdout + merged.stderr)
        report = json.loads((self.folder / "merged.json").read_text())
        self.assertEqual((report["verdict"], report["complete"]), ("undecided", False))

    def test_what_an_earlier_attempt_left_is_no_result(self):
        plan = self.plan("cost", BOX, "--size", "64", "--time", "0.01")
        left = plan.with_suffix(".results") / "0001.unchecked.json"
        left.parent.mkdir()
        left.write_text('{"arms": []}')  # as one has that was killed
        again = tandem("work", plan, 1)
        self.assertEqual(again.returncode, 3, again.stderr)
        self.assertIn("has no result", again.stderr)

    def test_an_item_that_its_own_time_ends_has_a_result(self):
        plan = self.plan("verify", BOX, "--size", "256", "--time", "1", "--no-layer")
        done = tandem("work", plan, 1)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_an_item_that_fails_or_hangs_has_no_result(self):
        plan = self.plan("render", BOX, "--samples", "64", "--device", "none of that name", "--backend", "vulkan")
        failed = tandem("work", plan, 1)
        self.assertEqual(failed.returncode, 4)
        self.assertIn("no Vulkan device matches", failed.stderr)
        plan = self.plan("render", BOX, "--samples", 1 << 20, "--pieces", "1")
        with Stopwatch() as watch:
            self.refused(tandem("work", plan, 1, "--limit", "1"), "--limit", status=3)
        self.assertLess(watch.seconds, 20)
        self.assertEqual(running(json.loads(plan.read_text())["command"], begin_alone=True), [])


    def test_an_item_that_is_paused_ends_at_its_limit(self):
        plan = self.plan("render", BOX, "--samples", 1 << 20, "--pieces", "1")
        process = subprocess.Popen([TANDEM, "work", plan, "1", "--limit", "5"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        words = json.loads(plan.read_text())["command"]
        until(lambda: running(words, begin_alone=True), "the item runs")
        for pid in running(words, begin_alone=True):
            os.kill(pid, signal.SIGSTOP)
        _, errors = process.communicate(timeout=40)
        self.assertEqual(process.returncode, 3)
        self.assertIn("--limit", errors)
        self.assertEqual(running(words, begin_alone=True), [])


class Kills(FarmTest):
    """KILLS=100, and a SEED, for a long run of three minutes on any machine, with so many kills at most. It prints which part of the samples was
    begun again, counted from what every worker logs, and asserts that this is a twentieth at most."""

    def setUp(self):
        super().setUp()
        self.kills, self.random = int(os.environ.get("KILLS", "6")), random.Random(int(os.environ.get("SEED", "5")))
        self.long = self.kills > 20
        self.most = 16 if self.long else 4  # workers at once
        self.workers, self.ended = {}, []  # processes with item and begin; of each that ended: samples, seconds to the first, seconds

    def start(self, plan, item):
        # Now and then the disk is full: no file takes more than a few bytes.
        full = self.random.random() < (0.02 if self.long else 0.1)
        limit = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))) if full else None
        self.log_of(plan, item).unlink(missing_ok=True)
        process = subprocess.Popen([TANDEM, "work", plan, str(item), "--limit", "600"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   preexec_fn=limit)
        self.workers[process] = (item, time.time())

    def disturb(self):
        """Kills up to half of the workers, or pauses one for a moment."""
        for process in self.random.sample(list(self.workers), self.random.randint(1, max(1, len(self.workers) // 2))):
            if self.random.random() < 0.2:
                process.send_signal(signal.SIGSTOP)
                time.sleep(0.1)
                process.send_signal(signal.SIGCONT)
            process.kill()
            self.kills -= 1

    def log_of(self, plan, item):
        return plan.with_suffix(".results") / f"{item:04}.log"

    def reap(self, plan):
        for process, (item, begun) in list(self.workers.items()):
            if process.poll() is None:
                continue
            del self.workers[process]
            if process.returncode == 0:
                self.assertTrue((plan.with_suffix(".results") / f"{item:04}.exr").exists())
            log, seconds = self.log_of(plan, item), time.time() - begun
            steps = re.findall(r"^samples (\d+):(\d+) begun, ([0-9.]+) s after", log.read_text(), re.M) if log.exists() else []
            self.ended.append((sum(int(b) - int(a) for a, b, _ in steps), float(steps[0][2]) if steps else seconds, seconds))

    def plan_work(self):
        if not self.long:
            pieces = max(8, self.kills)
            return pieces, 0.3, self.plan_image(samples=64 * pieces, size=96, pieces=pieces, more=("-v",))
        # Each of 16 workers is killed every 14 seconds. A block of the image, which cannot be kept in parts, is a small part of that.
        pieces, seconds = 40, 0.75 * self.kills
        begun = time.monotonic()
        self.assertEqual(tandem("render", BOX, "-o", self.folder / "speed.exr", "--size", "16", "--samples", "32768").returncode, 0)
        samples = round(32768 * seconds / (time.monotonic() - begun) / (64 * pieces)) * 64 * pieces
        self.how = ("--samples", samples, "--size", "16")
        return pieces, 8.0, self.plan("render", BOX, *self.how, "--pieces", pieces, "--threads", "1", "-v")

    def test_kills_pauses_and_full_disks_change_no_bit(self):
        pieces, spacing, plan = self.plan_work()
        results = plan.with_suffix(".results")
        kills, end = self.kills, time.monotonic() + 60 + 6 * self.kills
        while True:
            self.assertLess(time.monotonic(), end, "a worker hangs")
            lacking = [item for item in range(1, pieces + 1) if not (results / f"{item:04}.exr").exists()]
            if not lacking and not self.workers:
                break
            in_hand = {item for item, _ in self.workers.values()}
            for item in [item for item in lacking if item not in in_hand][:self.most - len(self.workers)]:
                self.start(plan, item)
            time.sleep(self.random.uniform(0.0, spacing if self.kills > 0 else 0.3))
            if self.kills > 0 and self.workers:
                self.disturb()
            self.reap(plan)
        self.assert_image(plan)
        self.assertEqual(running(["work", plan, 1]), [])
        samples, starts, seconds = (sum(column) for column in zip(*self.ended))
        needed = self.how[1]
        print(f"{kills - self.kills} kills: {samples - needed} of {needed} samples a pixel were begun again, {100 * (samples / needed - 1):.1f} %; "
              f"{len(self.ended)} starts took {starts:.1f} s of {seconds:.1f} s of workers", file=sys.stderr)
        self.assertGreaterEqual(samples, needed)  # else a log is missing
        if self.long:
            self.assertLessEqual(samples, 1.05 * needed)


class Parallel(FarmTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("parallel"):
            self.skipTest("GNU parallel is not installed")

    def test_a_killed_item_is_done_again_alone(self):
        plan, log = self.plan_image(), self.folder / "jobs.log"
        # The third item is killed once, before any machine could end it.
        once = self.folder / "once"
        once.write_text(f"#!/bin/sh\nif [ $2 = 3 ] && mkdir '{self.folder}/was'; then '{TANDEM}' work $1 $2 & kill -STOP $!; kill -9 $!; kill -9 $$; fi\n"
                        f"exec '{TANDEM}' work $1 $2\n")
        once.chmod(0o755)
        command = ["parallel", "--will-cite", "-j2", "--joblog", log, "--resume-failed", once, plan, ":::", *map(str, range(1, 7))]
        first = subprocess.run(command, capture_output=True, text=True, timeout=120)
        self.assertNotEqual(first.returncode, 0)
        self.refused(tandem("merge-results", plan, "-o", self.folder / "no.exr"), "1 of 6 items have no result", ": 3;")
        again = subprocess.run(command, capture_output=True, text=True, timeout=120)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(len(again.stdout.splitlines()), 1, again.stdout)  # that item alone
        self.assert_image(plan)


class Slurm(FarmTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("slurmctld") or not shutil.which("slurmd") or not shutil.which("sbatch") or os.geteuid() != 0:
            self.skipTest("slurm-wlm is not installed, or this is not root")
        host, ports = socket.gethostname(), []
        for _ in range(2):
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", 0))
                ports.append(probe.getsockname()[1])
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "slurm.conf").write_text(f"""ClusterName=tandem
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/none
CredType=cred/none
SlurmUser=root
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/ctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
""")
        self.environment = os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf"), "TANDEM": TANDEM}
        for daemon in ("slurmctld", "slurmd"):
            log = open(self.folder / f"{daemon}.log", "w")
            process = subprocess.Popen([daemon, "-D"], env=self.environment, stdout=log, stderr=log)
            self.addCleanup(log.close)
            self.addCleanup(process.wait)
            self.addCleanup(process.send_signal, signal.SIGINT if daemon == "slurmctld" else signal.SIGTERM)
        self.until(lambda: "idle" in self.slurm("sinfo", "--noheader", check=False), "the node is idle")

    def slurm(self, *words, check=True):
        result = subprocess.run(words, env=self.environment, capture_output=True, text=True, timeout=60)
        if check:
            self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def until(self, condition, what):
        end = time.monotonic() + 90
        while not condition():
            self.assertLess(time.monotonic(), end, f"waited for: {what}")
            time.sleep(0.2)

    def test_a_job_array_requeues_a_killed_item(self):
        # One thread, so that no machine is done before the kill comes.
        plan = self.plan_image(samples=1 << 14, pieces=4, more=("--threads", "1"))
        job = self.slurm("sbatch", "--parsable", "--array=1-4", f"--output={self.folder}/log-%a", SCRIPTS / "slurm/job_array", plan).strip()
        self.until(lambda: running(["work", plan, 2]), "the second item runs")
        os.kill(running(["work", plan, 2])[0], signal.SIGKILL)
        # A requeued job waits two minutes, unless told otherwise.
        self.until(lambda: "Requeued" in self.slurm("scontrol", "show", "job", f"{job}_2") or "Restarts=1" in self.slurm("scontrol", "show", "job", f"{job}_2"),
                   "the second item is requeued")
        self.slurm("scontrol", "update", f"jobid={job}_2", "starttime=now", check=False)
        self.until(lambda: not self.slurm("squeue", "--noheader").strip(), "all items are done")
        self.assert_image(plan)
        self.assertIn("Killed", (self.folder / "log-2").read_text())


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)
