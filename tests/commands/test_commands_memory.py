# What scenes and films take of memory: forecast, films in tiles, and refusals before anything is allocated.
# Run by ctest with TANDEM = the program, SCENES = the folder.
import json
import math
import resource
import subprocess
import unittest

from program import TANDEM, ProgramTest, tandem


class Memory(ProgramTest):
    # 80 MB as a whole, 25 MB in tiles.
    def render(self, output, *arguments, size="700x500", samples=2):
        return tandem("render", self.scene, "-o", self.folder / output, "--size", size, "--samples", samples, "--bounces", 1,
                      "--threads", 2, *arguments)

    def in_tiles(self, output, *arguments, **options):
        """Within 32 MiB more than the program and the scene take already."""
        told = json.loads(self.told.read_text())["memory"]
        limit = told["program"] + told["tables"] + told["trees"] + 32
        return self.render(output, "--memory", f"{limit:.0f}MiB", "--json", self.folder / "tiles.json", *arguments, **options)

    def setUp(self):
        super().setUp()
        self.told = self.folder / "whole.json"

    def test_a_film_in_tiles_has_the_bits_of_the_whole_film(self):
        self.assertEqual(self.render("whole.exr", "--json", self.told, "--memory", "4GiB").returncode, 0)
        whole = json.loads(self.told.read_text())
        self.assertNotIn("regions", whole["memory"])
        result = self.in_tiles("tiles.exr")
        self.assertEqual(result.returncode, 0, result.stderr)
        tiles = json.loads((self.folder / "tiles.json").read_text())
        self.assertGreater(tiles["memory"]["regions"], 2)
        self.assertEqual(tiles["paths"], whole["paths"])
        self.assertAlmostEqual(tiles["relative_error"], whole["relative_error"], delta=1e-9)
        same = tandem("compare", self.folder / "whole.exr", self.folder / "tiles.exr")
        self.refused(same, "tiles.exr: holds the same pixels as")

    def test_the_forecast_is_near_what_a_film_takes(self):
        result = self.render("whole.exr", "--json", self.told, "--verbose", size="1500x1000", samples=1)
        self.assertIn("memory: ", result.stderr)
        told = json.loads(self.told.read_text())["memory"]
        self.assertLess(told["peak"], 1.1 * told["forecast"])
        self.assertGreater(told["peak"], 0.7 * told["forecast"])

    def test_films_that_do_not_fit_are_refused_before_they_are_begun(self):
        self.render("whole.exr", "--json", self.told, "--memory", "4GiB")
        (self.folder / "whole.exr").unlink()
        for output, arguments, mention in [
            ("out.png", [], "end the name in .exr"),
            ("out.pfm", [], "end the name in .exr"),
            ("out.exr", ["--aov", "all"], "--aov"),
                        ("out.exr", ["--generator", "sobol"], "--generator philox"),
            ("out.exr", ["--sampling", "adaptive"], "adaptive"),
            ("out.exr", ["--resume", self.folder / "sums.exr"], "--resume"),
            ("out.exr", ["--accumulation", "plain"], "--accumulation"),
        ]:
            with self.subTest(arguments=arguments):
                result = self.in_tiles(output, *arguments, size="1500x1200")
                self.refused(result, mention, "a film of 1500x1200 takes", "the limit is", "--memory")
        self.refused(self.render("out.exr", "--memory", "much"), "--memory: 'much' is no amount of memory")
        self.refused(self.render("out.exr", "--memory", "2MiB"), "take ", "the limit is 2 MiB", "--memory")
        self.assertEqual(self.left_behind(), [])

    def test_tiles_that_are_done_are_kept_when_time_ends_or_the_user_stops(self):
        self.render("whole.exr", "--json", self.told, "--memory", "4GiB")
        result = self.in_tiles("out.exr", "--time", 5, "--seed", 2, samples=5000)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertRegex(result.stderr, "--time: 5 s do not suffice: .* of the samples were done; pixels without samples are black")
        report = json.loads((self.folder / "tiles.json").read_text())
        self.assertFalse(report["complete"])
        self.assertGreater(report["paths"], 0)
        for arguments in [[], ["--bin", 2]]:
            refused = tandem("compare", self.folder / "whole.exr", self.folder / "out.exr", *arguments)
            self.refused(refused, "out.exr: pixel (", "has no samples; render the whole film")

    def test_a_scene_beyond_the_limit_is_refused_with_what_it_takes(self):
        ball = {"sphere": {"centre": [0, 0, 0], "radius": 0.1}}
        scene = {
            "materials": {"grey": {"kind": "diffuse", "colour": [0.5, 0.5, 0.5]}},
            "camera": {"position": [0, 0, 9], "target": [0, 0, 0], "vertical_field_degrees": 40},
            "groups": {"one": [{"material": "grey", "primitives": [ball] * 100}],
                       "many": [{"group": "one"}] * 100, "most": [{"group": "many"}] * 100},
            "entities": [{"group": "most"}]}
        path = self.write(scene, "many.json")
        result = tandem("render", path, "-o", self.folder / "out.exr", "--memory", "100MiB")
        self.refused(result, "many.json: its 1000000 primitives, as placed, take", "tables", "the limit is 100 MiB", "--memory")
        self.assertEqual(self.left_behind(), [])

    def test_large_images_are_compared_by_squares_of_pixels(self):
        for seed in [1, 2]:
            self.render(f"{seed}.exr", "--seed", seed, samples=4)
        images = [self.folder / "1.exr", self.folder / "2.exr"]
        self.refused(tandem("compare", *images, "--memory", "100MiB"), "images of 700x500 pixels take", "--bin 2", "--memory")
        result = tandem("compare", *images, "--memory", "100MiB", "--bin", 2)
        self.assertIn(result.returncode, [0, 3], result.stderr)
        self.assertIn("means of 2x2 pixels", result.stdout + result.stderr)

    def test_a_film_beyond_memory_is_verified_in_bins_within_the_memory_that_is_stated(self):
        """Whole, its sums would take 150 GiB."""
        out, limit = self.folder / "out.json", 700
        how = ("--size", 16384, "--candidate", "cpu", "--precision", "double", "--oracle", "none", "--samples", 256)
        command = [TANDEM, "verify", self.scene, *map(str, how), "--memory", f"{limit}MiB", "--json", out]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        told, errors = process.communicate(timeout=120)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024  # of all that this test started
        self.assertIn(process.returncode, (0, 3), errors)
        self.assertIn("128x128 bins of the film of 16384x16384 pixels", told)
        self.assertLess(peak, limit)
        report = json.loads(out.read_text())["scenes"][0]
        self.assertEqual(report["film"], {"width": 16384, "height": 16384})
        self.assertEqual(report["settings"]["width"], 128)
        self.assertGreater(max(report["worst_pixel"]["x"], report["worst_pixel"]["y"]), 127)  # a pixel of the film
        self.assertIn("--size 16384x16384", report["worst_pixel"]["trace"])

    def test_what_has_no_bins_is_refused_with_the_mend(self):
        large = ("verify", self.scene, "--size", 16384, "--memory", "1GiB")
        for words, mention in [(("--candidate", "exec:true"), "compare --bin"), (("--convergence",), "--convergence"),
                               (("--generator", "sobol"), "philox"), (("--device", "0,0"), "one --device"),
                               (("--kernel", "fragment"), "--kernel")]:
            with self.subTest(mention):
                self.refused(tandem(*large, *words), "a film of 16384x16384 takes 150", "the limit is 1024 MiB", mention, "--memory")
        self.refused(tandem("verify", self.scene, "--size", 64, "--memory", "1MiB"), "too few pixels for bins")
        self.refused(tandem("verify", self.scene, "--size", 1024, "--memory", "1MiB", "--candidate", "cpu", "--precision", "double"),
                     "film in bins included", "the limit is 1 MiB")


