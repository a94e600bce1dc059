# The program as a user meets it. There are exit statuses, one clear line for every bad input, nothing half written,
# help, devices, and how soon every command ends. Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import time
import unittest

from program import SCENES, SPHERE, TANDEM, ProgramTest, Stopwatch, at_work, tandem


class Commands(ProgramTest):
    def render_refused(self, scene, *mentions):
        output = self.folder / "out.exr"
        self.refused(tandem("render", scene, "-o", output, "--json", self.folder / "out.json"), *mentions)
        self.assertEqual(self.left_behind(), [])

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
            (["render", self.scene, "-o", self.folder / "out.png", "--size", "65536x65535"], "memory"),
            (["render", self.scene, "-o", "/proc/out.exr"], "/proc/out.exr"),
            (["render", self.scene, "-o", out, "--json", "/proc/out.json"], "/proc/out.json"),
            (["verify", self.scene, "--time", "nan"], "--time"),
            (["verify", self.scene, "--tile-margin", "nan"], "--tile-margin"),
            (["verify", self.scene, "--size", "65536x65535", "--convergence"], "memory"),
            (["verify", self.scene, "--json", "/proc/out.json"], "/proc/out.json"),
            (["paint"], ""),
            ([], ""),
        ]:
            with self.subTest(arguments=arguments):
                self.refused(tandem(*arguments), mention)
                self.assertEqual(self.left_behind(), [])

    def test_bare_numbers_of_1_and_more_are_no_fractions(self):
        for option, command in (("--margin", "verify"), ("--target-error", "render")):
            output = ["-o", self.folder / "out.exr"] if command == "render" else []
            self.refused(tandem(command, self.scene, option, "5", *output), option, "write 5% or 500%")

    def test_an_unknown_vulkan_device_is_status_4(self):
        result = tandem("render", self.scene, "-o", self.folder / "out.exr", "--backend", "vulkan", "--device", "no such")
        self.refused(result, "no such", status=4)
        self.assertEqual(self.left_behind(), [])

    def test_without_a_vulkan_driver_the_status_is_4(self):
        result = tandem("render", self.scene, "-o", self.folder / "out.exr", "--backend", "vulkan",
                        env={**os.environ, "VK_ICD_FILENAMES": "/nonexistent.json", "VK_DRIVER_FILES": "/nonexistent.json"})
        self.refused(result, status=4)
        self.assertEqual(self.left_behind(), [])

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
                with Stopwatch() as watch:
                    result = tandem(*command, "--time", "3", "--json", figures)
                self.assertLess(watch.seconds, 10.0)  # 4.3 s, and what a loaded machine adds
                self.refused(result, "--time: 3 s are too short: ", not_done, status=3)
                if figures.exists():  # what is there is what was measured
                    self.assertIsInstance(json.loads(figures.read_text()), dict)
        told = json.loads(figures.read_text())  # of stability
        self.assertFalse(told["complete"])
        self.assertGreater(told["arms_not_run"], 0)
        self.assertGreater(len(told["cases"]), 0)

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
                    try:
                        at_work(running)
                        with Stopwatch() as watch:
                            running.send_signal(signal.SIGINT)
                            running.communicate(timeout=40)
                        self.assertLess(watch.seconds, 8.0)  # 2 s, and what a loaded machine adds
                    finally:
                        running.kill()

    def test_a_command_that_is_done_ends_at_once(self):
        def in_line(process):
            """Seconds that a process, whose threads have ended, or this one has stood in line for a processor; 0 where Linux does not tell."""
            try:
                return 1e-9 * int(pathlib.Path(f"/proc/{process}/schedstat").read_text().split()[1])
            except OSError:
                return 0.0

        def waited():
            used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
            begin, before, own = time.monotonic(), used(), in_line("thread-self")
            process = subprocess.Popen([TANDEM, "--help"], stdout=subprocess.DEVNULL)
            os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
            seconds, stood = time.monotonic() - begin, in_line(process.pid) + in_line("thread-self") - own
            self.assertEqual(process.wait(), 0)
            return seconds - (used() - before) - stood
        self.assertLess(sorted(waited() for _ in range(20))[14], 0.05)

    def test_wrong_arguments_say_what_is_wrong_and_where_to_read(self):
        self.refused(tandem(), "no command is named; there are render, view, verify")
        self.refused(tandem("rendr", self.scene), "'rendr' is no command; there are render, view, verify")
        self.refused(tandem("render"), "see tandem render --help")
        for samples in ["0", "-3", "abc", "1.5", "1e3"]:
            self.refused(tandem("render", self.scene, "-o", self.folder / "a.png", "--samples", samples),
                         f"--samples: '{samples}' is no whole number from 1 to")
        self.refused(tandem("effects", self.scene, "--backend", "oracle"), "--backend")

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

    def test_help_of_every_command_fits_a_screen_and_shows_examples(self):
        for command in ["render", "verify", "compare", "denoise", "effects", "bench", "cost", "trace", "stability", "export", "import", "judges", "devices"]:
            with self.subTest(command):
                result = tandem(command, "--help")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                lines = result.stdout.splitlines()
                self.assertLessEqual(len(lines), 40)
                self.assertIn("Examples:", lines)
                self.assertEqual([line for line in lines if line.endswith(" ")], [])  # an option without a word about it
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


if __name__ == "__main__":
    unittest.main()
