# The program as a user meets it: exit statuses, one clear line for every bad input, nothing half written, Ctrl-C keeps what
# was rendered, and the JSON that others script against. Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import os
import pathlib
import random
import re
import signal
import struct
import subprocess
import sys
import time
import unittest
import zlib
from xml.etree import ElementTree

from program import SCENES, SPHERE, TANDEM, ProgramTest, tandem


class Commands(ProgramTest):
    def closed_box(self):
        """A room that no path gets out of, and that nothing is absorbed in."""
        return self.write({
            "camera": {"position": [0.1, 0.2, 0.3], "target": [1, 0.4, -0.3], "vertical_field_degrees": 70},
            "materials": {"white": {"kind": "diffuse", "colour": [1, 1, 1]}, "lamp": {"kind": "emissive", "radiance": [1, 1, 1]}},
            "entities": [{"material": "white", "primitives": [{"cuboid": {"minimum": [-1, -1, -1], "maximum": [1, 1, 1]}}]},
                         {"material": "lamp", "primitives": [{"sphere": {"centre": [0.5, 0.5, 0.5], "radius": 0.001}}]}]},
            "box.json")

    def render_refused(self, scene, *mentions):
        output = self.folder / "out.exr"
        self.refused(tandem("render", scene, "-o", output, "--json", self.folder / "out.json"), *mentions)
        self.assertEqual(self.left_behind(), [])

    def test_what_is_lost_of_a_models_materials_is_said_once(self):
        (self.folder / "m.mtl").write_text("newmtl m\nKd 0.5 0.5 0.5\nKs 1 1 1\nmap_Bump b.png\n")
        (self.folder / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
        models = [{"obj": {"file": "m.obj"}}] * 2
        scene = self.changed("/entities", [{"primitives": models}])
        result = tandem("render", scene, "-o", self.folder / "out.pfm", "--samples", 4)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count("m.obj is rendered without Ks beside Kd, map_Bump"), 1, result.stderr)

    def test_bad_scenes_get_one_line_with_file_and_pointer(self):
        name = "changed.json"
        for pointer, value, mentions in [
            ("/entities/0/material", "gold", [name, "/entities/0/material", "gold"]),
            ("/camera/target", [0, 0, 4], [name, "/camera"]),
            ("/camera/up", [0, 0, 1], [name, "/camera"]),
            ("/camera/vertical_field_degrees", 180, [name, "/camera/vertical_field_degrees"]),
            ("/materials/grey/colour", [0.5, 0.5, 1.5], [name, "/materials/grey/colour"]),
            ("/film/width", 0, [name, "/film/width"]),
            ("/colour", 1, [name, "colour"]),
            ("/entities/0/transform", [{"scale": [1, 0, 1]}], [name, "/entities/0/transform"]),
            ("/entities/0/primitives", [{"obj": "none.obj"}], [name, "none.obj"]),
        ]:
            with self.subTest(pointer=pointer):
                self.render_refused(self.changed(pointer, value), *mentions)

    def test_files_that_are_no_scene_are_refused(self):
        self.render_refused(self.folder / "absent.json", "absent.json")
        self.render_refused(self.write("{\"film\": ", "broken.json"), "broken.json")
        nan = json.dumps(SPHERE).replace("\"radius\": 1", "\"radius\": NaN")
        self.render_refused(self.write(nan, "nan.json"), "nan.json")
        huge = json.dumps(SPHERE).replace("\"radius\": 1", "\"radius\": 1e999")
        self.render_refused(self.write(huge, "huge.json"), "huge.json")
        matrix = [{"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, "nan"]}]
        self.render_refused(self.changed("/entities/0/transform", matrix), "/entities/0/transform")

    def test_a_misspelt_shipped_scene_is_named(self):
        self.render_refused("glas", "glas: no such file; did you mean glass?")
        self.render_refused("scenes/cornel-classic.json", "did you mean cornell-classic?")

    def test_judges_of_one_seed_are_refused_before_they_speak(self):
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for image, samples in zip(images, (4, 8)):
            self.assertEqual(tandem("render", self.scene, "-o", image, "--samples", samples).returncode, 0)
        result = tandem("judges", *images)
        self.refused(result, "was made with seed")
        self.assertEqual(result.stdout, "")

    def test_bad_arguments_are_refused(self):
        out = self.folder / "out.exr"
        for arguments, mention in [
            (["render", self.scene], "--output"),
            (["render", self.scene, "-o", out, "--backend", "gpu"], "gpu"),
            (["render", self.scene, "-o", out, "--samples", "0"], "--samples"),
            (["render", self.scene, "-o", out, "--size", "0x5"], "--size"),
            (["render", self.scene, "-o", out, "--size", "wide"], "--size"),
            (["render", self.scene, "-o", out, "--target-error", "-1%"], "--target-error"),
            (["render", self.scene, "-o", out, "--precision", "half"], "--precision"),
            (["render", self.scene, "-o", self.folder / "out.xyz"], "out.xyz"),
            (["render", self.scene, "-o", self.folder / "none" / "out.exr"], "none"),
            (["render", self.scene, "-o", out, "--json", self.folder / "none" / "a.json"], "none"),
            (["render", self.scene, "-o", out, "--backend", "vulkan", "--precision", "double", "--kernel", "stages"],
             "--kernel"),
            (["render", self.scene, "-o", out, "--backend", "cpu", "--device", "0"], "device"),
            (["render", self.scene, "-o", out, "--backend", "cpu", "--kernel", "stages"], "--kernel"),
            (["render", self.scene, "-o", out, "--backend", "vulkan", "--kernel", "octopus"], "octopus"),
            (["render", self.scene, "-o", out, "--seed", "-1"], "--seed"),
            (["render", self.scene, "-o", out, "--seed", "18446744073709551616"], "--seed"),
            (["render", self.scene, "-o", out, "--time", "nan"], "--time"),
            (["render", self.scene, "-o", out, "--time", "1e300"], "--time"),
            (["render", self.scene, "-o", out, "--exposure", "inf"], "--exposure"),
            (["render", self.scene, "-o", out, "--threads", "4294967295"], "--threads"),
            (["render", self.scene, "-o", out, "--size", "65536x65535"], "memory"),
            (["render", self.scene, "-o", "/proc/out.exr"], "/proc/out.exr"),
            (["render", self.scene, "-o", out, "--json", "/proc/out.json"], "/proc/out.json"),
            (["verify", self.scene, "--time", "nan"], "--time"),
            (["verify", self.scene, "--tile-margin", "nan"], "--tile-margin"),
            (["verify", self.scene, "--size", "65536x65535"], "memory"),
            (["verify", self.scene, "--json", "/proc/out.json"], "/proc/out.json"),
            (["paint"], ""),
            ([], ""),
        ]:
            with self.subTest(arguments=arguments):
                self.refused(tandem(*arguments), mention)
                self.assertEqual(self.left_behind(), [])

    def test_the_smallest_of_everything_renders(self):
        for backend in ["cpu", "vulkan", "oracle"]:
            for arguments in [["--size", "1x1", "--samples", 1], ["--bounces", 0, "--samples", 1], ["--time", 0.01]]:
                with self.subTest(backend=backend, arguments=arguments):
                    out = self.folder / "out.exr"
                    result = tandem("render", self.scene, "-o", out, "--backend", backend, *arguments)
                    if "--time" in arguments and result.returncode == 3:  # a busy machine
                        self.refused(result, "do not suffice", status=3)
                        self.assertFalse(out.exists())
                        continue
                    self.assertEqual(result.returncode, 0, result.stderr)
                    out.unlink()

    def test_a_scene_without_entities_shows_its_background(self):
        empty = self.changed("/entities", [])
        for backend in ["cpu", "vulkan", "oracle"]:
            with self.subTest(backend=backend):
                result = tandem("render", empty, "-o", self.folder / "out.png", "--backend", backend, "--samples", 4)
                self.assertEqual(result.returncode, 0, result.stderr)

    def test_an_error_of_a_black_image_is_undecided(self):
        result = tandem("render", self.changed("/background", [0, 0, 0]), "-o", self.folder / "out.exr", "--target-error", "1%")
        self.refused(result, "black", status=3)
        self.assertTrue((self.folder / "out.exr").exists())

    def test_endings_in_capitals_choose_the_format(self):
        out = self.folder / "X.PNG"
        self.assertEqual(tandem("render", self.scene, "--samples", "1", "-o", out).returncode, 0)
        self.assertEqual(out.read_bytes()[:4], b"\x89PNG")

    def test_bare_numbers_of_1_and_more_are_no_fractions(self):
        for option, command in (("--margin", "verify"), ("--target-error", "render")):
            output = ["-o", self.folder / "out.exr"] if command == "render" else []
            self.refused(tandem(command, self.scene, option, "5", *output), option, "write 5% or 500%")

    def test_interrupted_verify_is_undecided_and_says_so_in_its_json(self):
        figures = self.folder / "out.json"
        with subprocess.Popen([TANDEM, "verify", SCENES / "cornell-classic.json", self.scene, "--margin", "1e-9", "--json",
                               figures], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            time.sleep(3.0)
            running.send_signal(signal.SIGINT)
            _, errors = running.communicate(timeout=100)
            self.assertEqual(running.returncode, 3, errors)
        report = json.loads(figures.read_text())
        self.assertEqual(report["verdict"], "undecided")
        self.assertEqual(len(report["scenes"]), 1)

    def test_a_scene_that_fails_leaves_the_verdicts_of_the_others(self):
        figures = self.folder / "out.json"
        result = tandem("verify", SCENES / "cornell-classic.json", SCENES / "fog.json", "--reference", "cpu", "--candidate", "cpu",
                        "--integrator", "bidirectional", "--size", "8", "--time", "2", "--json", figures)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("medium-absorption", result.stderr)
        report = json.loads(figures.read_text())
        self.assertEqual((len(report["scenes"]), report["not_run"], report["verdict"]), (1, ["fog"], "undecided"))

    def test_an_unknown_vulkan_device_is_status_4(self):
        result = tandem("render", self.scene, "-o", self.folder / "out.exr", "--backend", "vulkan", "--device", "no such")
        self.refused(result, "no such", status=4)
        self.assertEqual(self.left_behind(), [])

    def test_without_a_vulkan_driver_the_status_is_4(self):
        result = tandem("render", self.scene, "-o", self.folder / "out.exr", "--backend", "vulkan",
                        env={**os.environ, "VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"})
        self.refused(result, status=4)
        self.assertEqual(self.left_behind(), [])

    def test_render_writes_the_promised_json_and_a_whole_image(self):
        for backend in ["cpu", "vulkan", "oracle"]:
            with self.subTest(backend=backend):
                out, figures = self.folder / f"{backend}.exr", self.folder / "out.json"
                result = tandem("render", self.scene, "-o", out, "--backend", backend, "--samples", 70, "--json", figures)
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads(figures.read_text())
                for key in ["seconds", "paths", "paths_per_second", "samples", "width", "height", "backend", "device"]:
                    self.assertIn(key, report)
                self.assertEqual((report["samples"], report["width"], report["paths"]), (70, 16, 70 * 256))
                self.assertGreater(out.stat().st_size, 16 * 16 * 4)

    def test_target_error_is_met(self):
        figures = self.folder / "out.json"
        result = tandem("render", self.scene, "-o", self.folder / "out.png", "--target-error", "1%", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertLessEqual(json.loads(figures.read_text())["relative_error"], 0.01)

    def test_target_error_chooses_what_is_left_open_and_says_its_interval(self):
        figures = self.folder / "out.json"
        arguments = ["render", SCENES / "cornell-classic.json", "--size", "16", "-o", self.folder / "out.pfm",
                     "--target-error", "30%", "--time", "20", "--json", figures]
        result = tandem(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(figures.read_text())
        self.assertLessEqual(told["relative_error"], 0.3)
        self.assertLess(told["relative_error_low"], told["relative_error"])
        self.assertGreater(told["relative_error_high"], told["relative_error"])
        if told["integrator"] != "next-event" or "roulette" in told:
            self.assertIn("settings chosen for the target error: --", result.stdout)
        result = tandem(*arguments, "--integrator", "path", "--roulette", "0", "--sampling", "uniform",
                        "--generator", "philox")
        self.assertEqual(result.returncode, 0, result.stderr)
        fixed = json.loads(figures.read_text())
        self.assertEqual((fixed["integrator"], fixed["generator"]), ("path", "philox"))
        self.assertNotIn("settings chosen", result.stdout)
        self.assertNotIn("trials", fixed)
        self.assertEqual(sum(trial["chosen"] for trial in told["trials"]), 1)
        self.assertGreater(told["trial_seconds"], 0)

    def test_trials_of_scenes_without_noise_are_told_in_words(self):
        result = tandem("render", SCENES / "furnace.json", "-o", self.folder / "out.pfm", "--size", "8", "--target-error", "1%",
                        "-v")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("tried the scene's own settings: no noise, chosen", result.stderr)
        self.assertNotIn("nan", result.stderr)

    def test_a_target_error_does_not_bring_mis_back(self):
        figures = self.folder / "out.json"
        # A ball under an even sky: paths have next to no noise, next events without MIS have.
        result = tandem("render", self.changed("/render", {"integrator": "next-event"}), "-o", self.folder / "out.pfm",
                        "--target-error", "5%", "--mis", "off", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(figures.read_text())["integrator"], "next-event")

    def test_mis_can_be_left_out_of_next_events_alone(self):
        figures = self.folder / "out.json"
        render = ["render", SCENES / "cornell-classic.json", "-o", self.folder / "out.exr", "--size", "16", "--json",
                  figures, "--mis", "off"]
        self.refused(tandem(*render, "--integrator", "path"), "--mis off", "--integrator next-event")
        for backend in ["cpu", "vulkan"]:
            self.assertEqual(tandem(*render, "--integrator", "next-event", "--backend", backend).returncode, 0)
            self.assertIs(json.loads(figures.read_text())["mis"], False)

    def test_accumulation_is_a_setting_of_both_backends(self):
        figures = self.folder / "out.json"
        render = ["render", self.scene, "-o", self.folder / "out.exr", "--size", "8", "--json", figures]
        for backend in ["cpu", "vulkan"]:
            for accumulation in ["", "plain", "compensated", "double"]:
                chosen = ["--accumulation", accumulation] if accumulation else []
                result = tandem(*render, "--backend", backend, *chosen)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(json.loads(figures.read_text())["accumulation"], accumulation or "double")
        self.refused(tandem(*render, "--backend", "oracle", "--accumulation", "plain"), "oracle", "--accumulation")
        self.refused(tandem(*render, "--accumulation", "kahan"), "--accumulation")

    def test_adaptive_sampling_is_a_setting_of_both_backends(self):
        figures, out = self.folder / "out.json", self.folder / "out.exr"
        render = ["render", SCENES / "cornell-classic.json", "-o", out, "--size", "24", "--integrator", "next-event", "--json",
                  figures, "--sampling", "adaptive"]
        for backend in ["cpu", "vulkan"]:
            result = tandem(*render, "--samples", "192", "--backend", backend)
            self.assertEqual(result.returncode, 0, result.stderr)
            told = json.loads(figures.read_text())
            self.assertEqual((told["sampling"], told["samples"]), ("adaptive", 192))
            self.assertAlmostEqual(told["paths"] / (192 * told["width"] * told["height"]), 1.0, places=2)
            self.assertGreaterEqual(told["samples_least"], 192 / 4)
            self.assertLess(told["samples_least"], 192)
            self.assertGreater(told["samples_most"], 2 * 192)
            self.assertIn(f"192 ({told['samples_least']} to {told['samples_most']}) samples a pixel", result.stdout)
        result = tandem(*render, "--target-error", "20%")
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(figures.read_text())
        self.assertLessEqual(told["relative_error"], 0.2)
        self.assertGreater(told["samples_most"], told["samples_least"])
        self.assertLess(told["relative_error_low"], told["relative_error"])
        # Counts that differ are no obstacle to comparing.
        other = self.folder / "other.exr"
        tandem("render", SCENES / "cornell-classic.json", "-o", other, "--size", "24", "--integrator", "next-event", "--samples",
               "512", "--seed", "3")
        self.assertIn(tandem("compare", out, "vs", other).returncode, [0, 3])

    def test_adaptive_sampling_is_refused_with_the_reason_where_it_is_not_to_be_had(self):
        render = ["render", self.scene, "-o", self.folder / "out.exr", "--sampling", "adaptive"]
        self.refused(tandem(*render, "--generator", "sobol"), "Sobol")
        self.refused(tandem(*render, "--integrator", "bidirectional"), "bidirectional")
        self.refused(tandem(*render, "--accumulation", "plain"), "plain")
        self.refused(tandem(*render, "--backend", "oracle"), "oracle", "--sampling")
        self.refused(tandem(*render, "--backend", "vulkan", "--kernel", "fragment"), "--kernel")
        for command in [["verify", self.scene], ["effects", self.scene], ["trace", self.scene, "--pixel", "0,0"]]:
            self.refused(tandem(*command, "--sampling", "adaptive"), "--sampling", "render and cost")

    def test_sobol_samples_tell_an_error_by_scramblings_and_none_by_their_scatter(self):
        figures = self.folder / "out.json"
        render = ["render", self.scene, "-o", self.folder / "out.exr", "--generator", "sobol", "--json", figures]
        for how in (["--target-error", "1%"], ["--time", "0.5"]):
            result = tandem(*render, *how)
            self.assertEqual(result.returncode, 0, result.stderr)
            told = json.loads(figures.read_text())
            self.assertEqual((told["generator"], told["scramblings"]), ("sobol", 8))
            self.assertLessEqual(told["relative_error_low"], told["relative_error"])
            self.assertLessEqual(told["relative_error"], told["relative_error_high"])
            self.assertIn("% of the mean (", result.stdout)
        self.assertEqual(tandem(*render).returncode, 0)
        told = json.loads(figures.read_text())
        self.assertFalse({"relative_error", "relative_error_low", "scramblings"} & told.keys())
        # Without variances one image is no evidence of anything; several scramblings are.
        self.refused(tandem("compare", self.folder / "out.exr", "vs", self.folder / "out.exr"), "out.exr")

    def test_what_compare_calls_negligible_is_an_option(self):
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for seed, image in enumerate(images):
            tandem("render", self.scene, "-o", image, "--seed", seed)
        figures = self.folder / "out.json"
        tandem("compare", *images, "--negligible", "0.01%", "--tile-negligible", "0.002", "--json", figures)
        criteria = json.loads(figures.read_text())["scenes"][0]["criteria"]
        self.assertAlmostEqual(criteria["negligible_image_relative"], 1e-4)
        self.assertAlmostEqual(criteria["negligible_tile_relative"], 2e-3)
        self.refused(tandem("compare", *images, "--negligible", "-1"), "--negligible")

    def test_time_is_kept_where_paths_never_end(self):
        box = self.closed_box()
        # Millions of paths of thousands of segments, or a few of a million: each took minutes.
        for backend in ("cpu", "vulkan", "oracle"):
            for size, bounces in (("512x512", "4096"), ("8x8", "1000000")):
                with self.subTest(backend=backend, size=size):
                    start = time.monotonic()
                    result = tandem("render", box, "-o", self.folder / "out.exr", "--backend", backend, "--size", size,
                                    "--bounces", bounces, "--time", "1")
                    self.refused(result, "--time: 1 s do not suffice for a sample of every pixel", status=3)
                    # 1.55 s, and what a loaded machine adds.
                    self.assertLess(time.monotonic() - start, 8.0)
                    self.assertFalse((self.folder / "out.exr").exists())

    def test_time_is_kept_by_every_command_that_has_it_and_what_was_not_done_is_said(self):
        box, figures = self.closed_box(), self.folder / "out.json"
        # Each planned a least amount of work, which took 20 to 300 s.
        for command, not_done in ((["cost", box, "--no-cache"], "before there was a reference"),
                                  (["cost", SCENES / "cornell-classic.json", "--no-cache", "--backend", "vulkan"], ""),
                                  (["effects", SCENES / "cornell-classic.json"], "timed"),
                                  (["effects", box, "--size", "4096", "--backend", "cpu"], "timed"),
                                  (["bench", "--scene", box], "arms were not measured"),
                                  (["stability", "--catalogue", SCENES / "hard" / "catalogue.json"], "arms were not run")):
            with self.subTest(command=" ".join(map(str, command))):
                figures.unlink(missing_ok=True)
                start = time.monotonic()
                result = tandem(*command, "--time", "3", "--json", figures)
                self.assertLess(time.monotonic() - start, 10.0)  # 4.3 s, and what a loaded machine adds
                self.refused(result, "--time: 3 s are too short: ", not_done, status=3)
                if figures.exists():  # what is there is what was measured
                    self.assertIsInstance(json.loads(figures.read_text()), dict)
        told = json.loads(figures.read_text())  # of stability
        self.assertFalse(told["complete"])
        self.assertGreater(told["arms_not_run"], 0)
        self.assertGreater(len(told["cases"]), 0)

    def test_effects_without_time_for_kernels_tells_what_the_scene_calls_for(self):
        figures = self.folder / "out.json"
        result = tandem("effects", SCENES / "cornell-classic.json", "--time", "0.01", "--json", figures)
        self.refused(result, "--time: 0.01 s are too short: ", "timed", status=3)
        told = json.loads(figures.read_text())
        self.assertIn("diffuse", {finding["effect"] for finding in told["needed"]})
        self.assertEqual(told["rounds"], 0)
        self.assertNotIn("speedup", told)

    def test_an_interrupt_ends_every_command_soon_where_paths_never_end(self):
        box = self.closed_box()
        long = ["--size", "256", "--bounces", "100000"]
        for command in (["render", box, "-o", self.folder / "out.exr", *long, "--backend", "vulkan"],
                        ["render", box, "-o", self.folder / "out.exr", *long, "--integrator", "bidirectional"],
                        ["verify", box, *long], ["cost", box, *long, "--no-cache"], ["effects", box, *long],
                        ["trace", box, "--pixel", "3,3", "--backends", "oracle", "--bounces", "1000000"],
                        ["bench", "--scene", box, "--size", "256x256"], ["stability"]):
            with self.subTest(command=" ".join(map(str, command))):
                with subprocess.Popen([TANDEM, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
                    time.sleep(1.5)
                    start = time.monotonic()
                    running.send_signal(signal.SIGINT)
                    try:
                        running.communicate(timeout=20)
                        self.assertLess(time.monotonic() - start, 8.0)  # 2 s, and what a loaded machine adds
                    finally:
                        running.kill()

    def test_interrupt_keeps_what_was_rendered(self):
        out, figures = self.folder / "out.exr", self.folder / "out.json"
        for sampling in ["uniform", "adaptive"]:
            with subprocess.Popen([TANDEM, "render", SCENES / "cornell-classic.json", "-o", out, "--size", "64", "--samples",
                                   "1000000", "--sampling", sampling, "--json", figures], stderr=subprocess.PIPE,
                                  text=True) as running:
                time.sleep(2.0)
                for _ in range(2):  # as timeout(1) does, to the process and to its group
                    running.send_signal(signal.SIGTERM)
                    time.sleep(0.2)
                self.assertEqual(running.wait(timeout=30), 0, running.stderr.read())
            report = json.loads(figures.read_text())
            self.assertFalse(report["complete"])
            self.assertGreater(report["samples"], 0)
            self.assertTrue(out.exists())
            out.unlink()

    def test_wrong_arguments_say_what_is_wrong_and_where_to_read(self):
        self.refused(tandem(), "no command is named; there are render, view, verify")
        self.refused(tandem("rendr", self.scene), "'rendr' is no command; there are render, view, verify")
        self.refused(tandem("render"), "see tandem render --help")
        for samples in ["0", "-3", "abc", "1.5", "1e3"]:
            self.refused(tandem("render", self.scene, "-o", self.folder / "a.png", "--samples", samples),
                         f"--samples: '{samples}' is no whole number from 1 to")
        self.refused(tandem("effects", self.scene, "--backend", "oracle"), "--backend")

    def test_what_image_libraries_print_is_no_second_line(self):
        image = self.folder / "sky.png"
        image.write_bytes((pathlib.Path(__file__).parent.parent / "fuzz/corpus/image/bad-header.png").read_bytes())
        scene = json.loads((SCENES / "furnace.json").read_text())
        scene["background"] = {"image": "sky.png", "colour_space": "srgb"}
        file = self.folder / "sky.json"
        file.write_text(json.dumps(scene))
        self.refused(tandem("render", file, "-o", self.folder / "a.pfm"), "sky.png: is no readable image")

    def test_devices_are_tested_on_demand(self):
        figures = self.folder / "devices.json"
        result = tandem("devices", "--self-test", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("passed: nothing beyond what Vulkan allows", result.stdout)
        for device in json.loads(figures.read_text())["devices"]:
            if not device["suitable"]:
                continue
            test = device["self_test"]
            self.assertTrue(test["passed"])
            self.assertEqual(len(test["functions"]), 13)
            for function in test["functions"]:
                self.assertIn(f"\n{function['function']:<12} ", result.stdout)

    def test_devices_lists_at_least_one(self):
        figures = self.folder / "devices.json"
        result = tandem("devices", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreaterEqual(len(json.loads(figures.read_text())["devices"]), 1)

    def test_verify_agrees_with_the_promised_json(self):
        figures = self.folder / "out.json"
        result = tandem("verify", self.scene, "--json", figures, "--time", 60)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        report = json.loads(figures.read_text())
        self.assertEqual(report["verdict"], "agree")
        self.assertEqual(set(report["device"]), {"name", "driver", "api"})
        for key in ["scene", "verdict", "relative_difference", "relative_difference_low", "relative_difference_high",
                    "margin_relative", "worst_tile_relative", "samples_reference", "samples_candidate",
                    "seconds_reference", "seconds_candidate", "minimum_detectable_relative"]:
            self.assertIn(key, report["scenes"][0])

    def test_a_total_time_is_kept_and_what_is_undecided_has_a_forecast(self):
        figures, report = self.folder / "out.json", self.folder / "out.xml"
        noisy = ["verify", SCENES / "cornell-classic.json", self.scene, "--size", "16", "--margin", "1e-6", "--json", figures,
                 "--junit", report]
        began = time.monotonic()
        result = tandem(*noisy, "--total-time", "12s")
        took = time.monotonic() - began
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertLess(took, 1.1 * 12 + 3.0)  # what comes before: devices, scenes, self-tests
        scenes = json.loads(figures.read_text())["scenes"]
        self.assertEqual(len(scenes), 2)
        # On a machine under load a scene may have had no look, and no forecast then.
        told = [scene["forecast_seconds"] for scene in scenes if scene["looks"]]
        self.assertTrue(told, result.stdout)
        for forecast in told:
            self.assertGreater(forecast, 12)
        needs = r"they need about .* more: --total-time \d+min" if len(told) == 2 else "some need more than can be foretold"
        self.assertRegex(result.stdout, "of 2 scenes are undecided after .*; " + needs)
        self.assertIn("(margin 0.00010 %)", result.stdout)
        self.refused(tandem(*noisy, "--total-time", "8 parsec"), "write 600, 90s, 10min or 2h")
        self.refused(tandem(*noisy, "--total-time", "8s", "--convergence"), "--convergence")

    def test_each_scene_is_looked_at_under_the_validation_layer_where_there_is_one(self):
        figures = self.folder / "out.json"
        short = ["verify", self.scene, "--oracle", "none", "--json", figures]
        result = tandem(*short, "--time", "20")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("Validation layer: 1 scene without a message", result.stdout)
        self.assertEqual(json.loads(figures.read_text())["validation_layer"], [])
        result = tandem(*short, "--time", "20", env={**os.environ, "VK_LAYER_PATH": "/nonexistent"})
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("not used: validation was asked for, but VK_LAYER_KHRONOS_validation is not installed", result.stdout)
        self.assertIn("1 left out as their time is short", tandem(*short, "--time", "5").stdout)
        self.assertNotIn("Validation layer", tandem(*short, "--time", "20", "--no-layer").stdout)

    def test_a_preset_has_its_scenes_and_names_may_take_their_place(self):
        self.refused(tandem("verify"), "--preset: smoke, driver or full")
        figures = self.folder / "out.json"
        (self.folder / "scenes").symlink_to(SCENES)
        # So little time that each scene has one turn at most: which scenes they are is what is asked.
        result = tandem("verify", "--preset", "driver", "--total-time", "2s", "--oracle", "none", "--json", figures, cwd=self.folder)
        told = json.loads(figures.read_text())
        self.assertEqual(len(told["scenes"]) + len(told["not_run"]), len(list(SCENES.glob("*.json"))), result.stderr)
        result = tandem("verify", self.scene, "--preset", "smoke", "--total-time", "20s", "--json", figures, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(len(json.loads(figures.read_text())["scenes"]), 1)

    def test_compare_tells_same_from_brighter(self):
        brighter = self.changed("/background", [0.51, 0.51, 0.51])
        for name, scene, seed in [("a", self.scene, 1), ("b", self.scene, 2), ("c", brighter, 3)]:
            result = tandem("render", scene, "-o", self.folder / f"{name}.exr", "--samples", 4096, "--seed", seed)
            self.assertEqual(result.returncode, 0, result.stderr)
        same = tandem("compare", self.folder / "a.exr", self.folder / "b.exr")
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        other = tandem("compare", self.folder / "a.exr", self.folder / "c.exr")
        self.assertEqual(other.returncode, 1, other.stdout + other.stderr)
        lines = other.stdout.splitlines()
        reason = re.search(r"disagree: (.*?)(;|$)", lines[0])[1]
        self.assertEqual(other.stdout.count(reason), 1, other.stdout)  # in the sentence alone
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "a.exr"), "the same file")

    def test_png_of_16_bits_is_decoded_and_a_gamma_is_taken_from_the_file(self):
        def png(name, seed, gamma=None):
            """32x32 pixels of 0.5, give or take a hundredth, as encoded values of 16 bits."""
            noise, side = random.Random(seed), 32
            rows = b"".join(b"\0" + b"".join(struct.pack(">H", round(65535 * noise.gauss(0.5, 0.01))) for _ in range(3 * side))
                            for _ in range(side))
            chunks = [(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 2, 0, 0, 0))]
            chunks += [(b"gAMA", struct.pack(">I", round(100000 / gamma)))] if gamma else []
            chunks += [(b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
            path = self.folder / name
            path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
                struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks))
            return path

        a, b, c = ([png(f"{name}{k}.png", f"{name}{k}", gamma) for k in range(3)]
                   for name, gamma in (("a", None), ("b", None), ("c", 1.8)))
        same = tandem("compare", *a, "vs", *b)
        self.assertEqual(same.returncode, 0, same.stdout + same.stderr)
        self.assertIn("values of 16 bits are decoded to linear light from sRGB", same.stdout)
        other = tandem("compare", *a, "vs", *c, "--json", self.folder / "out.json")
        self.assertEqual(other.returncode, 1, other.stdout + other.stderr)  # 0.5^1.8 is more than 0.214
        self.assertIn("from a gamma of 1.8", other.stdout)
        scene = json.loads((self.folder / "out.json").read_text())["scenes"][0]
        self.assertAlmostEqual(scene["relative_difference"], 0.5**1.8 / 0.21404 - 1, delta=0.01)

    def test_variances_are_said_of_a_side_and_the_old_option_holds_for_both(self):
        for name in ("a", "b"):
            tandem("render", self.scene, "-o", self.folder / f"{name}.exr", "--samples", 256, "--seed", ord(name))
        images = [self.folder / "a.exr", self.folder / "b.exr"]
        for options in (["--variance-of-a", "sample"], ["--variance-of-a", "mean", "--variance-of-b", "sample"]):
            result = tandem("compare", *images, *options)
            self.assertIn(result.returncode, [0, 1, 3], result.stderr)
            self.assertEqual(result.stderr, "")
        self.assertIn("holds for both sides", tandem("compare", *images, "--variance-of", "sample").stderr)
        self.refused(tandem("compare", *images, "--variance-of-b", "median"), "--variance-of-b")

    def test_a_scene_without_light_is_undecided(self):
        dark = self.changed("/background", [0, 0, 0])
        result = tandem("verify", dark, "--size", "8", "--samples", 256, "--time", 20, "--candidate", "oracle", "--oracle", "none")
        self.assertEqual(result.returncode, 3, result.stdout + result.stderr)
        self.assertIn("both are black, so nothing was compared", result.stdout)

    def test_compare_refuses_images_that_do_not_match(self):
        for name, size in [("a", 16), ("b", 24)]:
            tandem("render", self.scene, "-o", self.folder / f"{name}.exr", "--size", size)
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "b.exr"), "16", "24")
        self.refused(tandem("compare", self.folder / "a.exr", self.folder / "missing.exr"), "missing.exr")
        self.refused(tandem("compare", self.folder / "a.exr", self.scene), "scene.json")

    def junit(self, path):
        """The one testsuite, its attributes and testcases, as a parser sees them."""
        root = ElementTree.parse(path).getroot()
        self.assertEqual(root.tag, "testsuites")
        suite, = root
        return suite.attrib, suite.findall("testcase")

    def test_verify_writes_junit_with_the_outvoted_side(self):
        closed = self.changed("/expect", {"radiance": [0.6, 0.6, 0.6], "formula": "a < b & \"c\""})
        report, figures = self.folder / "junit.xml", self.folder / "out.json"
        result = tandem("verify", self.scene, closed, "--junit", report, "--json", figures, "--time", 20)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        suite, (good, bad) = self.junit(report)
        self.assertEqual((suite["tests"], suite["failures"], suite["errors"]), ("2", "1", "0"))
        self.assertEqual((good.get("name"), bad.get("name")), ("scene", "changed"))
        self.assertIsNone(good.find("failure"))
        # Both backends miss this closed form, which is none; the oracle, too.
        message = bad.find("failure").get("message")
        self.assertIn("the closed form a < b & \"c\" sides with neither", message)
        self.assertIn("the oracle contradicts neither, and misses the closed form too", message)
        self.assertIn("closed form, candidate", bad.find("failure").text)
        self.assertEqual(json.loads(figures.read_text())["scenes"][1]["outvoted"], "both")

    def test_undecided_scenes_are_errors_in_junit(self):
        report = self.folder / "junit.xml"
        result = tandem("verify", self.scene, "--junit", report, "--margin", "1e-9", "--samples", 128)
        self.assertEqual(result.returncode, 3, result.stderr)
        suite, (case,) = self.junit(report)
        self.assertEqual(suite["errors"], "1")
        self.assertEqual(case.find("error").get("type"), "undecided")

    def test_compare_writes_junit(self):
        brighter = self.changed("/background", [0.51, 0.51, 0.51])
        for name, scene, seed in [("a", self.scene, 1), ("b", brighter, 2)]:
            tandem("render", scene, "-o", self.folder / f"{name}.exr", "--samples", 1024, "--seed", seed)
        report = self.folder / "junit.xml"
        result = tandem("compare", self.folder / "a.exr", self.folder / "b.exr", "--junit", report)
        self.assertEqual(result.returncode, 1, result.stderr)
        _, (case,) = self.junit(report)
        self.assertIsNotNone(case.find("failure"))

    def test_a_closed_form_that_does_not_hold_is_left_out_with_the_reason(self):
        result = tandem("verify", SCENES / "furnace.json", "--bounces", 3, "--time", 30)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("closed form is left out: it holds at 12 bounces, not at 3", result.stdout)

    def test_the_oracle_can_be_left_out(self):
        wrong = self.changed("/expect", {"radiance": [0.6, 0.6, 0.6], "formula": "no"})
        result = tandem("verify", wrong, "--oracle", "none", "--time", 20)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertNotIn("oracle", result.stdout)
        self.refused(tandem("verify", wrong, "--oracle", "nobody"), "nobody")

    def test_a_refused_verify_leaves_no_report_folder(self):
        report = self.folder / "report"
        self.refused(tandem("verify", self.scene, "--candidate", "nobody", "--report", report), "nobody")
        self.refused(tandem("compare", "absent.exr", "vs", "absent.exr", "--report", report), "absent.exr")
        self.assertFalse(report.exists())

    def test_general_kernels_give_the_same_image(self):
        images = []
        for effects in ["needed", "all"]:
            output = self.folder / f"{effects}.png"
            self.assertEqual(tandem("render", self.scene, "-o", output, "--effects", effects).returncode, 0)
            images.append(output.read_bytes())
        self.assertEqual(*images)

    def test_effects_tells_the_needed_and_the_absent(self):
        report = self.folder / "effects.json"
        result = tandem("effects", self.scene, "--backend", "cpu", "--time", 3, "--json", report)
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
        self.assertEqual(len(told["specialised"]["kernel_seconds_each"]), 2)
        self.assertGreater(told["general"]["kernel_seconds"], 0)
        self.assertIn("lower bound where the driver keeps kernels", result.stdout)

    def test_unknown_effects_are_refused_with_the_known_ones(self):
        self.refused(tandem("render", self.scene, "-o", self.folder / "a.png", "--effects", "lens,magic"), "magic", "lens")

    def test_effects_that_are_named_go_with_options_that_call_for_others(self):
        render = ["render", self.scene, "-o", self.folder / "a.png", "--effects", "lens"]
        for more in [["--roulette", "3"], ["--target-error", "5%"]]:  # which tries roulette
            result = tandem(*render, *more)
            self.assertEqual(result.returncode, 0, result.stderr)

    def test_an_image_and_its_figures_say_how_it_was_made(self):
        figures, out = self.folder / "out.json", self.folder / "out.exr"
        render = ["render", self.scene, "-o", out, "--size", "8", "--samples", "2", "--json", figures]

        def told(*options):
            result = tandem(*render, *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            return json.loads(figures.read_text())

        plain = told()
        self.assertEqual((plain["kernel"], plain["effects"]), ("default", "needed"))
        self.assertNotIn("epsilon", plain)
        other = told("--backend", "vulkan", "--kernel", "megakernel", "--effects", "lens,fuzz", "--guard", "fixed-epsilon",
                     "--epsilon", "0.002")
        self.assertEqual((other["kernel"], other["effects"]), ("megakernel", "lens,fuzz"))
        self.assertEqual((other["guard"], other["epsilon"]), ("fixed-epsilon", 0.002))
        self.assertIn(b"tandem:epsilon", out.read_bytes())

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

    def test_cost_measures_continues_and_refuses(self):
        out, samples = self.folder / "cost.json", self.folder / "cost.samples"
        arguments = ["cost", self.scene, "--size", "8", "--time", "4", "--knob", "bounces", "--references",
                     self.folder / "references", "--resume", samples, "--json", out]
        result = tandem(*arguments)
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
        self.refused(tandem("cost", self.scene, "--resume", self.scene), "scene.json")
        self.refused(tandem("cost", self.folder / "none.json"), "none.json")
        listed = tandem("cost", self.scene, "--list")
        self.assertEqual(listed.returncode, 0)
        self.assertIn("--integrator next-event", listed.stdout)
        self.assertIn("--sampling adaptive", listed.stdout)
        self.assertIn("no triangles", listed.stdout)

    def test_what_cost_recommends_names_the_size_that_was_measured(self):
        for options, size in (([], "64"), (["--size", "8"], "8")):
            result = tandem("cost", self.scene, "--time", "4", "--knob", "bounces", "--no-cache", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(f"To 1 %: `tandem render {self.scene} --size {size} ", result.stdout)

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

    def test_help_of_every_command_fits_a_screen_and_shows_examples(self):
        for command in ["render", "verify", "compare", "effects", "bench", "cost", "trace", "stability", "export", "import", "judges", "devices"]:
            with self.subTest(command):
                result = tandem(command, "--help")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                lines = result.stdout.splitlines()
                self.assertLessEqual(len(lines), 40)
                self.assertIn("Examples:", lines)
                everything = tandem(command, "--help-all")
                self.assertEqual(everything.returncode, 0)
                self.assertLessEqual(max(map(len, everything.stdout.splitlines())), 100)
                self.assertNotRegex(everything.stdout, "(?m)^ *Of |--(triangle|convex)-kernel|--referee|--makings")
                for text in re.split(r"\n {2,28}(?=-)|\n\n|\n(?=  tandem)|[.:;] ", everything.stdout):
                    self.assertLessEqual(len(text.split()), 25, text)

    def test_options_that_few_need_stand_under_help_all(self):
        for option in ["--triangle-test", "--guard", "--generator", "--validation"]:
            self.assertNotIn(option, tandem("render", "--help").stdout)
            self.assertIn(option, tandem("render", "--help-all").stdout)

    def test_help_of_the_program_says_what_to_type_first(self):
        result = tandem("--help")
        self.assertEqual(result.returncode, 0)
        lines = result.stdout.splitlines()
        self.assertLessEqual(len(lines), 40)
        self.assertIn("Type first:", lines[:6])
        self.assertIn("  tandem render scenes/cornell-classic.json -o box.png ", result.stdout)

    def test_without_a_driver_there_is_a_remedy(self):
        result = tandem("render", self.scene, "-o", self.folder / "out.exr", "--backend", "vulkan",
                        env=os.environ | {"VK_DRIVER_FILES": "/no.json", "VK_ICD_FILENAMES": "/no.json"})
        self.refused(result, "mesa-vulkan-drivers", "VK_DRIVER_FILES (/no.json)", status=4)

    def test_old_names_of_options_work_with_a_note(self):
        out = self.folder / "out.pfm"
        for option, now in [("--triangle-kernel=baldwin-weber", "--triangle-test"), ("--convex-kernel=naive", "--convex-test")]:
            result = tandem("render", self.scene, "-o", out, "--samples", 1, option)
            self.assertEqual(result.returncode, 0, result.stderr)
            old = option.split("=")[0]
            self.assertEqual(result.stderr, f"tandem: {old} is now {now}; the old name still works\n")
        result = tandem("cost", self.scene, "--knob", "convex-kernel", "--list")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("--convex-test naive", result.stdout)
        self.assertIn("convex-kernel is now convex-test", result.stderr)
        # A GPU program is a kernel: this name stays.
        self.assertEqual(tandem("render", self.scene, "-o", out, "--samples", 1, "--backend", "vulkan", "--kernel", "stages").stderr, "")
        wrong = self.changed("/expect", {"radiance": [0.6, 0.6, 0.6], "formula": "no"})
        result = tandem("verify", wrong, "--referee", "none", "--time", 20)
        self.assertEqual(result.returncode, 1)
        self.assertIn("--referee is now --oracle", result.stderr)
        result = tandem("stability", "--catalogue", SCENES / "hard" / "catalogue.json", "--kernel", "magic")
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, "--kernel is now --arm.*\n.*magic")


if __name__ == "__main__":
    sys.exit(unittest.main())
