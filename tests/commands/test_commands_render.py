# What `tandem render` makes: images and figures for each setting, what stops it, and what it says of an error.
# Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import pathlib
import signal
import subprocess
import time
import unittest

from program import SCENES, TANDEM, ProgramTest, Stopwatch, at_work, tandem


class Render(ProgramTest):
    def test_what_is_lost_of_a_models_materials_is_said_once(self):
        (self.folder / "m.mtl").write_text("newmtl m\nKd 0.5 0.5 0.5\nKs 1 1 1\nmap_Bump b.png\n")
        (self.folder / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
        models = [{"obj": {"file": "m.obj"}}] * 2
        scene = self.changed("/entities", [{"primitives": models}])
        result = tandem("render", scene, "-o", self.folder / "out.pfm", "--samples", 4)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count("m.obj is rendered without Ks beside Kd, map_Bump"), 1, result.stderr)

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

    def test_an_error_that_too_few_samples_do_not_tell_is_said_to_be_unknown(self):
        for options, told in ((["--samples", "1"], "is not known: the samples are too few; give more --samples"),
                              (["--samples", "1", "--time", "60"], "too few; give more --samples or --time")):
            result = tandem("render", SCENES / "cornell-classic.json", "--size", "16", "-o", self.folder / "out.exr",
                            "--target-error", "1%", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(told, result.stdout)
        result = tandem("render", self.changed("/background", [0, 0, 0]), "-o", self.folder / "out.exr", "--target-error", "1%",
                        "--samples", "16")
        self.assertIn("The image is black so far", result.stdout)

    def test_a_target_error_leaves_what_would_change_a_clamped_image(self):
        figures = self.folder / "out.json"
        result = tandem("render", SCENES / "cornell-thesis.json", "--size", "16", "-o", self.folder / "out.exr",
                        "--target-error", "20%", "--clamp", "1", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = json.loads(figures.read_text())
        self.assertEqual(told["integrator"], "path")
        for trial in told["trials"]:
            self.assertNotRegex(trial["options"], "--integrator|--roulette")

    def test_endings_in_capitals_choose_the_format(self):
        out = self.folder / "X.PNG"
        self.assertEqual(tandem("render", self.scene, "--samples", "1", "-o", out).returncode, 0)
        self.assertEqual(out.read_bytes()[:4], b"\x89PNG")

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

    def test_json_and_image_tell_the_commit_of_the_program(self):
        out, figures = self.folder / "out.exr", self.folder / "out.json"
        self.assertEqual(tandem("render", self.scene, "-o", out, "--samples", 1, "--json", figures).returncode, 0)
        version = json.loads(tandem("plan", "render", self.scene, "--samples", 1, "--pieces", 1).stdout.splitlines()[0])["version"]
        self.assertEqual(json.loads(figures.read_text())["git"], version)
        self.assertIn(b"tandem:git\0string\0" + len(version).to_bytes(4, "little") + version.encode(), out.read_bytes())

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
                        "--integrator", "path", "-v")  # next events have noise there
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

    def test_lights_are_chosen_as_asked_where_next_events_choose_them(self):
        figures = self.folder / "out.json"
        render = ["render", SCENES / "many-lamps.json", "-o", self.folder / "out.exr", "--size", "16", "--json", figures,
                  "--light-sampling", "tree"]
        for integrator in ["path", "bidirectional"]:
            self.refused(tandem(*render, "--backend", "cpu", "--integrator", integrator), "--light-sampling tree",
                         "--integrator next-event")
        self.refused(tandem(*render, "--backend", "first", "--integrator", "next-event"), "leave --light-sampling out")
        for backend, precision in [("cpu", "single"), ("cpu", "mixed"), ("vulkan", "single"), ("oracle", "double")]:
            with self.subTest(backend=backend, precision=precision):
                result = tandem(*render, "--samples", "4", "--backend", backend, "--precision", precision)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(json.loads(figures.read_text())["light_sampling"], "tree")

    def test_the_quality_of_hierarchies_changes_no_bit(self):
        figures, images = self.folder / "out.json", {}
        scene = SCENES / "model.json"
        for backend in ["cpu", "vulkan"]:
            for quality in ["high", "medium", "low"]:
                image = self.folder / f"{backend}-{quality}.pfm"
                result = tandem("render", scene, "-o", image, "--size", "16", "--samples", "4", "--backend", backend,
                                "--hierarchy-quality", quality, "--json", figures)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(json.loads(figures.read_text())["hierarchy_quality"], quality)
                images[quality] = image.read_bytes()
            self.assertEqual(images["high"], images["low"])
            self.assertEqual(images["high"], images["medium"])
        result = tandem("verify", scene, "--size", "16", "--hierarchy-quality", "low", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(json.loads(figures.read_text())["scenes"][0]["settings"]["hierarchy_quality"], "low")
        render = ["render", scene, "-o", self.folder / "none.pfm", "--size", "8", "--hierarchy-quality", "low"]
        for backend in ["oracle", "first"]:
            self.refused(tandem(*render, "--backend", backend), "leave --hierarchy-quality out")
        self.refused(tandem(*render[:-1], "lowest"), "--hierarchy-quality")

    def test_what_hierarchies_cost_is_told_by_time_to_build_and_to_trace(self):
        figures = self.folder / "cost.json"
        result = tandem("cost", SCENES / "model.json", "--size", "16", "--knob", "hierarchy-quality", "--time", "6", "--no-cache",
                        "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        arms = {arm["setting"]: arm for arm in json.loads(figures.read_text())["arms"]}
        self.assertEqual(set(arms), {"", "medium", "low"})
        self.assertLess(0.0, arms["low"]["hierarchy_seconds"])
        self.assertLess(0.0, arms[""]["hierarchy_seconds"])
        self.assertIn("hierarchy-quality low builds its hierarchy in", result.stdout)
        told = tandem("cost", self.scene, "--knob", "hierarchy-quality", "--list")
        self.assertIn("too few primitives", told.stdout)

    def test_pixel_filters_are_a_setting_of_every_backend_but_the_first(self):
        figures = self.folder / "out.json"
        render = ["render", self.scene, "-o", self.folder / "out.exr", "--size", "8", "--samples", "4", "--json", figures,
                  "--filter", "gaussian"]
        for options in [["--backend", "cpu"], ["--backend", "cpu", "--integrator", "bidirectional"], ["--backend", "vulkan"],
                        ["--backend", "oracle"]]:
            with self.subTest(options=options):
                result = tandem(*render, *options)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(json.loads(figures.read_text())["filter"], "gaussian")
        self.refused(tandem(*render, "--backend", "first"), "leave --filter out")

    def test_a_target_error_keeps_the_integrator_that_chooses_lights_as_asked(self):
        figures = self.folder / "out.json"
        result = tandem("render", SCENES / "many-lamps.json", "-o", self.folder / "out.pfm", "--size", "16",
                        "--target-error", "20%", "--light-sampling", "tree", "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(figures.read_text())["light_sampling"], "tree")

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
        sobol = ["render", self.scene, "--generator", "sobol", "--json", figures, "-o"]
        render = [*sobol, self.folder / "out.exr"]
        # On a busy machine loading the library for .exr takes half a second, which is of the time.
        for how in ([*render, "--target-error", "1%"], [*sobol, self.folder / "out.pfm", "--time", "0.5"]):
            result = tandem(*how)
            self.assertEqual(result.returncode, 0, result.stderr)
            told = json.loads(figures.read_text())
            self.assertEqual((told["generator"], told["scramblings"]), ("sobol", 8))
            self.assertLessEqual(told["relative_error_low"], told["relative_error"])
            self.assertLessEqual(told["relative_error"], told["relative_error_high"])
            self.assertIn("% of the mean (", result.stdout)
        # Fewer samples than scramblings are one scrambling, too.
        for how in ([], ["--target-error", "1%", "--samples", "4"]):
            self.assertEqual(tandem(*render, *how).returncode, 0)
            told = json.loads(figures.read_text())
            self.assertFalse({"relative_error", "relative_error_low", "scramblings"} & told.keys(), how)
        # Without variances one image is no evidence of anything; several scramblings are.
        self.refused(tandem("compare", self.folder / "out.exr", "vs", self.folder / "out.exr"), "out.exr")

    def test_time_is_kept_where_paths_never_end(self):
        box = self.closed_box()
        # Millions of paths of thousands of segments, or a few of a million: each took minutes.
        for backend in ("cpu", "vulkan", "oracle"):
            for size, bounces in (("512x512", "4096"), ("8x8", "1000000")):
                with self.subTest(backend=backend, size=size):
                    with Stopwatch() as watch:
                        result = tandem("render", box, "-o", self.folder / "out.exr", "--backend", backend, "--size", size,
                                        "--bounces", bounces, "--time", "1")
                    self.refused(result, "--time: 1 s do not suffice for a sample of every pixel", status=3)
                    # 1.55 s, and what a loaded machine adds.
                    self.assertLess(watch.seconds, 8.0)
                    self.assertFalse((self.folder / "out.exr").exists())

    def test_time_is_kept_by_the_trials_for_a_target_error(self):
        with Stopwatch() as watch:
            tandem("render", self.closed_box(), "-o", self.folder / "out.pfm", "--size", "512", "--bounces", "4096",
                   "--target-error", "1%", "--time", "1")
        self.assertLess(watch.seconds, 8.0)  # as above

    def test_interrupt_keeps_what_was_rendered(self):
        out, figures = self.folder / "out.exr", self.folder / "out.json"
        for sampling in ["uniform", "adaptive"]:
            with subprocess.Popen([TANDEM, "render", SCENES / "cornell-classic.json", "-o", out, "--size", "64", "--samples",
                                   "1000000", "--sampling", sampling, "--json", figures], stderr=subprocess.PIPE,
                                  text=True) as running:
                at_work(running, 2.0)
                for _ in range(2):  # as timeout(1) does, to the process and to its group
                    running.send_signal(signal.SIGTERM)
                    time.sleep(0.2)
                self.assertEqual(running.wait(timeout=30), 0, running.stderr.read())
            report = json.loads(figures.read_text())
            self.assertFalse(report["complete"])
            self.assertGreater(report["samples"], 0)
            self.assertTrue(out.exists())
            out.unlink()

    def test_what_image_libraries_print_is_no_second_line(self):
        image = self.folder / "sky.png"
        image.write_bytes((pathlib.Path(__file__).parent.parent / "fuzz/corpus/image/bad-header.png").read_bytes())
        scene = json.loads((SCENES / "furnace.json").read_text())
        scene["background"] = {"image": "sky.png", "colour_space": "srgb"}
        file = self.folder / "sky.json"
        file.write_text(json.dumps(scene))
        self.refused(tandem("render", file, "-o", self.folder / "a.pfm"), "sky.png: is no readable image")

    def test_general_kernels_give_the_same_image(self):
        images = []
        for effects in ["needed", "all"]:
            output = self.folder / f"{effects}.png"
            self.assertEqual(tandem("render", self.scene, "-o", output, "--effects", effects).returncode, 0)
            images.append(output.read_bytes())
        self.assertEqual(*images)

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
    unittest.main()
