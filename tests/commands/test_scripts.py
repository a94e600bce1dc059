# The scripts that keep what other programs measured: one clear line and exit status 2 for what is no result, parts that
# join. Run by ctest with SCRIPTS = scripts/.
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(os.environ["SCRIPTS"])
LEVEL = "paired pixels in tiles 16x16"


def experiment(first, runs, alarms, **changes):
    """A line as `calibrate run` prints it."""
    return {"id": "cpu-vulkan-classic-paired", "name": "cornell-classic, paired", "pair": "CPU/Vulkan", "looks": 3, "samples": 512,
            "width": 12, "height": 12, "paired": True, "declared": 0.05, "first": first, "runs": runs, "alarms": alarms,
            "seconds": 1.0, "reference_device": "a CPU", "candidate_device": "a GPU", "identical_fraction": 0.5,
            "levels": {LEVEL: {"runs": runs, "alarms": alarms}}} | changes


def bug(name, caught, amount=0.0, unbiased=False):
    """A line as `mutants run` prints it."""
    trial = {"scene": "glass", "effort": 2, "caught": caught, "level": "image" if caught else "", "samples": 256, "seconds": 1.0}
    return {"id": name, "bug": name.split("-")[0], "amount": amount, "planting": "cpu", "unbiased": unbiased, "caught": caught,
            "trials": [trial]}


