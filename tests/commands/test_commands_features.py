# render --aov and --every: feature images against closed forms on every backend, and films against separate renders. Run by
# ctest with TANDEM = the program, SCENES = the folder of the shipped scenes.
import json
import math
import pathlib
import re
import signal
import subprocess
import unittest

from program import SCENES, SPHERE, TANDEM, ProgramTest, at_work, tandem, until

BACKENDS = ("cpu", "vulkan", "first", "oracle")

# A square at z = 0, seen from z = 3 and, by its corners' normals, tilted by 45 degrees about the y axis.
TILTED = """v -5 -5 0
v 5 -5 0
v 5 5 0
v -5 5 0
vn 1 0 1
f 1//1 2//1 3//1
f 1//1 3//1 4//1
"""


def layers(image):
    """For each channel its rows of values. Whole numbers come as parts of the greatest one."""
    told = subprocess.run(["oiiotool", "--info", "-v", "--dumpdata", image], capture_output=True, text=True, check=True).stdout
    names = [name.split()[0] for name in re.search(r"channel list: (.*)", told)[1].split(", ")]
    rows = re.findall(r"Pixel \((\d+), \d+\): (.*)", told)
    size = 1 + max(int(x) for x, _ in rows)
    pixels = [list(map(float, values.split())) for _, values in rows]
    return {name: [[pixel[c] for pixel in pixels[at:at + size]] for at in range(0, len(pixels), size)] for c, name in enumerate(names)}


def vector(channels, name, x, y, axes="XYZ"):
    return [channels[f"{name}.{axis}"][y][x] for axis in axes]


