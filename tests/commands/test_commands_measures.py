# What `tandem effects`, `bench`, `stability` and `cost` measure, keep and refuse.
# Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import os
import re
import shutil
import signal
import subprocess
import time
import unittest

from program import SCENES, TANDEM, THOROUGH, ProgramTest, in_time, tandem, until


class Measures(ProgramTest):
    def test_effects_without_time_for_kernels_tells_what_the_scene_calls_for(self):
        figures = self.folder / "out.json"
        result = tandem("effects", SCENES / "cornell-classic.json", "--time", "0.01", "--json", figures)
        self.refused(result, "--time: 0.01 s are too short: ", "timed", status=3)
        told = json.loads(figures.read_text())
        self.assertIn("diffuse", {finding["effect"] for finding in told["needed"]})
        self.assertEqual(told["rounds"], 0)
        self.assertNotIn("speedup", told)

    def test_effects_tells_the_needed_and_the_absent(self):
        report = self.folder / "effects.json"
        result = in_time("effects", self.scene, "--backend", "cpu", "--time", 3, "--json", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(report.read_text())
        needed = {finding["effect"] for finding in told["needed"]}
        self.assertEqual(needed, {"spheres", "diffuse", "background"})
        self.assertIn("lens", {finding["effect"] for finding in told["absent"]})
        self.assertTrue(told["identical"])
        self.assertLessEqual(told["speedup_low"], told["speedup_high"])
        self.assertEqual(told["specialised"]["variant"], "lean-path")
        self.assertIn("noise", told["specialised"]["effects_without_code"])
        self.assertEqual(told["specialised"]["kernel_seconds"], 0)
        self.assertIn(told["samples_to_pay"], (0, None))
        self.assertEqual(len(told["not_allocated"]), 1)
        self.assertIn("compiled with the program", result.stdout)
        self.assertNotIn("lower bound", result.stdout)
        self.refused(tandem("effects", self.scene, "--effects", "all"), "--effects")

    @unittest.skipUnless(THOROUGH, "takes long: lesson 12 shows a part of it in every run")
    def test_effects_tells_what_is_not_compiled_allocated_and_dispatched(self):
        report = self.folder / "effects.json"
        result = tandem("effects", self.scene, "--backend", "vulkan", "--kernel", "stages", "--size", 4, "--bounces", 2,
                        "--integrator", "whitted", "--time", 110, "--json", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(report.read_text())
        for key in ["not_compiled", "not_allocated", "not_dispatched"]:
            self.assertTrue(told[key], key)
        # Direct light and no light to sample: one segment.
        self.assertTrue(any(line.startswith("scatter: 1 of ") for line in told["not_dispatched"]), told["not_dispatched"])
        self.assertIsNone(told["specialised"]["variant"])
        # Kernels are made once more where three times as long as the first time, of 110 s, is left: 27.5 s decide.
        made = told["specialised"]["make_seconds"] + told["general"]["make_seconds"]
        times = (2,) if made < 20 else (1,) if made > 40 else (1, 2)
        self.assertIn(len(told["specialised"]["kernel_seconds_each"]), times)
        self.assertGreater(told["general"]["kernel_seconds"], 0)
        self.assertIn("lower bound where the driver keeps kernels", result.stdout)

    def test_bench_measures_resumes_and_compares(self):
        first, second, out = (self.folder / name for name in ("first.json", "second.json", "out.json"))
        arguments = ["bench", "--scene", self.scene, "--family", "waiting", "--size", "8x8", "--time", "60",
                     "--narrow", "0.9", "--replicates", "2"]
        self.assertEqual(tandem(*arguments, "--json", first).returncode, 0)
        told = json.loads(first.read_text())
        arms = {arm["arm"]: arm for arm in told["arms"]}
        self.assertEqual(set(arms), {"fence", "timeline", "queue-idle"})
        idle = arms["queue-idle"]
        self.assertTrue(idle["identical"])
        self.assertEqual(idle["baseline"], "fence")
        self.assertLess(idle["ratio_low"], idle["ratio"])
        self.assertLess(idle["ratio"], idle["ratio_high"])
        self.assertEqual({claim["verdict"] for claim in told["claims"] if claim["id"] == "M1"}, {"not-applicable"})
        self.assertEqual(len(told["floor"]["milliseconds"]), 200)
        self.assertEqual(len(told["device"]["device_uuid"]), 32)
        self.assertTrue(told["command"].endswith("--json first.json"))  # no folder of this machine in what is passed on
        self.assertNotIn(str(self.folder), told["command"])
        self.refused(tandem(*arguments, "--resume", first, "--csv", first), "which is read")
        # Two processes more, and the first one's readings.
        result = tandem(*arguments, "--processes", "2", "--resume", first, "--json", second)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(second.read_text())
        self.assertEqual(len(told["raw"]), 4)
        self.assertEqual({arm["processes"] for arm in told["arms"]}, {4})
        result = tandem("bench", "--compare", first, second, "--json", out)
        self.assertIn(result.returncode, (0, 1))
        self.assertEqual({arm["arm"] for arm in json.loads(out.read_text())["arms"]}, set(arms))
        self.refused(tandem("bench", "--compare", first, self.scene), "scene.json")

    def test_bench_of_several_processes_keeps_what_each_measured(self):
        out, again = (self.folder / name for name in ("out.json", "again.json"))
        arguments = ["bench", "--scene", self.scene, "--family", "waiting", "--size", "8x8", "--time", "60",
                     "--narrow", "0.9", "--replicates", "3", "--processes", "3"]
        killed = subprocess.Popen([TANDEM, *map(str, arguments), "--json", out], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL, start_new_session=True)
        self.addCleanup(killed.wait)
        deadline = time.monotonic() + 100
        while not out.exists() and killed.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        os.killpg(killed.pid, signal.SIGKILL)  # with the process that it started
        self.assertTrue(out.exists())
        kept = len(json.loads(out.read_text())["raw"])
        self.assertIn(kept, (1, 2, 3))
        result = tandem(*arguments, "--resume", out, "--json", again)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(json.loads(again.read_text())["raw"]), kept + 3)

    def test_bench_shares_its_replicates_among_processes(self):
        out = self.folder / "out.json"
        result = tandem("bench", "--scene", self.scene, "--family", "waiting", "--size", "8x8", "--time", "60", "--narrow",
                        "0.9", "--replicates", "2", "--processes", "5", "--json", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(json.loads(out.read_text())["raw"]), 2)

    def test_bench_refuses_what_it_does_not_know(self):
        self.refused(tandem("bench", "--scene", self.scene, "--family", "magic"), "magic", "memory")
        self.refused(tandem("bench", "--scene", self.scene, "--arm", "magic"), "magic")
        self.refused(tandem("bench", "--scene", self.scene, "--size", "12"), "--size")
        self.refused(tandem("bench", "--scene", self.scene, "--list", "--seed", "-1"), "--seed")
        self.refused(tandem("bench", "--scene", self.scene, "--method", "thesis", "--family", "memory"), "--method")
        self.refused(tandem("bench", "--scene", self.folder / "none.json"), "none.json")
        listed = tandem("bench", "--scene", self.scene, "--list")
        self.assertEqual(listed.returncode, 0)
        self.assertIn("pre-recorded", listed.stdout)

    def test_stability_tells_each_arm_and_expects_weak_tests_to_fail(self):
        out = self.folder / "hard.json"
        result = tandem("stability", "--catalogue", SCENES / "hard" / "catalogue.json", "--backend", "cpu",
                        "--precision", "single", "--case", "1,12", "--time", "60", "--json", out)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        report = json.loads(out.read_text())
        self.assertEqual(report["verdict"], "pass")
        self.assertIsNone(report["device_self_test"])  # the CPU is no device
        arms = {(case["id"], case["kernel"]): case for case in report["cases"]}
        self.assertEqual(arms["1", "watertight"]["outcome"], "pass")
        self.assertEqual(arms["1", "watertight"]["misses"], 0)
        self.assertEqual(arms["1", "moller-trumbore"]["outcome"], "expected failure")
        for key in ("name", "backend", "precision", "rays", "false_hits", "self_hits", "worst_ulp", "bound",
                    "nanoseconds_per_ray"):
            self.assertIn(key, arms["12", "watertight"])

    def test_stability_prints_a_line_a_case_and_arms_where_asked(self):
        def printed(*more):
            result = tandem("stability", "--catalogue", SCENES / "hard" / "catalogue.json", "--backend", "cpu",
                            "--precision", "single", "--case", "1,12", "--time", "60", *more)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            return [line.split()[0] for line in result.stdout.splitlines() if line]

        self.assertEqual(printed(), ["case", "1", "12", "Arms:"])
        arms = printed("-v")
        self.assertEqual(arms[:3], ["case", "1", "12"])
        self.assertGreater(arms.count("12"), 2)

    def test_stability_without_a_ray_proves_nothing(self):
        catalogue = json.loads((SCENES / "hard" / "catalogue.json").read_text())
        case = next(case for case in catalogue["cases"] if case["id"] == "1")
        for rays in (0, -3, 1.5, "many"):
            case["rays"] = rays
            file = self.folder / "catalogue.json"
            file.write_text(json.dumps({"cases": [case]}))
            self.refused(tandem("stability", "--catalogue", file, "--backend", "cpu"), "/cases/0/rays", "one or more")
        case["rays"] = 3  # other arms shoot a sixteenth, but one at least
        file.write_text(json.dumps({"cases": [case]}))
        out = self.folder / "hard.json"
        tandem("stability", "--catalogue", file, "--backend", "cpu", "--json", out)
        self.assertTrue(all(arm["rays"] >= 1 for arm in json.loads(out.read_text())["cases"]))

    def test_stability_on_a_device_tells_how_exactly_that_computes(self):
        out = self.folder / "hard.json"
        result = tandem("stability", "--catalogue", SCENES / "hard" / "catalogue.json", "--backend", "vulkan",
                        "--precision", "single", "--case", "1", "--arm", "watertight", "--json", out)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("Self-test of", result.stdout)
        told = json.loads(out.read_text())["device_self_test"]
        self.assertTrue(told["device"])
        self.assertIn("functions", told)

    def test_stability_refuses_what_is_not_there(self):
        catalogue = SCENES / "hard" / "catalogue.json"
        self.refused(tandem("stability", "--catalogue", catalogue, "--case", "nonsense"), "nonsense")
        self.refused(tandem("stability", "--catalogue", self.folder / "no.json"), "no.json", "no such file")
        self.refused(tandem("stability", "--catalogue", catalogue, "--backend", "cpu", "--precision", "contracted"), "contracted")

    def test_intersection_tests_and_guards_that_a_backend_lacks_are_refused_with_the_reason(self):
        out = self.folder / "out.pfm"
        self.refused(tandem("render", self.scene, "-o", out, "--precision", "double", "--triangle-test", "embree"),
                     "single precision")
        self.refused(tandem("render", self.scene, "-o", out, "--backend", "oracle", "--guard", "ulp"), "oracle")
        self.refused(tandem("render", self.scene, "-o", out, "--epsilon", "0.1"), "--epsilon", "fixed-epsilon")

    # scripts/measure/guidelines writes pages of it for what has not been measured. Arms of `threads` depend on the machine.
    def test_bench_lists_what_is_stored_beside_its_results(self):
        out = self.folder / "list.json"
        self.assertEqual(tandem("bench", "--scene", self.scene, "--list", "--json", out).returncode, 0)
        listed = json.loads(out.read_text())
        stored = json.loads((SCENES.parent / "tests/records/patterns/families.json").read_text())
        for families in (listed["families"], stored["families"]):
            for family in families:
                if family["name"] == "threads":
                    family["arms"] = []
        self.assertEqual(listed, stored, "run tandem bench --list --json tests/records/patterns/families.json")

    def test_cost_reads_a_reference_that_was_rendered_before(self):
        reference, out = self.folder / "there.reference", self.folder / "cost.json"
        cost = ["cost", self.scene, "--size", "8", "--reference", reference, "--time", "4"]
        result = tandem(*cost, "--reference-only", "--json", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(out.read_text())
        before = reference.read_bytes()
        result = in_time(*cost, "--knob", "bounces", "--json", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(out.read_text())["reference"]["image"], told["image"])
        self.assertEqual(reference.read_bytes(), before)
        self.refused(tandem("cost", self.scene, "--size", "9", "--reference", reference, "--time", "4"),
                     "there.reference", "another scene, size")
        reference.write_text("rubbish")  # no cache, which would be done without
        self.refused(tandem(*cost, "--reference-only"), "there.reference")
        self.assertEqual(reference.read_text(), "rubbish")

    def test_cost_keeps_no_reference_where_the_cache_cannot_be_written(self):
        cost = ["cost", self.scene, "--size", "8", "--knob", "bounces", "--time", "4"]
        result = in_time(*cost, env=os.environ | {"XDG_CACHE_HOME": str(self.scene)})  # no folder
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("the cache of long references: ", result.stderr)
        self.assertIn("To 1 %: `tandem render", result.stdout)
        self.refused(tandem(*cost, "--references", self.scene / "references"), "references")

    def test_cost_tells_what_it_measured_where_its_samples_cannot_be_saved(self):
        kept, out = self.folder / "kept", self.folder / "cost.json"
        kept.mkdir()
        with subprocess.Popen([TANDEM, "cost", self.scene, "--size", "8", "--knob", "bounces", "--no-cache", "--time", "8",
                               "--resume", kept / "cost.samples", "--json", out],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            until(lambda: running.poll() is not None or (kept / "cost.samples").exists(), "samples are saved")
            shutil.rmtree(kept)
            kept.write_text("no folder")
            told, errors = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 2, errors)
        self.assertIn("cost.samples", errors)
        self.assertIn("To 1 %: `tandem render", told)
        self.assertGreater(len(json.loads(out.read_text())["arms"]), 1)

    def test_cost_measures_continues_and_refuses(self):
        out, samples = self.folder / "cost.json", self.folder / "cost.samples"
        arguments = ["cost", self.scene, "--size", "8", "--time", "4", "--knob", "bounces", "--references",
                     self.folder / "references", "--resume", samples, "--json", out]
        result = in_time(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("To 1 %: `tandem render", result.stdout)
        first = json.loads(out.read_text())
        self.assertEqual(first["backend"], "cpu")
        self.assertGreater(first["reference"]["samples"], 0)
        arms = {(arm["knob"], arm["setting"]): arm for arm in first["arms"]}
        baseline, one = arms["baseline", ""], arms["bounces", "1"]
        self.assertEqual([point["samples"] for point in baseline["points"]],
                         sorted(point["samples"] for point in baseline["points"]))
        self.assertEqual(one["options"], "--bounces 1")
        # A convex body under a constant sky: no path is longer than one event.
        self.assertFalse(one["bias_floor_significant"])
        self.assertEqual(len(list((self.folder / "references").iterdir())), 1)
        self.assertEqual(tandem(*arguments).returncode, 0)
        second = json.loads(out.read_text())
        self.assertGreater(second["seconds"], first["seconds"])
        self.assertEqual(second["reference"], first["reference"])
        self.refused(tandem(*arguments, "--bounces", "3"), "--resume")
        self.refused(tandem("cost", self.scene, "--knob", "magic"), "magic", "integrator")
        self.refused(tandem("cost", self.scene, "--device", "0"), "--device", "add --backend vulkan")
        self.refused(tandem(*arguments, "--knob", "integrator"), "--resume", "--knob")
        self.refused(tandem("cost", self.scene, "--resume", self.scene), "scene.json")
        self.refused(tandem("cost", self.folder / "none.json"), "none.json")
        listed = tandem("cost", self.scene, "--list")
        self.assertEqual(listed.returncode, 0)
        self.assertIn("--integrator next-event", listed.stdout)
        self.assertIn("--sampling adaptive", listed.stdout)
        self.assertIn("no triangles", listed.stdout)

    def test_what_cost_recommends_names_the_size_that_was_measured(self):
        for options, size in (([], "64"), (["--size", "8"], "8")):
            result = in_time("cost", self.scene, "--time", "4", "--knob", "bounces", "--no-cache", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(f"To 1 %: `tandem render {self.scene} -o scene.exr --size {size} ", result.stdout)
            typed = re.search("`(tandem render .*)`", result.stdout).group(1)
            typed = re.sub("--samples [0-9]+", "--samples 1", typed.replace("tandem", str(TANDEM), 1))
            rendered = subprocess.run(["sh", "-c", typed], cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(rendered.returncode, 0, rendered.stderr)
            self.assertTrue((self.folder / "scene.exr").exists())

    def test_cost_measures_a_scene_whose_lights_next_events_do_not_find(self):
        figures, whole_rays = self.folder / "cost.json", self.folder / "whole_rays.json"
        scene = json.loads((SCENES / "whitted.json").read_text())
        del scene["render"]["ray_min"], scene["render"]["ray_max"]
        whole_rays.write_text(json.dumps(scene))
        cost = ["--size", "8", "--time", "8", "--knob", "bounces", "--no-cache", "--json", figures]
        result = tandem("cost", whole_rays, *cost)
        self.assertIn(result.returncode, (0, 3), result.stderr)
        self.assertIn("--integrator bidirectional", json.loads(figures.read_text())["reference"]["options"])
        figures.unlink()
        for options in ([SCENES / "whitted.json"], [whole_rays, "--reference-backend", "vulkan"]):
            self.refused(tandem("cost", *options, *cost), "no long reference can be rendered", "translucent", "bidirectional: ")
            self.assertFalse(figures.exists())

    def test_cost_adds_what_its_settings_need_to_chosen_effects(self):
        figures = self.folder / "cost.json"
        result = tandem("cost", SCENES / "cornell-classic.json", "--size", "8", "--time", "8", "--knob", "integrator,roulette",
                        "--effects", "fuzz", "--no-cache", "--json", figures)
        self.assertIn(result.returncode, (0, 3), result.stderr)
        measured = [(arm["knob"], arm["setting"]) for arm in json.loads(figures.read_text())["arms"]]
        self.assertIn(("roulette", "4"), measured)
        self.assertIn(("integrator", "path"), measured)

    def test_cost_measures_adaptive_sampling_or_says_that_it_had_too_few_samples(self):
        figures = self.folder / "cost.json"

        def told(*options):
            result = tandem("cost", self.scene, "--knob", "sampling", "--no-cache", "--json", figures, *options)
            self.assertIn(result.returncode, (0, 3), result.stderr)  # 3: one sample is too slow
            report = json.loads(figures.read_text())
            return ({(arm["knob"], arm["setting"]): arm for arm in report["arms"]},
                    {(arm["knob"], arm["setting"]): arm["reason"] for arm in report["not_measured"]})

        arms, _ = told("--size", "8", "--time", "4")
        self.assertEqual(arms["sampling", "adaptive"]["options"], "--sampling adaptive")
        self.assertFalse(arms["sampling", "adaptive"]["bias_floor_significant"])
        self.assertGreater(arms["sampling", "adaptive"]["points"][-1]["samples"], 128)
        # On lavapipe a submission of one sample takes milliseconds, more or fewer.
        arms, not_measured = told("--size", "32", "--time", "8", "--backend", "vulkan")
        if ("sampling", "adaptive") in arms:
            self.assertGreater(arms["sampling", "adaptive"]["points"][-1]["samples"], 128)
        else:
            self.assertRegex(not_measured["sampling", "adaptive"], "up to 128 adaptive sampling is uniform|too slow")


if __name__ == "__main__":
    unittest.main()