class Scripts(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def take(self, script, *contents):
        """`script --take` of files with these contents, strings or lists of lines of JSON."""
        files = []
        for number, content in enumerate(contents):
            files.append(self.folder / f"taken-{number}.json")
            files[-1].write_text(content if isinstance(content, str) else "\n".join(map(json.dumps, content)))
        return subprocess.run([sys.executable, SCRIPTS / "measure" / script, "--take", *files, "--name", "here", "--device", "a machine",
                               "-o", self.folder], capture_output=True, text=True, timeout=60)

    def refused(self, result, mention):
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        self.assertIn(mention, result.stderr)

    def test_what_is_no_result_of_mutants_is_one_line(self):
        self.refused(self.take("mutants", ""), "taken-0.json: is no JSON that `mutants` wrote")
        self.refused(self.take("mutants", "{"), "taken-0.json: is no JSON that `mutants` wrote")
        self.refused(self.take("mutants", "[1]"), "taken-0.json: holds no outcome")
        self.refused(self.take("mutants", '{"id": "cosine-dropped"}'), "taken-0.json: holds no outcome")

    def test_the_version_is_a_commit_whatever_tags_it(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        output = folder / "version.cpp"
        git = ["git", "-C", folder, "-c", "user.name=Tester", "-c", "user.email=tester@example.org"]
        for command in (["init", "--quiet"], ["commit", "--quiet", "--allow-empty", "-m", "A change"],
                        ["tag", "--annotate", "v1.0", "-m", "A release"]):
            subprocess.run([*git, *command], check=True)
        commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
        script = SCRIPTS.parent / "common/commands/git_version.cmake"
        subprocess.run(["cmake", f"-Dsource={folder}", f"-Doutput={output}", "-P", script], check=True)
        self.assertIn(f'return "{commit[:12]}";', output.read_text())

    def test_growth_of_one_number_of_triangles_is_refused(self):
        row = {"backend": "cpu", "device": "a CPU", "driver": "its driver", "clock": "wall", "triangles": 12, "milliseconds": 1.0,
               "milliseconds_low": 0.9, "milliseconds_high": 1.1}
        taken = self.folder / "taken.json"
        taken.write_text(json.dumps({"size": 8, "bounces": 2, "rounds": 3, "rows": [row]}))
        stored = SCRIPTS.parent / "tests/records/growth/test-of-refusal.json"
        self.addCleanup(stored.unlink, missing_ok=True)
        result = subprocess.run([sys.executable, SCRIPTS / "measure/growth", "--take", taken, stored.stem], capture_output=True,
                                text=True, timeout=60)
        self.refused(result, "cpu has one number of triangles")
        self.assertFalse(stored.exists())

    def test_an_interrupt_ends_a_pool_of_threads(self):
        program = """if True:
            import sys, time
            sys.path.insert(0, sys.argv[1])
            from thread_pool import thread_pool
            with thread_pool(1) as pool:
                for i in range(50):
                    pool.submit(lambda i=i: (print(i, flush=True), time.sleep(0.1)))
                raise KeyboardInterrupt
            """
        result = subprocess.run([sys.executable, "-c", program, SCRIPTS / "make"], capture_output=True, text=True, timeout=60)
        self.assertIn("KeyboardInterrupt", result.stderr)
        self.assertLessEqual(len(result.stdout.split()), 2)

    def test_what_is_no_result_of_calibrate_is_one_line(self):
        self.refused(self.take("calibrate", ""), "taken-0.json: holds no experiment")
        self.refused(self.take("calibrate", "{"), "taken-0.json, line 1: is no JSON")
        self.refused(self.take("calibrate", "[]\n3"), "taken-0.json")

    def test_what_is_no_result_of_growth_is_one_line(self):
        file = self.folder / "taken.json"

        def take(content, name="here"):
            file.write_text(content)
            return subprocess.run([sys.executable, SCRIPTS / "measure/growth", "--take", file, name], capture_output=True, text=True,
                                  timeout=60)

        for content in ["", "{", "[1]", '{"size": 1, "bounces": 4, "rounds": 2, "rows": []}',
                        '{"size": 1, "bounces": 4, "rounds": 2, "rows": [1]}']:
            self.refused(take(content), "taken.json")
        for name in ["--foo", "a/b", ""]:
            self.refused(take("{}", name), "no name of a machine")
        self.assertFalse((SCRIPTS.parent / "tests/records/growth/here.json").exists())
        file.unlink()
        self.refused(subprocess.run([sys.executable, SCRIPTS / "measure/growth", "--take", file, "here"], capture_output=True,
                                    text=True, timeout=60), "taken.json")

    def test_parts_of_an_experiment_join_and_gaps_do_not(self):
        result = self.take("calibrate", [experiment(0, 600, 3)], [experiment(600, 400, 2, identical_fraction=1.0)])
        self.assertEqual(result.returncode, 0, result.stderr)
        kept = json.loads((self.folder / "calibration_here.json").read_text())
        self.assertEqual([(line["first"], line["runs"], line["alarms"], line["levels"][LEVEL]) for line in kept],
                         [(0, 1000, 5, {"runs": 1000, "alarms": 5})])
        self.assertAlmostEqual(kept[0]["identical_fraction"], 0.7)
        page = (self.folder / "CALIBRATION.md").read_text()
        # Clopper and Pearson's interval of 5 in 1000 at 95 %, as tables have it.
        self.assertIn(f"| {LEVEL} |  |  |  | 5 of 1000: 0.50 % (0.16 … 1.16 %) |", page)
        self.assertIn("5 of 1,000 verdicts on one machine are false alarms; 5 % of each experiment's may be.", page)
        self.assertIn("No rate is significantly above what was declared.", page)
        self.refused(self.take("calibrate", [experiment(1500, 100, 0)]), "do not follow")

    def program(self, text):
        """A program that stands for `calibrate` or `mutants`."""
        file = self.folder / "program"
        file.write_text(f"#!{sys.executable}\nimport json, sys\n{text}")
        file.chmod(0o755)
        return file

    def measure(self, script, *arguments):
        return subprocess.run([sys.executable, SCRIPTS / "measure" / script, *map(str, arguments)], capture_output=True, text=True, timeout=60)

    def test_shares_of_experiments_add_up_to_the_whole(self):
        """A verdict is an alarm where its number is a multiple of 40, so that the count tells which verdicts were made."""
        program = self.program(f"""
if sys.argv[1] == "list":
    print("cpu-vulkan-classic-paired")
else:
    first, runs = int(sys.argv[4]), int(sys.argv[6])
    alarms = sum(number % 40 == 0 for number in range(first, first + runs))
    print(json.dumps({experiment(0, 0, 0)!r} | {{"first": first, "runs": runs, "alarms": alarms, "levels": {{{LEVEL!r}: {{"runs": runs, "alarms": alarms}}}}}}))
""")
        records = []
        for item in (3, 1, 2):
            share = self.measure("calibrate", "--program", program, "--runs", 100, "--items", f"{item}/3", "-o", self.folder / str(item))
            self.assertEqual(share.returncode, 0, share.stderr)
            records.append(self.folder / str(item) / "calibration.json")
        self.assertEqual([json.loads(record.read_text())[0]["runs"] for record in records], [34, 33, 33])
        merged = self.measure("calibrate", "--merge", *records, "-o", self.folder / "merged")
        self.assertEqual(merged.returncode, 0, merged.stderr)
        self.assertEqual(self.measure("calibrate", "--program", program, "--runs", 100, "-o", self.folder / "whole").returncode, 0)
        one, other = (json.loads((self.folder / name / "calibration.json").read_text())[0] for name in ("merged", "whole"))
        for key in ("first", "runs", "alarms", "levels"):
            self.assertEqual(one[key], other[key])
        self.assertEqual(one["alarms"], 3)
        gap = self.measure("calibrate", "--merge", records[0], records[1], "-o", self.folder / "gap")
        self.refused(gap, "do not follow")
        self.assertIn("'4/3' is no share", self.measure("calibrate", "--items", "4/3").stderr)

    def test_shares_of_planted_bugs_are_the_whole(self):
        bugs = [f"bug-{i}" for i in range(5)]
        program = self.program(f"""
if sys.argv[1] == "list":
    print("\\n".join(f"{{bug}} cpu" for bug in {bugs!r}))
elif sys.argv[1] == "run":
    print(json.dumps({bug("bug", True)!r} | {{"id": sys.argv[2]}}))
""")
        records = []
        for item in (1, 2):
            share = self.measure("mutants", "--program", program, "--no-sound", "--items", f"{item}/2", "-o", self.folder / str(item))
            self.assertEqual(share.returncode, 0, share.stderr)
            records.append(self.folder / str(item) / "mutants.json")
        self.assertEqual([[line["id"] for line in json.loads(record.read_text())] for record in records], [bugs[::2], bugs[1::2]])
        merged = self.measure("mutants", "--program", program, "--merge", *records, "-o", self.folder / "merged")
        self.assertEqual(merged.returncode, 0, merged.stderr)
        self.assertEqual([line["id"] for line in json.loads((self.folder / "merged/mutants.json").read_text())], bugs)
        twice = self.measure("mutants", "--program", program, "--merge", records[0], records[0], "-o", self.folder / "twice")
        self.refused(twice, "bug-0 cpu is in ")

    def test_more_alarms_than_declared_fail(self):
        result = self.take("calibrate", [experiment(0, 1000, 90)])
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("more alarms than declared", result.stderr)
        self.assertIn("is a fault: cpu-vulkan-classic-paired: 90 of 1000", (self.folder / "CALIBRATION.md").read_text())

    def mutants(self, *arguments):
        return subprocess.run([sys.executable, SCRIPTS / "measure/mutants", *arguments, "-o", self.folder], capture_output=True,
                              text=True, timeout=60)

    def store_bugs(self, *lines):
        (self.folder / "mutants.json").write_text(json.dumps(list(lines)))
        (self.folder / "catalogue.json").write_text(json.dumps({"plantings": 3, "not_in_both": ["b: one reason", "c: one reason"]}))

    def test_the_page_of_planted_bugs_is_what_the_records_say(self):
        self.store_bugs(bug("a-0.1", True, 0.1), bug("a-0.01", False, 0.01))
        self.assertEqual(self.mutants("--check").returncode, 1)
        self.assertEqual(self.mutants("--write").returncode, 0)
        self.assertEqual(self.mutants("--check").returncode, 0)
        page = (self.folder / "MUTANTS.md").read_text()
        self.assertIn("One planted bug that biases the image escapes on some machine: a-0.01.", page)
        self.assertIn("| that bias the image | 1 of 2 (9.5 … 90.5 %) |", page)  # Wilson's interval, as tables have it
        self.assertIn("| not run yet | 1 of 3 |", page)
        self.assertIn("| a-0.01 | cpu | 2 CPU cores, Vulkan by lavapipe | glass | 2 | **too small** for these scenes: amount 0.01 |",
                      page)
        self.assertIn("| a | 0.1 |  |  |", page)
        self.assertIn("- one reason: b, c.", page)
        self.store_bugs(bug("a-0.1", True, 0.1), bug("a-0.01", True, 0.01))
        result = self.mutants("--check")
        self.assertEqual(result.returncode, 1)
        self.assertIn("is not what the stored records say", result.stderr)

    def test_unbiased_bugs_and_gaps_are_told_apart(self):
        self.store_bugs(bug("a", False, unbiased=True), bug("b", False), bug("c", True))
        self.assertEqual(self.mutants("--write").returncode, 0)
        page = (self.folder / "MUTANTS.md").read_text()
        self.assertIn("| 2 | unbiased: every mean is right, only the paths differ |", page)
        self.assertIn("| 2 | **a gap of the suite** |", page)
        self.assertIn("biases the image escapes on some machine: b.", page)

    def test_a_page_of_planted_bugs_without_records_is_refused(self):
        self.refused(self.mutants("--write"), "catalogue.json")
        self.store_bugs()
        (self.folder / "mutants.json").unlink()
        self.refused(self.mutants("--check"), "holds no record")

    def test_image_bits_tell_programs_apart_and_say_why_one_refuses(self):
        def program(name, text):
            file = self.folder / name
            file.write_text("#!/bin/sh\n" + text)
            file.chmod(0o755)
            return file

        def bits(*arguments):
            return subprocess.run([sys.executable, SCRIPTS / "measure/image_bits", *arguments, "--scene", "scenes/glass.json"],
                                  capture_output=True, text=True, timeout=60)

        options = 'echo "$@" | sed "s/.*--size/--size/" > "$4"\n'  # the image is what was asked for
        first, second = bits(program("a", options)), bits(program("b", options + 'echo more >> "$4"\n'))
        names = [line.split()[:2] for line in first.stdout.splitlines()]
        self.assertEqual(names, [["glass", "cpu"], ["glass", "cpu-double"], ["glass", "vulkan"]])
        hashes = [line.split()[2] for output in (first, second) for line in output.stdout.splitlines()]
        self.assertEqual(len(set(hashes)), 6)  # three ways, two programs
        self.assertEqual(first.stdout, bits(self.folder / "a").stdout)
        self.assertIn("glass vulkan refused (2): no device; take --backend cpu", bits(
            program("c", 'echo "no device; take --backend cpu" >&2\nexit 2\n')).stdout)
        self.refused(bits(self.folder / "missing"), "there is no program")

    def scaling(self, *arguments):
        return subprocess.run([sys.executable, SCRIPTS / "measure/scaling", *map(str, arguments), "-o", self.folder], capture_output=True,
                              text=True, timeout=120)

    def program_of_three_devices(self, version="c0ffee", bits="b'the image'", left_out=""):
        """A stand-in for the program: n devices render in 1/n of the time that the samples take, and start in a second more."""
        program = self.folder / "program"
        program.write_text(f"""#!{sys.executable}
import json, sys
words = sys.argv[1:]
value = lambda option: words[words.index(option) + 1]
if words[0] == "devices":
    gpu = {{"name": "A GPU", "type": "discrete GPU", "suitable": True, "driver": "d 1"}}
    all = [gpu, gpu | {{"name": "lavapipe", "type": "CPU"}}, gpu, gpu | {{"suitable": False}}, gpu]
    json.dump({{"devices": [one | {{"index": n}} for n, one in enumerate(all)]}}, open(value("--json"), "w"))
elif words[0] == "plan":
    print(json.dumps({{"version": "{version}"}}))
else:
    devices = value("--device").split(",")
    open(value("-o"), "wb").write({bits})
    print("{left_out}", file=sys.stderr)
    json.dump({{"seconds": int(value("--samples")) / 100 / len(devices)}}, open(value("--json"), "w"))
""")
        program.chmod(0o755)
        return program

    def test_the_gain_of_several_devices_is_measured_elsewhere_and_taken(self):
        told, record = self.folder / "told", self.folder / "scaling.json"
        shutil.copy(SCRIPTS.parent / "tests/records/scaling/scaling.json", record)
        elsewhere = ("--devices-only", "--json", told, "--rounds", "2")
        result = self.scaling(*elsewhere, "--program", self.program_of_three_devices())
        self.assertEqual(result.returncode, 0, result.stderr)
        measured = json.loads(told.read_text())
        self.assertEqual((measured["name"], measured["git"]), ("3 × A GPU", "c0ffee"))
        for scene in measured["scenes"]:
            one = scene["samples"] / 100
            self.assertTrue(5 < one <= 20, one)  # about ten seconds for one device
            self.assertEqual([scene["runs"][n]["render_seconds"] for n in "123"], [[round(one / n, 4)] * 2 for n in (1, 2, 3)])
            self.assertTrue(all(len(scene["runs"][n]["seconds"]) == 2 for n in "123"))
        for _ in range(2):  # the second takes the place of the first
            self.assertEqual(self.scaling("--take", told).returncode, 0)
        self.assertEqual([one["name"] for one in json.loads(record.read_text())["devices"]].count("3 × A GPU"), 1)
        page = (self.folder / "SCALING.md").read_text()
        self.assertIn("3 × A GPU: 3 devices render `one-weekend` 3.00 and `cornell-thesis` 3.00 times as fast as one, in renders of ", page)
        self.assertNotIn("not measured.", page)
        self.assertIn("| 2.00 (2.00–2.00) |", page)
        self.assertIn("2 ranks make `render`", page)  # what was there is kept
        self.assertEqual(self.scaling("--check").returncode, 0)

    def test_what_is_no_gain_of_devices_is_refused(self):
        told = self.folder / "told"
        elsewhere = ("--devices-only", "--json", told, "--rounds", "1")
        self.refused(self.scaling("--devices-only"), "go together")
        self.refused(self.scaling(*elsewhere, "--program", self.program_of_three_devices("c0ffee-dirty")), "c0ffee-dirty")
        self.refused(self.scaling(*elsewhere, "--program", self.program_of_three_devices(), "--devices", "0,1"), "are not equal")
        self.refused(self.scaling(*elsewhere, "--program", self.program_of_three_devices(), "--devices", "0,9"), "--devices 0,9")
        self.refused(self.scaling(*elsewhere, "--program", self.program_of_three_devices(), "--devices", "0"), "no two equal GPUs")
        self.refused(self.scaling(*elsewhere, "--program", self.program_of_three_devices(left_out="device 2 is left out: it hangs")), "it hangs")
        differs = self.scaling(*elsewhere, "--program", self.program_of_three_devices(bits="value('--device').encode()"))
        self.assertEqual(differs.returncode, 1)
        self.assertIn("the bits of", differs.stderr)
        self.assertFalse(told.exists())
        told.write_text("{}")
        self.refused(self.scaling("--take", told), "scaling.json")
        shutil.copy(SCRIPTS.parent / "tests/records/scaling/scaling.json", self.folder)
        self.refused(self.scaling("--take", told), "is no record of scaling")

    def test_intervals_alone_say_where_a_pattern_stands(self):
        loader = importlib.machinery.SourceFileLoader("guidelines", str(SCRIPTS / "measure/guidelines"))
        guidelines = importlib.util.module_from_spec(importlib.util.spec_from_loader("guidelines", loader))
        sys.dont_write_bytecode = True
        loader.exec_module(guidelines)

        def table(*intervals, p=0.01):
            return guidelines.table_of([{"ratio_low": low, "ratio_high": high, "p_family": p} for low, high in intervals])

        self.assertEqual(table((0.90, 1.10), (0.90, 0.97)), "adopt")
        self.assertEqual(table((1.03, 1.10), (0.99, 1.01)), "avoid")
        self.assertEqual(table((0.90, 0.97), (1.001, 1.10)), "depends")
        self.assertEqual(table((0.50, 2.00), (0.96, 1.04)), "same")
        self.assertEqual(table((0.99, 1.01), (0.94, 1.04)), "unknown")
        self.assertEqual(table((0.90, 0.97), p=0.06), "unknown")  # beyond 2 %, but by chance among so many
        family = {"arms": [{"arm": "1-thread"}, {"arm": "2-threads"}, {"arm": "edges"}]}
        self.assertTrue(guidelines.listed_arm(family, "16-threads"))
        self.assertFalse(guidelines.listed_arm(family, "boxes"))

        # Those raw readings are stored that a time is computed from: of arms whose replicates have none, by their clock.
        arm = {"family": "f", "workload": {"name": "small"}, "clock": "total", "milliseconds": {"total": 2.0}}
        raw = [{"family": "f", "workload": {"name": "small"}, "seed": 1, "arms": [
            {"arm": name, "milliseconds": {"total": [2.0, 2.5], "wait": [1.0, 1.1]}} for name in ("own", "pooled")]}]
        result = {"arms": [arm | {"arm": "own", "replicate_milliseconds": [1.9, 2.1]}, arm | {"arm": "pooled"}],
                  "raw": raw, "raw_checksum": "0", "version": 1}
        kept = guidelines.stored(result)
        self.assertEqual(kept["raw"], [{"family": "f", "workload": {"name": "small"},
                                        "arms": [{"arm": "pooled", "milliseconds": {"total": [2.0, 2.5]}}]}])
        self.assertEqual({key for key in kept if kept[key] != result.get(key)}, {"raw", "left_out"})
        for one in result["arms"]:
            self.assertEqual(guidelines.base_time(kept, one), guidelines.base_time(result, one))
        self.assertEqual(guidelines.stored(kept), kept)


FAKE_TANDEM = """#!/usr/bin/python3
import array, json, pathlib, sys
bugged = pathlib.Path(sys.argv[0]).name not in ("sound", "unseen")
if sys.argv[1] == "render":
    with open(sys.argv[sys.argv.index("-o") + 1], "wb") as file:
        file.write(b"PF\\n32 16\\n-1.0\\n")
        file.write(array.array("f", [2.0 if bugged and x < 16 else 1.0 for y in range(16) for x in range(32) for c in range(3)]).tobytes())
else:
    verdict = {"verdict": "disagree" if bugged else "agree", "sentence": "", "reasons": ["tiles"], "outvoted": "candidate",
               "levels": [{"name": "tiles 16x16", "significant": bugged, "p": 1e-9}], "paired": None,
               "suspects": [{"subsystem": "geometry", "because": ""}, {"subsystem": "textures", "because": ""}] if bugged else []}
    pathlib.Path(sys.argv[sys.argv.index("--json") + 1]).write_text(json.dumps({"scenes": [verdict]}))
    sys.exit(1 if bugged else 0)
"""


class FreshBugs(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        for name in "sound", "swapped", "unseen":
            program = self.folder / "out/programs" / name
            program.parent.mkdir(parents=True, exist_ok=True)
            program.write_text(FAKE_TANDEM)
            program.chmod(0o755)

    def run_script(self, *arguments):
        return subprocess.run([sys.executable, SCRIPTS / "measure/fresh_bugs", *arguments, "-o", self.folder / "out"], capture_output=True, text=True)

    def test_a_bug_is_tabulated_with_its_effect_its_verdict_and_its_blame(self):
        patch = self.folder / "swapped.patch"
        patch.write_text("subsystem: textures\nkind: Left and right are exchanged.\nscene: closed-forms/slab\n\ndiff --git a/x b/x\n")
        result = self.run_script(patch, "--scenes", "glass", "--time", "1")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        table = (self.folder / "out/FRESH_BUGS.md").read_text()
        self.assertIn("1 of 1 bugs are found", table)
        self.assertIn("The sound program disagrees on 0 of 2 scenes.", table)
        self.assertIn("| above 0.5 % or 10 % (the margins) | 1 | 1 (21 … 100 %) | 0 |", table)
        self.assertRegex(table, r"\| swapped \| Left and right are exchanged. \| 50 % \| 100 % \| disagree \| closed-forms/slab "
                                r"\| tiles 16x16 \| \d+ \| textures \| among three \| candidate \|")
        self.assertIn("| one side | 1 | 0 (0 … 79 %) | 1 (21 … 100 %) |", table)
        self.assertEqual(self.run_script("--check").returncode, 0)
        (self.folder / "out/FRESH_BUGS.md").write_text(table.replace("1 of 1", "2 of 2"))
        self.assertEqual(self.run_script("--check").returncode, 1)

    def test_bugs_by_chance_that_change_no_image_are_left_out(self):
        patches = [self.folder / f"{name}.patch" for name in ("swapped", "unseen")]
        for patch in patches:
            patch.write_text("subsystem: textures\n\ndiff --git a/x b/x\n")
        result = self.run_script(*patches, "--scenes", "glass", "--time", "1", "--visible")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        record = json.loads((self.folder / "out/fresh_bugs.json").read_text())
        self.assertEqual(([line["bug"] for line in record["bugs"]], record["left_out"]), (["swapped"], ["unseen"]))
        self.assertIn("1 more did not build, rendered no image or changed no tile", (self.folder / "out/FRESH_BUGS.md").read_text())

    def test_bugs_by_chance_apply_and_follow_from_the_seed(self):
        script = [sys.executable, SCRIPTS / "measure/random_bugs", "--count", "34", "--seed"]
        for name, seed in ("a", 7), ("b", 7), ("c", 8):
            subprocess.run([*script, str(seed), "-o", self.folder / name], check=True)
        read = lambda name: {path.name: path.read_text() for path in (self.folder / name).iterdir()}
        patches = read("a")
        self.assertEqual(patches, read("b"))
        self.assertNotEqual(patches, read("c"))
        self.assertEqual(len(patches), 34)
        for name in patches:
            result = subprocess.run(["patch", "-p1", "--dry-run", "--batch", "--fuzz=0", "-d", SCRIPTS.parent, "-i", self.folder / "a" / name],
                                    capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, result.stdout)
        parts = {text.splitlines()[0] for text in patches.values()}
        self.assertGreaterEqual(len(parts), 15)
        self.assertEqual(subprocess.run([*script, "7", "-o", self.folder / "a"], capture_output=True).returncode, 2)

    # Two at a time, each in a tree of its own; one does not compile, and the tree is as before for the next.
    def test_bugs_of_a_folder_with_the_source_are_built_without_git(self):
        source, out = self.folder / "source", self.folder / "fresh"
        for name in "sound", "bugged":
            shutil.copy(self.folder / "out/programs/sound", self.folder / name)
        source.mkdir()
        preset = {"name": "release", "generator": "Ninja", "binaryDir": "${sourceDir}/build/release"}
        (source / "CMakePresets.json").write_text(json.dumps({"version": 6, "configurePresets": [preset]}))
        (source / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(tandem LANGUAGES CXX)\n"
                                               "add_executable(tandem main.cpp)\n"
                                               "set_target_properties(tandem PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})\n")
        program = f'#include <unistd.h>\nint main(int, char** argv) {{ return execv("{self.folder}/sound", argv); }}\n'
        (source / "main.cpp").write_text(program)
        line = program.splitlines()[1]
        patches = []
        for name, changed in (("a-bug", line.replace("/sound", "/bugged")), ("b-broken", line.replace("argv);", "args);")),
                              ("c-bug", line.replace("/sound", "/bugged"))):
            patches.append(self.folder / f"{name}.patch")
            patches[-1].write_text(f"diff --git a/main.cpp b/main.cpp\n--- a/main.cpp\n+++ b/main.cpp\n@@ -1,2 +1,2 @@\n"
                                   f" #include <unistd.h>\n-{line}\n+{changed}\n")
        no_git = self.folder / "no-git"
        no_git.mkdir()
        (no_git / "git").write_text("#!/bin/sh\nexit 127\n")
        (no_git / "git").chmod(0o755)
        result = subprocess.run([sys.executable, SCRIPTS / "measure/fresh_bugs", *patches, "--source", source, "--commit", "c0ffee", "--jobs",
                                 "2", "--scenes", "glass", "--time", "1", "-o", out], capture_output=True, text=True,
                                env=os.environ | {"PATH": f"{no_git}:{os.environ['PATH']}"})
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("b-broken.patch: cmake --build", result.stderr)
        record = json.loads((out / "fresh_bugs.json").read_text())
        self.assertEqual(record["commit"], "c0ffee")
        self.assertEqual(sorted((line["bug"], line["verdicts"][-1]["verdict"]) for line in record["bugs"]), [("a-bug", "disagree"), ("c-bug", "disagree")])
        for tree in "tree-0", "tree-1":
            self.assertEqual((out / tree / "main.cpp").read_text(), program)

    def test_what_is_no_patch_or_no_scene_is_refused(self):
        patch = self.folder / "none.patch"
        patch.write_text("nothing")
        astray = self.folder / "astray.patch"
        astray.write_text("scene: nowhere\n\ndiff --git a/x b/x\n")
        for arguments, reason in (([patch], "is no patch"), ([patch, "--scenes", "nowhere"], "nowhere: is neither"),
                                  ([astray], "nowhere: is neither"), ([patch, "--source", self.folder, "--commit", "x"], "no folder with the source")):
            result = self.run_script(*arguments)
            self.assertEqual(result.returncode, 2)
            self.assertEqual(len(result.stderr.splitlines()), 1)
            self.assertIn(reason, result.stderr)


if __name__ == "__main__":
    unittest.main()
