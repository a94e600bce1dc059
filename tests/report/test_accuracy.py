# The frontier, the sentences of README and the times to an equal error, of results that are written here. And that no result is
# evidence whose commit is none. Run by ctest with SCRIPTS = scripts/.
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import math
import os
import pathlib
import random
import shutil
import sys
import tempfile
import unittest
from unittest import mock

SCRIPTS = pathlib.Path(os.environ["SCRIPTS"])
RECORDS = SCRIPTS.parent / "tests/records"
sys.path.insert(0, str(SCRIPTS / "make"))
sys.dont_write_bytecode = True  # no cache beside the scripts
import accuracy_claims  # noqa: E402  (after the path is set)
import accuracy_pages  # noqa: E402
import commits  # noqa: E402
import equal_error_page  # noqa: E402
import frontier  # noqa: E402


def script(name):
    """A script as a module."""
    loader = importlib.machinery.SourceFileLoader(name.replace("/", "_"), str(SCRIPTS / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


accuracy = script("measure/accuracy")


def arm(knob, setting, points, cost=1.0, floor=0.0):
    return {"knob": knob, "setting": setting, "options": f"--{knob} {setting}", "keeps_estimate": floor == 0, "seconds_to": [],
            "bias_floor": floor, "bias_floor_low": 0.9 * floor, "bias_floor_high": 1.1 * floor + 1e-4, "bias_floor_significant": floor > 0,
            "cost_ratio": {"value": cost, "low": 0.9 * cost, "high": 1.1 * cost}, "efficiency": 1.0,
            "time_ratio": {"value": 1.0, "low": 0.9, "high": 1.1},
            "points": [{"seconds": t, "rmse": e, "rmse_low": 0.9 * e, "rmse_high": 1.1 * e} for t, e in points]}


def result(*arms):
    return {"scene": "box", "arms": [arm("baseline", "", [(1, 0.5), (4, 0.25), (16, 0.125)]), *arms]}


class Frontier(unittest.TestCase):
    def test_an_error_is_known_between_measured_points_alone(self):
        points = [(1, 0.5), (4, 0.25)]
        self.assertAlmostEqual(frontier.error_at(points, 2), math.sqrt(0.5 * 0.25))
        self.assertIsNone(frontier.error_at(points, 0.99))
        self.assertIsNone(frontier.error_at(points, 4.01))

    def test_a_biased_preview_leads_until_the_better_one_passes_it(self):
        stretches = frontier.frontier(result(arm("bounces", "1", [(0.1, 0.3), (1, 0.3), (16, 0.3)], floor=0.3)))
        self.assertEqual([name for name, _, _ in stretches], ["bounces 1", "baseline"])
        for _, _, points in stretches:
            self.assertTrue(all(0.1 <= t <= 16.001 and 0.124 <= e <= 0.5 for t, e in points), points)
        errors = [e for _, _, points in stretches for _, e in points]
        self.assertTrue(all(after <= frontier.FLAT * before for before, after in zip(errors, errors[1:])), errors)

    def test_a_setting_that_is_hardly_better_does_not_take_over(self):
        close = arm("generator", "hash", [(1, 0.49), (4, 0.245), (16, 0.122)])
        first = frontier.frontier(result(close))
        self.assertEqual(len(first), 1)

    def test_a_point_that_is_not_known_is_not_drawn(self):
        unknown = arm("bounces", "8", [(1, 0.4), (16, 0.001)])
        unknown["points"][1]["rmse_low"] = -0.01
        self.assertEqual(frontier.known_points(unknown), [(1, 0.4)])

    def test_a_plot_has_a_dot_a_point_and_nothing_outside(self):
        report = result(arm("roulette", "4", [(0.5, 0.5), (2, 0.25), (8, 0.125)]))
        plot = frontier.plot(report, frontier.limits([report]), "a title")
        dots = plot.split('class="dots" d="')[1].split('"')[0].strip("M").split("M")
        self.assertEqual(len(dots), 6)
        for dot in dots:
            x, y = map(float, dot.removesuffix("h0").split())
            self.assertTrue(frontier.LEFT <= x <= frontier.WIDTH - frontier.RIGHT and frontier.TOP <= y <= frontier.HEIGHT - frontier.BOTTOM)


class Bias(unittest.TestCase):
    def test_only_what_has_no_limit_of_bounces_is_called_unbiased(self):
        limited, unlimited = arm("generator", "sobol", []), arm("roulette", "4 --bounces 256", [])
        self.assertEqual(accuracy_pages.floor(limited), "no bias found above 0.01\u00a0%")
        self.assertEqual(accuracy_pages.floor(unlimited), "unbiased")
        unlimited["keeps_estimate"] = False  # with another reflectance, say
        self.assertEqual(accuracy_pages.floor(unlimited), "no bias found above 0.01\u00a0%")


def reached(error, seconds):
    return {"relative_error": error, "seconds": seconds, "seconds_low": 0.9 * seconds, "seconds_high": 1.1 * seconds, "extrapolated": False}


class Tables(unittest.TestCase):
    def report(self, confirmations=()):
        sobol = arm("generator", "sobol", [(1, 0.1), (8, 0.02)], 0.5)
        sobol |= {"cost_differs": True, "seconds_to": [reached(0.05, 2.0)]}
        report = result(sobol)
        report["arms"][0] |= {"cost_differs": False, "seconds_to": [reached(0.05, 9.0)]}
        return report | {"confirmations": list(confirmations)}

    def test_what_is_not_reached_tells_the_longest_render(self):
        report = self.report()
        self.assertEqual(accuracy.time_cell(report, 0.003), "not reached by renders up to 16 s")
        self.assertEqual(accuracy_pages.cell(report, report["arms"][0] | {"seconds_to": []}, 0.003), "–")
        unreached = report["arms"][1] | {"seconds_to": [reached(0.003, 0.0) | {"seconds": None}]}
        self.assertEqual(accuracy_pages.cell(report, unreached, 0.003), "not reached in 8 s")

    def test_the_soonest_setting_has_the_time_of_its_rounds_and_a_mark_unless_it_is_shown_to_be(self):
        anew = {"relative_error": 0.05, "recommended": "generator sobol", "forecast": False, "seconds": 3.0, "outcome": "shown"}
        for confirmation, seconds, mark in (({}, "2 s", " ≈"), (anew, "3 s", ""), (anew | {"outcome": "refuted"}, "3 s", ""),
                                            (anew | {"outcome": "open"}, "3 s", " ≈"), (anew | {"forecast": True}, "2 s", " ≈")):
            report = self.report([confirmation] if confirmation else [])
            self.assertEqual(accuracy.time_cell(report, 0.05), f"{seconds}, `--generator sobol`{mark}")
            self.assertEqual(accuracy_pages.cell(report, report["arms"][1], 0.05), seconds)

    def test_the_first_table_tells_how_long_was_measured_and_how_much_is_shown(self):
        shown = {"relative_error": 0.01, "recommended": "generator sobol", "forecast": False, "seconds": 3.0, "outcome": "shown"}
        reports = {}
        for scene, confirmations, seconds in (("a", [shown], 10.0), ("b", [], 20.0), ("c", [], 40.0)):
            reports[scene] = self.report(confirmations) | {"seconds": seconds}
            if scene != "c":
                reports[scene]["arms"][1]["seconds_to"].append(reached(0.01, 3.0))
        self.assertEqual(accuracy.found({"cpu": reports}).splitlines()[2],
                         "| cpu | 3 | 20 (10 … 40) | 2 | `--generator sobol` 2 | 1 |")

    def test_what_was_not_rendered_beside_the_baseline_is_no_figure_of_a_setting(self):
        alone = arm("generator", "sobol", [(1, 0.5)], 0.01) | {"time_ratio": {"value": 72.0, "low": 0.0, "high": None}}
        alone["cost_ratio"]["high"] = None
        reports = {"a": result(arm("generator", "sobol", [(1, 0.5)], 0.5)), "b": result(alone), "c": result(alone | {"time_ratio": None})}
        self.assertIn("| generator sobol | 3 | 1.00 (1.00 … 1.00) | 2.00 (2.00 … 2.00) |", accuracy.knob_rows(reports)[2])
        self.assertEqual(len(accuracy_claims.with_noise(accuracy_claims.arms_of(reports, "generator", "sobol"))), 1)

    def test_a_floor_counts_where_it_is_above_the_baselines_and_not_of_what_keeps_the_estimate(self):
        def floors(floor, base_floor, keeps):
            tried = arm("bounces", "1", [(1, 0.5)], floor=floor) | {"keeps_estimate": keeps}
            report = result(tried)
            report["arms"][0] |= {"bias_floor_high": base_floor, "bias_floor_significant": base_floor > 0.01}
            return accuracy.knob_rows({"box": report})[2].split("|")[5].strip()
        self.assertEqual(floors(0.1, 0.05, False), "1: 10 % (box)")  # 9 % is the low end
        self.assertEqual(floors(0.1, 0.005, False), "1: 10 % (box)")
        self.assertEqual(floors(0.1, 0.095, False), "none found")
        self.assertEqual(floors(0.1, 0.05, True), "none found")

    def test_durations_are_rounded_before_their_unit_is_chosen(self):
        self.assertEqual([accuracy.duration(s) for s in (0.0994, 0.0996, 0.9996)], ["99 ms", "100 ms", "1 s"])
        self.assertEqual([frontier.duration(s) for s in (0.9994e-3, 0.9996e-3, 0.9996)], ["999 µs", "1 ms", "1 s"])


class Sentences(unittest.TestCase):
    def machines(self, sobol=0.5, path=3.0, floor=0.1):
        arms = [arm("generator", "sobol", [], sobol) | {"seconds_to": [reached(0.05, 8 * sobol)]}, arm("integrator", "path", [], path),
                arm("bounces", "4", [], 0.9, floor)]
        reports = [result(*arms) for _ in range(3)]
        for report in reports:
            report["arms"][0]["seconds_to"] = [reached(0.05, 8.0)]
        return {"cpu": dict(zip("ab", reports)), "gpu": {"a": reports[2]}}

    def test_they_name_each_machine_with_its_figure(self):
        told = accuracy_claims.sentences(self.machines())
        self.assertEqual(len(told), 3)
        self.assertIn("2.0 (cpu, 2 scenes) and 2.0 (gpu, 1)", told[0])
        self.assertIn("2 of 2 (cpu) and 1 of 1 (gpu)", told[1])

    def test_scenes_whose_own_settings_sample_no_lights_count_too(self):
        results = self.machines()
        results["cpu"] |= {"c": result(arm("integrator", "next-event", [], 0.3)), "d": result(arm("integrator", "next-event", [], 2.0))}
        self.assertIn("3 of 4 (cpu) and 1 of 1 (gpu)", accuracy_claims.light_sampling(results))

    def test_scenes_without_noise_or_without_either_time_tell_nothing_of_sobol_points(self):
        results = self.machines()
        quick = arm("generator", "sobol", [], 1.0) | {"seconds_to": [reached(0.05, 8.0)]}
        results["cpu"] |= {name: result(quick | {"efficiency": None}) for name in "cdef"} | {"g": result(quick)}
        for name in "cdef":
            results["cpu"][name]["arms"][0]["seconds_to"] = [reached(0.05, 8.0)]
        self.assertIn("2.0 (cpu, 2 scenes)", accuracy_claims.sobol(results))

    def test_each_is_refused_where_one_machine_contradicts_it(self):
        for claim, wrong in zip(accuracy_claims.CLAIMS, ({"sobol": 1.5}, {"path": 0.5}, {"floor": 0.0})):
            results = self.machines()
            claim(results)
            results["gpu"] = self.machines(**wrong)["gpu"]
            with self.assertRaises(accuracy_claims.DoesNotHold):
                claim(results)


class EqualError(unittest.TestCase):
    def record(self, factor):
        """Errors that fall as the root of time, Tandem's factor times sooner, with noise of 3 %."""
        noise = random.Random(1)
        points = [{"who": who, "level": level, "seed": seed, "seconds": seconds * speed * math.exp(noise.gauss(0, 0.03)),
                   "relative_error": 0.1 / math.sqrt(seconds)}
                  for who, speed in (("cycles", factor), ("tandem", 1.0)) for seed in range(1, 6) for level, seconds in enumerate((1, 4, 16, 64))]
        return {"seeds": 5, "scenes": {"box": {"targets": [0.05, 0.02, 0.01], "points": points}}}

    def test_scenes_whose_lamps_cycles_finds_by_scattering_are_counted_apart(self):
        self.assertTrue(equal_error_page.has_lamps_without_area_light("glass"))
        self.assertTrue(equal_error_page.has_lamps_without_area_light("fog"))  # one of two
        self.assertFalse(equal_error_page.has_lamps_without_area_light("cornell-classic"))
        self.assertFalse(equal_error_page.has_lamps_without_area_light("environment"))
        record = json.loads((RECORDS / "cycles/equal_error.json").read_text())
        for scene in ("caustics", "bokeh", "fog"):
            del record["scenes"][scene]
        page = equal_error_page.page_of(record)
        count = lambda scenes: sum(scene in scenes for scene, *_ in equal_error_page.comparisons(record))
        self.assertIn(f"- {count(record['scenes'])} pairs of scene and error: Tandem is", page)
        self.assertIn(f"- The {count(('cornell-classic', 'environment'))} of scenes whose lights Cycles samples: ", page)
        self.assertIn("That goes for glass.", page)

    def test_times_are_read_between_points_and_never_beyond(self):
        curve = [(1, 0.1), (4, 0.05), (16, 0.025)]
        self.assertAlmostEqual(equal_error_page.seconds_to(curve, 0.05), 4)
        self.assertAlmostEqual(equal_error_page.seconds_to(curve, 0.1 / math.sqrt(2)), 2)
        self.assertIsNone(equal_error_page.seconds_to(curve, 0.2))
        self.assertIsNone(equal_error_page.seconds_to(curve, 0.02))

    def test_the_interval_holds_the_factor_and_what_neither_reaches_is_a_dash(self):
        found = {error: (cycles, tandem, ratio) for _, error, cycles, tandem, ratio, _ in equal_error_page.comparisons(self.record(3.0))}
        for error, seconds in ((0.05, 4), (0.02, 25)):
            cycles, tandem, ratio = found[error]
            self.assertTrue(ratio[1] < 3.0 < ratio[2] and ratio[2] < 3.5, ratio)
            self.assertAlmostEqual(tandem[0], seconds, delta=0.1 * seconds)
        cycles, tandem, ratio = found[0.01]  # errors end at 1.25 %, after 192 and 64 s
        self.assertIsNone(ratio)
        self.assertEqual(equal_error_page.shown(ratio), "–")
        self.assertTrue(cycles[1] < 192 < cycles[2] and tandem[1] < 64 < tandem[2], (cycles, tandem))

    def test_the_longest_render_that_is_not_good_enough_is_a_bound(self):
        record = self.record(3.0)
        for point in record["scenes"]["box"]["points"]:
            if point["who"] == "cycles" and point["seed"] == 2 and point["level"] == 3:
                point["relative_error"] = 0.021  # one seed suffices
        found = {error: (cycles, ratio, signs) for _, error, cycles, _, ratio, signs in equal_error_page.comparisons(record)}
        cycles, ratio, signs = found[0.02]
        self.assertEqual(signs, ["≥ ", "", "≥ "])
        self.assertTrue(1.5 < ratio[1] < 3.0, ratio)  # the bound of one seed is 7.7 times Tandem's time
        self.assertEqual(equal_error_page.shown(ratio, signs[2]), f"≥ {ratio[1]:.3g}")
        self.assertEqual(found[0.05][2], ["", "", ""])

    def test_what_every_render_of_cycles_takes_besides_is_left_out(self):
        record = self.record(1.0)
        box = record["scenes"]["box"]
        without = next(equal_error_page.comparisons(record))
        for point in box["points"]:
            if point["who"] == "cycles":
                point["seconds"] += 0.5
        box["points"] += [{"who": "pilot 4", "level": n, "seed": 0, "seconds": 0.5 + n / 100, "relative_error": 1.0} for n in (4, 16)]
        self.assertAlmostEqual(equal_error_page.fixed_seconds(box), 0.5)
        self.assertAlmostEqual(next(equal_error_page.comparisons(record))[4][0], without[4][0])

    def test_a_seed_that_lacks_leaves_the_cell_empty(self):
        record = self.record(1.0)
        record["scenes"]["box"]["points"] = [p for p in record["scenes"]["box"]["points"] if (p["who"], p["seed"]) != ("cycles", 5)]
        _, _, cycles, tandem, ratio, _ = next(equal_error_page.comparisons(record))
        self.assertIsNone(cycles)
        self.assertIsNotNone(tandem)
        self.assertIsNone(ratio)

    def test_the_shortest_render_that_is_better_already_is_a_bound(self):
        record = self.record(3.0)
        record["scenes"]["box"]["targets"] = [0.2]  # errors begin at 10 %
        *_, ratio, signs = next(equal_error_page.comparisons(record))
        self.assertEqual((ratio, signs[:2]), (None, ["≤ ", "≤ "]))
        first = [p for p in record["scenes"]["box"]["points"] if p["who"] == "cycles" and p["level"] == 0]
        for point in first:
            point["relative_error"] = 0.3
        _, _, _, tandem, ratio, signs = next(equal_error_page.comparisons(record))
        self.assertEqual(signs, ["", "≤ ", "≥ "])
        self.assertAlmostEqual(tandem[0], 1.0, delta=0.1)
        self.assertGreater(ratio[1], 3.0)  # Cycles reaches it later than its first render, which took three times as long


HAS_HISTORY = (SCRIPTS.parent / ".git").exists() and commits.git("rev-parse", "--is-shallow-repository").stdout.strip() == "false"
COMMIT = commits.git("rev-parse", "--short=12", "HEAD").stdout.strip() if HAS_HISTORY else "fedcba987654"
NO_EVIDENCE = ["unknown", "deadbeef-dirty", ""] + (["0123456789abcdef"] if HAS_HISTORY else [])

# Tells the commit that the file beside it holds, after so many renders the next one there. Its images are even and grey.
FAKE_TANDEM = """#!/usr/bin/python3
import array, json, pathlib, sys
value = lambda option: sys.argv[sys.argv.index(option) + 1]
commits = pathlib.Path(sys.argv[0]).with_name("commits")
told = commits.read_text().split("\\n")
commits.write_text("\\n".join(told[1:] or told))
report = {"git": told[0], "device": "a CPU", "driver": "its driver", "width": 2, "height": 2, "samples": 1, "seconds": 0.01,
          "relative_error": 0.01, "relative_error_low": 0.0, "relative_error_high": 0.02, "generator": "philox", "sampling": "uniform",
          "reference": {"options": ""}, "arms": [{"options": "", "keeps_estimate": True, "seconds_to": [],
          "points": [{"samples": 1, "seconds": 0.1}, {"samples": 2, "seconds": 0.2}]}]}
if sys.argv[1] == "render":
    pathlib.Path(value("-o")).write_bytes(b"PF\\n2 2\\n-1.0\\n" + array.array("f", 12 * [0.5]).tobytes())
pathlib.Path(value("--json")).write_text(json.dumps(report))
"""


class TargetError(unittest.TestCase):
    def test_rows_of_older_programs_are_counted_apart(self):
        module = script("measure/target_error")
        records = json.loads((RECORDS / "accuracy/target_error.json").read_text())
        first = next(record for record in records if record["commit"] not in module.WITHOUT_LOOKS)
        older = first | {"commit": next(iter(module.WITHOUT_LOOKS)), "free": 9 * first["free"][:1]}
        summary = module.page([first, older]).split("|---|---|---|---|\n")[1].split("\n\n")[0].splitlines()
        self.assertEqual([line.split(" | ")[0] for line in summary], [f"| {first['machine']}", f"| {first['machine']}†"])
        self.assertTrue(all(line.endswith(" of 1 |") for line in summary), summary)
        self.assertIn(" | 9 | ", module.page([older]).splitlines()[-3])


class WithScripts(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def run_script(self, module, *words):
        """Exit status and what went to standard error."""
        errors = io.StringIO()
        with mock.patch("sys.argv", ["it", *map(str, words)]), contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
            try:
                status = module.main()
            except OSError as error:  # as where the script is not imported
                print(error, file=sys.stderr)
                status = 2
            except SystemExit as end:
                status = end.code
        return status or 0, errors.getvalue()


class StoredCommits(WithScripts):
    """Each --check, of copies of the stored results: each page is made anew, so that the commit alone can be its fault."""

    def holds(self, module, key, file, check, write=()):
        self.run_script(module, *write)
        self.assertEqual(self.run_script(module, *check), (0, ""))
        text = file.read_text()
        stored = text.split(f'"{key}": "', 1)[1].split('"', 1)[0]
        for commit in NO_EVIDENCE:
            with self.subTest(commit=commit):
                file.write_text(text.replace(f'"{key}": "{stored}"', f'"{key}": "{commit}"', 1))
                self.run_script(module, *write)
                status, told = self.run_script(module, *check)
                self.assertEqual(status, 1, told)
                self.assertIn(file.stem, told)
                self.assertIn(commits.commit_fault(commit), told)
                self.assertEqual(len(told.splitlines()), 1, told)
        file.write_text(text)

    def copied(self, *names):
        for name in names:
            source, target = RECORDS / "accuracy" / name, self.folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)
        return self.folder / names[0]

    def test_of_target_error_and_forecasts(self):
        for name in ("target_error", "forecasts"):
            module = script(f"measure/{name}")
            module.RECORD, module.PAGE = self.copied(f"{name}.json"), self.folder / "page.md"
            self.holds(module, "commit", module.RECORD, ["--check"])

    def test_of_equal_error(self):
        stored = self.folder / "equal_error.json"
        shutil.copy(RECORDS / "cycles/equal_error.json", stored)
        self.holds(script("measure/equal_error"), "commit", stored, ["--check", "--output", stored], ["--write", "--output", stored])

    def test_of_accuracy(self):
        module = script("measure/accuracy")
        stored = self.copied("cpu/glass.json", "h200/glass.json")
        module.RESULTS, module.DOCUMENT = self.folder, self.folder / "page.md"
        self.holds(module, "git", stored, ["--check"])

    def test_of_the_overview_and_its_pictures(self):
        module, stored = script("report"), self.copied("cpu/glass.json")
        self.holds(module, "git", stored, [self.folder, "--check"], [self.folder])
        pictures = self.folder / "pictures/cpu/glass/pictures.json"
        pictures.parent.mkdir(parents=True)
        pictures.write_text(json.dumps({"scene": "glass", "width": 2, "height": 2, "device": "a CPU", "commit": COMMIT, "full_colour": 0.5,
                                        "reference": {"samples": 1, "relative_uncertainty": 0.001, "seconds": 1}, "missing": [],
                                        "pictures": 2 * [{"file": "", "title": "a", "options": "", "seconds": 1, "error": 0.1,
                                                          "shown_error": 0.1, "at_most": False}]}))
        self.holds(module, "commit", pictures, [self.folder, "--check"], [self.folder])

    def test_of_the_picture_in_the_readme(self):
        module = script("make/accuracy_picture")
        stored = self.copied("cpu/glass.json", "cpu/cornell-classic.json", "h200/cornell-classic.json")
        shutil.copy(module.README, self.folder)
        module.FOLDER, module.PICTURE, module.README = self.folder, self.folder / "frontier.svg", self.folder / "README.md"
        with mock.patch.object(accuracy_claims, "CLAIMS", []):
            self.holds(module, "git", stored, ["--check"])


class MeasuredCommits(WithScripts):
    """What is stored is of the commit that the program tells; of no evidence nothing is stored."""

    def setUp(self):
        super().setUp()
        self.program, self.stored = self.folder / "tandem", self.folder / "stored.json"
        self.program.write_text(FAKE_TANDEM)
        self.program.chmod(0o755)
        self.changed = mock.patch.object(commits, "changed", return_value=False).start()
        self.addCleanup(mock.patch.stopall)

    def measure(self, module, words, *told):
        """By a program that tells these commits in turn."""
        (self.folder / "commits").write_text("\n".join(told))
        module.TANDEM = self.program
        return self.run_script(module, *words)

    def refuses(self, module, words, kept):
        """`kept` is what is not to change."""
        before = {path: path.read_bytes() for path in kept.rglob("*") if path.is_file()}

        def refused(mention, *told):
            status, error = self.measure(module, words, *told)
            self.assertEqual((status, len(error.strip().splitlines())), (2, 1), error)
            self.assertIn(mention, error)
            self.assertEqual({path: path.read_bytes() for path in kept.rglob("*") if path.is_file()}, before)

        for commit in NO_EVIDENCE:
            with self.subTest(commit=commit):
                refused(commits.commit_fault(commit), commit)
        self.changed.return_value = True
        refused("changes that are not committed", COMMIT)
        self.changed.return_value = False

    def one_commit(self, name, words):
        module, kept = script(f"measure/{name}"), self.folder / "kept"
        kept.mkdir()
        module.RECORD, module.PAGE = kept / "stored.json", kept / "page.md"
        module.RECORD.write_text("[]")
        self.refuses(module, words, kept)
        status, error = self.measure(module, words, COMMIT, "0123456789ab")
        self.assertEqual(status, 2, error)
        self.assertIn("0123456789ab now: measure again", error)
        self.assertEqual(module.RECORD.read_text(), "[]")
        self.assertEqual(self.measure(module, words, COMMIT)[0], 0)
        self.assertEqual([one["commit"] for one in json.loads(module.RECORD.read_text())], [COMMIT])
        # It is there: the program renders once more, to tell its commit. So it is with the eight digits that older results have.
        for stored in (COMMIT, COMMIT[:8]):
            text = module.RECORD.read_text().replace(COMMIT, stored)
            module.RECORD.write_text(text)
            self.assertEqual(self.measure(module, words, COMMIT, "none")[0], 0)
            self.assertEqual((module.RECORD.read_text(), (self.folder / "commits").read_text()), (text, "none"))
        for other in ("0123456789ab", COMMIT + "-dirty", ""):  # of another program or of none: it is measured anew
            module.RECORD.write_text(text.replace(f'"{COMMIT[:8]}"', f'"{other}"'))
            self.assertEqual(self.measure(module, words, COMMIT)[0], 0)
            self.assertEqual([one["commit"] for one in json.loads(module.RECORD.read_text())], [COMMIT])

    def test_of_target_error(self):
        self.one_commit("target_error", ["--name", "here", "glass", "--size", 2, "--errors", "5%", "--runs", 1, "--rounds", 1])

    def test_of_forecasts(self):
        self.one_commit("forecasts", ["--name", "here", "glass"])

    def test_of_equal_error(self):
        class Reference:
            uncertainty = 0.0

            def __init__(self, *_):
                pass

            def load(self):
                return self

        class Measurement:
            def __init__(self, scene, row, reference, arguments, keep):
                self.scene, self.arguments, self.keep = scene, arguments, keep

            def run(self, folder):
                module.tandem_render(self.scene, folder, self.arguments.commit, [])
                self.keep()

        module, kept = script("measure/equal_error"), self.folder / "kept"
        kept.mkdir()
        stored = kept / "equal_error.json"
        shutil.copy(RECORDS / "cycles/equal_error.json", stored)
        module.Reference, module.Measurement, module.need_programs = Reference, Measurement, lambda *_: None
        words = ["--scene", "glass", "--output", stored]
        self.refuses(module, [*words, "--fresh"], kept)
        self.assertIn("--fresh begins it anew", self.measure(module, words, COMMIT)[1])
        self.assertIn("now: measure again", self.measure(module, [*words, "--fresh"], COMMIT, "0123456789ab")[1])
        commit_of = lambda: json.loads(stored.read_text())["scenes"]["glass"]["commit"]
        self.assertEqual(self.measure(module, [*words, "--fresh"], COMMIT), (0, ""))
        self.assertEqual(commit_of(), COMMIT)
        stored.write_text(stored.read_text().replace(COMMIT, COMMIT[:8]))
        self.assertEqual(self.measure(module, words, COMMIT), (0, ""))  # it is gone on with
        self.assertEqual(commit_of(), COMMIT[:8])

    def test_of_pictures(self):
        module, kept = script("measure/accuracy_pictures"), self.folder / "kept"
        (kept / "cpu").mkdir(parents=True)
        shutil.copy(RECORDS / "accuracy/cpu/glass.json", kept / "cpu")
        module.RESULTS, module.ROOT = kept, self.folder
        words = ["--name", "cpu", SCRIPTS.parent / "scenes/glass.json"]
        self.refuses(module, words, kept)
        jobs = []
        module.Job.run = lambda job: (job.render("a", ""), jobs.append(job))
        self.assertEqual(self.measure(module, words, COMMIT), (0, ""))
        self.assertEqual(jobs[0].set["commit"], COMMIT)
        shutil.rmtree(jobs[0].work)
        status, error = self.measure(module, words, COMMIT, "0123456789ab")
        self.assertEqual(status, 2, error)
        self.assertIn("now: measure again", error)

    def test_of_accuracy_and_of_what_it_takes(self):
        module, kept = script("measure/accuracy"), self.folder / "kept"
        kept.mkdir()
        module.RESULTS, module.DOCUMENT = kept, kept / "page.md"
        self.refuses(module, ["--name", "cpu", SCRIPTS.parent / "scenes/glass.json"], kept)
        for text, mention in ((None, "No such file"), ("{", "is no JSON"), ("[]", "not written by tandem cost"), ("{}", "not written by")):
            taken = self.folder / "taken.json"
            taken.unlink(missing_ok=True)
            if text is not None:
                taken.write_text(text)
            status, error = self.run_script(module, "--name", "cpu", "--take", RECORDS / "accuracy/cpu/glass.json", taken)
            self.assertEqual(status, 2)
            self.assertIn(mention, error)
            self.assertEqual(list(kept.iterdir()), [])

    def test_a_program_that_is_not_there_or_renders_nothing_is_one_line(self):
        module = script("measure/forecasts")
        module.RECORD = self.stored
        self.program.write_text("#!/bin/sh\necho no device >&2\nexit 4\n")
        self.assertIn("no device", self.measure(module, ["--name", "here"], COMMIT)[1])
        self.program.unlink()
        status, error = self.measure(module, ["--name", "here"], COMMIT)
        self.assertEqual((status, len(error.splitlines())), (2, 1), error)


if __name__ == "__main__":
    unittest.main()