class Features(ProgramTest):
    def rendered(self, scene, backend, samples=4, size=8):
        """The channels of an image with all features."""
        image = self.folder / f"{backend}.exr"
        result = tandem("render", scene, "-o", image, "--backend", backend, "--size", size, "--samples", samples, "--aov", "all")
        self.assertEqual(result.returncode, 0, result.stderr)
        return layers(image)

    def near(self, found, expected, error=2e-6):
        for a, b in zip(found, expected, strict=True):
            self.assertLess(abs(a - b), error, (found, expected))

    def test_a_sphere_s_normals_and_places(self):
        for backend in BACKENDS:
            with self.subTest(backend):
                image = self.rendered(self.scene, backend)
                for y in range(8):
                    for x in range(8):
                        # The unit sphere about the origin: each hit is its own normal.
                        self.near(vector(image, "normal", x, y), vector(image, "position", x, y))
                        self.near(vector(image, "albedo", x, y, "RGB"), [0.5 if image["coverage.A"][y][x] else 0.0] * 3)
                self.assertGreater(math.hypot(*vector(image, "normal", 4, 4)), 0.9)
                for name, of_ball, of_nothing in (("coverage.A", 1, 0), ("primitive.ID", 0, 1), ("material.ID", 0, 1)):
                    self.assertEqual((image[name][4][4], image[name][0][0]), (of_ball, of_nothing), name)
                self.assertEqual((image["depth.Z"][0][0], image["distance.Z"][0][0]), (math.inf, math.inf))
                self.near([image["depth.Z"][4][4]], [4 - image["position.Z"][4][4]])

    def test_a_plane_s_depth_and_distance(self):
        (self.folder / "tilted.obj").write_text(TILTED)
        scene = {**SPHERE, "camera": {"position": [0, 0, 3], "target": [0, 0, 0], "vertical_field_degrees": 90},
                 "entities": [{"name": "square", "material": "grey", "primitives": [{"obj": {"file": "tilted.obj"}}]}]}
        scene = self.write(scene, "plane.json")
        self.refused(tandem("render", scene, "-o", self.folder / "a.exr", "--backend", "first", "--aov", "depth"), "first", "shading")
        for backend in ("cpu", "vulkan", "oracle"):
            with self.subTest(backend):
                image = self.rendered(scene, backend, samples=1)
                for y in range(8):
                    for x in range(8):
                        place = vector(image, "position", x, y)
                        self.near([image["depth.Z"][y][x], image["distance.Z"][y][x]], [3.0, math.dist(place, (0, 0, 3))], 4e-6)
                        # Where the tilted normal faces the camera it counts; elsewhere the square's own (MODEL.md 5.4).
                        tilted = 3 - place[0] > 1e-3
                        self.near(vector(image, "normal", x, y), [math.sqrt(0.5), 0, math.sqrt(0.5)] if tilted else [0, 0, 1])

    def test_features_leave_the_image_as_it_is(self):
        plain, more = self.folder / "plain.exr", self.folder / "more.exr"
        for image, words in ((plain, ()), (more, ("--aov", "albedo,normal,depth"))):
            tandem("render", self.scene, "-o", image, "--samples", "8", *words)
        without, with_features = layers(plain), layers(more)
        self.assertEqual(set(with_features) - set(without), {f"albedo.{c}" for c in "RGB"} | {f"normal.{c}" for c in "XYZ"} | {"depth.Z"})
        self.assertEqual(without, {name: rows for name, rows in with_features.items() if name in without})
        tandem("render", self.scene, "-o", more, "--samples", "8", "--seed", "1", "--aov", "primitive")
        self.assertEqual(tandem("compare", plain, more, "--margin", "50%", "--tile-margin", "90%").returncode, 0)

    def test_scenes_with_punctual_lights_have_features(self):
        lit, dark = self.folder / "lit.json", self.folder / "dark.json"
        scene = json.loads(self.scene.read_text())
        dark.write_text(json.dumps(scene))
        scene["lights"] = [{"name": "bulb", "point": {"position": [0, 0, 3], "intensity": [1, 1, 1]}}]
        lit.write_text(json.dumps(scene))
        for backend in ("cpu", "vulkan"):
            depths = []
            for file in (lit, dark):
                image = file.with_suffix(".exr")
                result = tandem("render", file, "-o", image, "--integrator", "next-event", "--backend", backend, "--size", "16",
                                "--samples", "4", "--aov", "depth")
                self.assertEqual(result.returncode, 0, result.stderr)
                depths.append(layers(image)["depth.Z"])
            self.assertEqual(*depths)

    def test_features_end_with_the_time_and_at_an_interrupt(self):
        image = self.folder / "a.exr"
        for backend, more in (("cpu", ("--threads", "1")), ("vulkan", ())):
            with self.subTest(backend):
                words = ("render", self.scene, "-o", image, "--size", "1024", "--backend", backend, *more, "--aov", "all")
                self.refused(tandem(*words, "--time", "0.2"), "--time: 0.2 s do not suffice for --aov", status=3)
                with subprocess.Popen([TANDEM, *words, "--samples", "64"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as running:
                    at_work(running, 0.5)
                    running.send_signal(signal.SIGINT)
                    told = running.communicate(timeout=20)[1]
                self.assertIn(running.returncode, (130, -signal.SIGINT), told)
                self.assertFalse(image.exists())

    def test_png_gets_pictures_beside_it(self):
        result = tandem("render", self.scene, "-o", self.folder / "a.png", "--samples", "2", "--aov", "normal,material")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(set(self.left_behind()), {"a.png", "a.normal.png", "a.material.png"})

    def test_a_film_has_the_bits_of_separate_renders(self):
        for backend, words in (("cpu", ()), ("vulkan", ("--accumulation", "plain"))):
            with self.subTest(backend=backend, words=words):
                folder = self.folder / f"{backend}{len(words)}"
                folder.mkdir()
                common = ("--backend", backend, "--size", "8", *words)
                result = tandem("render", self.scene, "-o", folder / "a.pfm", "--samples", "200", "--every", "4x", *common)
                self.assertEqual(result.returncode, 0, result.stderr)
                counts = (1, 4, 16, 64, 200)
                self.assertEqual({path.name for path in folder.iterdir()}, {"a.pfm", *(f"a-{count:06}.pfm" for count in counts)})
                for count in (16, 64, 200):
                    tandem("render", self.scene, "-o", folder / "b.pfm", "--samples", count, *common)
                    self.assertEqual((folder / f"a-{count:06}.pfm").read_bytes(), (folder / "b.pfm").read_bytes(), count)
                self.assertEqual((folder / "a.pfm").read_bytes(), (folder / "b.pfm").read_bytes())

    def test_a_film_that_is_stopped_keeps_its_last_state(self):
        image = self.folder / "a.exr"
        with subprocess.Popen([TANDEM, "render", self.scene, "-o", image, "--samples", "1000000000", "--every", "2x"], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True) as running:
            until((self.folder / "a-000256.exr").exists, "256 samples are done")
            running.send_signal(signal.SIGINT)
            told = running.communicate(timeout=60)[0]
        self.assertEqual(running.returncode, 0, told)
        done = int(re.search(r": (\d+) samples a pixel", told)[1])
        self.assertEqual(layers(image)["count"][0][0], done)
        whole = sorted(int(path.stem[2:]) for path in self.folder.glob("a-*.exr"))
        self.assertEqual(whole, [2 ** k for k in range(len(whole))])
        self.assertLessEqual(whole[-1], done)

    def test_a_film_by_time(self):
        result = tandem("render", self.scene, "-o", self.folder / "a.png", "--every", "2x", "--time", "0.3")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue((self.folder / "a-000001.png").exists() and (self.folder / "a.png").exists())

    def test_what_does_not_fit_is_refused(self):
        for words, mentions in ((("--aov", "norml"), ("norml", "did you mean normal")), (("--aov", "depth", "-o", "a.pfm"), ("a.pfm", ".exr")),
                                (("--every", "3x"), ("3x", "2x")), (("--every", "2x", "--range", "0:64"), ("--every", "--range")),
                                (("--every", "2x", "--sampling", "adaptive"), ("adaptive",)),
                                (("--every", "2x", "-o", self.folder / "none" / "a.png"), ("none",))):
            out = () if "-o" in words else ("-o", self.folder / "a.exr")
            self.refused(tandem("render", self.scene, *out, *words, cwd=self.folder), *mentions)
            self.assertEqual({path.name for path in pathlib.Path(self.folder).iterdir()}, {"scene.json"})

    def test_a_picture_beside_is_not_written_over_the_scene(self):
        scene = self.write(SPHERE, "a-000002.png")
        self.refused(tandem("render", scene, "-o", self.folder / "a.png", "--samples", "4", "--every", "2x"), "a-000002.png")
        self.assertIn("camera", scene.read_text())


class Denoising(ProgramTest):
    def noisy(self, *words, size=64, samples=8):
        image = self.folder / "noisy.exr"
        result = tandem("render", SCENES / "cornell-classic.json", "-o", image, "--size", size, "--samples", samples,
                        "--aov", "albedo,normal,depth", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return image

    def test_noise_falls_and_the_result_says_that_it_is_biased(self):
        noisy, smooth, figures = self.noisy(), self.folder / "smooth.exr", self.folder / "figures.json"
        result = tandem("denoise", noisy, "-o", smooth, "--json", figures)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("biased", result.stdout)
        self.assertTrue(json.loads(figures.read_text())["biased"])
        reference = self.folder / "reference.exr"
        tandem("render", SCENES / "cornell-classic.json", "-o", reference, "--size", 64, "--samples", 1024, "--seed", 1)
        image, before, truth = layers(smooth), layers(noisy), layers(reference)
        self.assertEqual(set(image), {"R", "G", "B"})
        relative = lambda a: sum((x - y) ** 2 / (y * y + 0.01) for c in "RGB" for row, true in zip(a[c], truth[c]) for x, y in zip(row, true))
        self.assertLess(relative(image), 0.5 * relative(before))
        self.refused(tandem("compare", smooth, reference), "smooth.exr", "is denoised")
        self.refused(tandem("denoise", smooth, "-o", self.folder / "again.exr"), "smooth.exr", "already")

    def test_the_bits_do_not_depend_on_threads(self):
        noisy = self.noisy()
        for threads in (1, 3):
            tandem("denoise", noisy, "-o", self.folder / f"{threads}.exr", "--threads", threads)
        self.assertEqual(layers(self.folder / "1.exr"), layers(self.folder / "3.exr"))

    def test_what_lacks_a_layer_is_refused_with_the_command_that_makes_it(self):
        plain, out = self.folder / "plain.exr", self.folder / "a.exr"
        tandem("render", self.scene, "-o", plain, "--samples", "4")
        self.refused(tandem("denoise", plain, "-o", out), "albedo.R", "--aov albedo,normal,depth")
        self.refused(tandem("denoise", self.noisy("--generator", "sobol"), "-o", out), "variance.R", "Sobol")
        self.refused(tandem("denoise", self.noisy(samples=1), "-o", out), "pixel (0, 0)", "more samples")
        self.refused(tandem("denoise", self.folder / "none.exr", "-o", out), "none.exr", "no such file")
        self.refused(tandem("denoise", plain, "-o", self.folder / "a.gif"), "a.gif")
        self.refused(tandem("denoise", self.noisy(), "-o", self.folder / "noisy.exr"), "noisy.exr", "which is read")
        self.assertFalse(out.exists())

    def test_a_stop_leaves_nothing(self):
        noisy, out = self.noisy(size=512, samples=2), self.folder / "a.exr"
        with subprocess.Popen([TANDEM, "denoise", noisy, "-o", out, "--threads", "1"], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as running:
            at_work(running, 0.5)
            running.send_signal(signal.SIGINT)
            told = running.communicate(timeout=60)[1]
        # Loading ends at once (130); the filter says what it did not do.
        self.assertIn(running.returncode, (3, 130, -signal.SIGINT), told)
        self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