class SharedMeshes(ProgramTest):
    def scene_of_copies(self, cells, copies):
        """A wavy sheet of 2 cells² triangles, and a scene of copies of it, turned and scaled, under an even sky."""
        points = [f"v {x / cells - 0.5:.6f} {0.1 * math.sin(0.7 * x) * math.sin(0.5 * z):.6f} {z / cells - 0.5:.6f}"
                  for z in range(cells + 1) for x in range(cells + 1)]
        row = cells + 1
        faces = [f"f {a} {b} {a + 1}\nf {a + 1} {b} {b + 1}" for z in range(cells) for x in range(cells)
                 for a in [z * row + x + 1] for b in [a + row]]
        (self.folder / "sheet.obj").write_text("\n".join(points + faces) + "\n")
        side = math.ceil(copies ** 0.5)
        turns = [{"rotate": {"axis": [1, 2, 3], "degrees": 37 * i}} for i in range(copies)]
        places = [{"translate": [i % side - side / 2, 0.1 * (i % 5), i // side - side / 2]} for i in range(copies)]
        return self.write({
            "film": {"width": 24, "height": 16},
            "camera": {"position": [0, side / 2, side], "target": [0, 0, 0], "vertical_field_degrees": 40},
            "background": [0.6, 0.7, 0.9],
            "materials": {"grey": {"kind": "diffuse", "colour": [0.5, 0.5, 0.5]}},
            "groups": {"sheet": [{"material": "grey", "primitives": [{"obj": {"file": "sheet.obj"}}]}]},
            "entities": [{"group": "sheet", "transform": [turn, {"scale": [0.9, -0.7, 0.8]}, place]}
                         for turn, place in zip(turns, places)]}, "copies.json")

    def test_a_hundred_million_triangles_are_rendered_within_a_gibibyte_as_forecast(self):
        scene = self.scene_of_copies(225, 1000)
        told = self.folder / "told.json"
        result = tandem("render", scene, "-o", self.folder / "out.pfm", "--samples", 1, "--memory", "1GiB", "--json", told)
        self.assertEqual(result.returncode, 0, result.stderr)
        memory = json.loads(told.read_text())["memory"]
        self.assertLess(memory["peak"], 1024)
        self.assertLess(memory["peak"], 1.2 * memory["forecast"])
        result = tandem("render", scene, "-o", self.folder / "no.pfm", "--integrator", "bidirectional", "--memory", "1GiB")
        self.refused(result, "101250000 primitives, as placed, take")
        result = tandem("render", scene, "-o", self.folder / "no.pfm", "--backend", "oracle")
        self.refused(result, "tries every primitive", "101250000")

    def test_both_tracers_agree_on_copies_that_they_keep_once(self):
        scene = self.scene_of_copies(100, 64)
        result = tandem("verify", scene, "--time", 30)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
