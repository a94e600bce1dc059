# Engines for farms: GNU parallel, and a Slurm of one node that the test starts. A killed item is done again, alone, and the
# results are those of one run. Skipped, visibly, where the engine is not installed.
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

from program import SCENES, TANDEM, ProgramTest, tandem

from test_commands_parts import pixels

SCRIPTS = pathlib.Path(os.environ["SCRIPTS"])
BOX = SCENES / "cornell-classic.json"


def running(words):
    """Processes of this program whose arguments are these."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                arguments = (entry / "cmdline").read_bytes().split(b"\0")[:-1]
            except OSError:
                continue
            if arguments[:1] and os.path.basename(arguments[0]) == b"tandem" and arguments[1:] == [os.fsencode(str(word)) for word in words]:
                found.append(int(entry.name))
    return found


class FarmTest(ProgramTest):
    def plan(self, *words, name="plan.jsonl"):
        result = tandem("plan", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        path = self.folder / name
        path.write_text(result.stdout)
        return path

    def plan_image(self, samples=1024, size=64, pieces=6):
        self.how = ("--samples", samples, "--size", size)
        return self.plan("render", BOX, *self.how, "--pieces", pieces)

    def assert_image(self, plan):
        merged, whole = self.folder / "merged.exr", self.folder / "whole.exr"
        result = tandem("merge-results", plan, "-o", merged)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(tandem("render", BOX, "-o", whole, *self.how).returncode, 0)
        self.assertEqual(pixels(merged), pixels(whole))


class Items(FarmTest):
    def test_verdicts_of_items_are_those_of_one_run(self):
        scenes = [SCENES / "furnace.json", SCENES / "lamps.json"]
        how = ("--samples", "256", "--size", "16", "--oracle", "none", "--no-layer")
        plan = self.plan("verify", *scenes, *how)
        for item in (1, 2):
            self.assertEqual(tandem("work", plan, item).returncode, 0)
        merged = tandem("merge-results", plan, "--json", self.folder / "merged.json")
        whole = tandem("verify", *scenes, *how, "--json", self.folder / "whole.json")
        self.assertEqual(merged.returncode, whole.returncode)
        a, b = (json.loads((self.folder / name).read_text()) for name in ("merged.json", "whole.json"))
        self.assertEqual(a["verdict"], b["verdict"])
        for one, other in zip(a["scenes"], b["scenes"], strict=True):
            self.assertEqual(one["levels"], other["levels"])  # thresholds and p of the same bits
            self.assertEqual(one["sentence"], other["sentence"])

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
        self.refused(tandem("plan", "verify", self.folder / "none.json"), "none.json")

    def test_an_item_that_fails_or_hangs_has_no_result(self):
        plan = self.plan("render", BOX, "--samples", "64", "--device", "none of that name", "--backend", "vulkan")
        failed = tandem("work", plan, 1)
        self.assertEqual(failed.returncode, 4)
        self.assertIn("no Vulkan device matches", failed.stderr)
        plan = self.plan("render", BOX, "--samples", 1 << 20, "--pieces", "1")
        begun = time.monotonic()
        self.refused(tandem("work", plan, 1, "--limit", "1"), "--limit", status=3)
        self.assertLess(time.monotonic() - begun, 20)
        self.assertEqual(running(json.loads(plan.read_text())["command"]), [])


class Kills(FarmTest):
    """KILLS=200 for a long run; it prints how much work was done again."""

    def setUp(self):
        super().setUp()
        self.kills, self.random = int(os.environ.get("KILLS", "6")), random.Random(5)
        self.workers, self.lost, self.useful = {}, 0.0, 0.0  # processes and what they do; seconds of processor time

    def start(self, plan, item):
        # Now and then the disk is full: no file takes more than a few bytes.
        full = self.random.random() < 0.1
        limit = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))) if full else None
        process = subprocess.Popen([TANDEM, "work", plan, str(item), "--limit", "60"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   preexec_fn=limit)
        self.workers[process] = (item, time.monotonic())

    def disturb(self):
        """Kills up to half of the workers, or pauses one for a moment."""
        for process in self.random.sample(list(self.workers), self.random.randint(1, max(1, len(self.workers) // 2))):
            if self.random.random() < 0.2:
                process.send_signal(signal.SIGSTOP)
                time.sleep(0.1)
                process.send_signal(signal.SIGCONT)
            process.kill()
            self.kills -= 1

    def reap(self, result_of):
        for process, (item, begun) in list(self.workers.items()):
            if process.poll() is None:
                continue
            del self.workers[process]
            seconds = time.monotonic() - begun
            if process.returncode == 0:
                self.assertTrue(result_of(item).exists())
                self.useful += seconds
            else:
                self.lost += seconds

    def test_kills_pauses_and_full_disks_change_no_bit(self):
        pieces = max(8, self.kills)
        plan = self.plan_image(samples=64 * pieces, size=96, pieces=pieces)
        result_of = lambda item: plan.with_suffix(".results") / f"{item:04}.exr"
        begun = self.kills
        while True:
            lacking = [item for item in range(1, pieces + 1) if not result_of(item).exists()]
            if not lacking and not self.workers:
                break
            in_hand = {item for item, _ in self.workers.values()}
            for item in [item for item in lacking if item not in in_hand][:4 - len(self.workers)]:
                self.start(plan, item)
            time.sleep(self.random.uniform(0.0, 0.3))
            if self.kills > 0 and self.workers:
                self.disturb()
            self.reap(result_of)
        self.assert_image(plan)
        self.assertEqual([pid for pid in running(["work", plan, 1])], [])
        print(f"{begun} kills of items of {self.useful / pieces:.2f} s: {self.lost:.1f} s lost, {self.useful:.1f} s useful", file=sys.stderr)


class Parallel(FarmTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("parallel"):
            self.skipTest("GNU parallel is not installed")

    def test_a_killed_item_is_done_again_alone(self):
        plan, log = self.plan_image(), self.folder / "jobs.log"
        # The third item is killed once, in its midst.
        once = self.folder / "once"
        once.write_text(f"#!/bin/sh\nif [ $2 = 3 ] && mkdir '{self.folder}/was'; then '{TANDEM}' work $1 $2 & sleep 0.3; kill -9 $!; kill -9 $$; fi\n"
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
        plan = self.plan_image(samples=4096, pieces=4)
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
