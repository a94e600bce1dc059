# One image by many processes: parts that merge to the bits of a single render, and renders that go on where they ended.
import hashlib
import json
import signal
import subprocess
import unittest

from exr import exr_channels
from program import SCENES, TANDEM, ProgramTest, at_work, tandem, until


def pixels(path):
    """A hash of the mean, its variance and the counts, whatever else the file says."""
    channels = exr_channels(path)
    return hashlib.sha1(b"".join(channels[name] for name in ("R", "G", "B", "variance.R", "variance.G", "variance.B", "count"))).hexdigest()


class PartsTest(ProgramTest):
    def render(self, name, *options, scene=None):
        result = tandem("render", scene or self.scene, "-o", self.folder / name, "--size", "16", *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def merged(self, *parts, options=()):
        image = self.folder / "merged.exr"
        result = tandem("merge", *parts, "-o", image, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return image


class Parts(PartsTest):
    def test_any_split_in_any_order_has_the_bits_of_one_render(self):
        for scene, backend in ((SCENES / "cornell-classic.json", "cpu"), (self.scene, "vulkan")):
            with self.subTest(scene=scene, backend=backend):
                how = ("--backend", backend, "--samples", "600")
                whole = pixels(self.render("whole.exr", *how, scene=scene))
                parts = [self.render(f"{i}.exr", *how, "--range", f"{a}:{b}", scene=scene)
                         for i, (a, b) in enumerate(((0, 64), (64, 320), (320, 512), (512, 600)))]
                self.assertEqual(pixels(self.merged(*parts)), whole)
                self.assertEqual(pixels(self.merged(parts[2], parts[0], parts[3], parts[1])), whole)
                # In stages, too.
                some = self.folder / "some.exr"
                self.assertEqual(tandem("merge", parts[1], parts[3], "-o", some, "--sums", "--allow-gaps").returncode, 0)
                self.assertEqual(pixels(self.merged(parts[2], some, parts[0])), whole)

    def test_a_part_is_an_image_of_its_samples(self):
        part = self.render("part.exr", "--range", "0:128")
        self.assertEqual(pixels(part), pixels(self.render("whole.exr", "--samples", "128")))
        self.assertEqual(tandem("compare", part, self.render("b.exr", "--samples", "128", "--seed", "2")).returncode, 0)

    def test_gaps_overlaps_and_parts_of_something_else_are_refused(self):
        a, c = self.render("a.exr", "--range", "0:64"), self.render("c.exr", "--range", "128:192", "--samples", "192")
        out = ("-o", self.folder / "out.exr")
        self.refused(tandem("merge", a, c, *out), "no part holds samples 64:128", "--allow-gaps")
        self.refused(tandem("merge", c, c, *out), "c.exr", "holds samples 128:192, of which others hold 128:192")
        last = self.render("last.exr", "--range", "0:128", "--samples", "192")
        self.refused(tandem("merge", last, *out), "no part holds samples 128:192")
        other = self.write(json.loads(self.scene.read_text()) | {"background": [0.5, 0.5, 0.51]}, "other.json")
        for options, reason in ((("--bounces", "3"), "bounces 3, not 12"), (("--seed", "9"), "seed 9, not 0"),
                                (("--precision", "double"), "precision"), (("--filter", "tent"), "filter \"tent\", not \"box\""), (("--size", "8"), "width 8, not 16")):
            with self.subTest(options=options):
                part = self.folder / "other.exr"
                self.assertEqual(tandem("render", self.scene, "-o", part, "--range", "64:128", *(options if "--size" in options else ("--size", "16", *options))).returncode, 0)
                self.refused(tandem("merge", a, part, *out), "other.exr", "other settings", reason)
        self.refused(tandem("merge", a, self.render("other.exr", "--range", "64:128", scene=other), *out), "other.exr", "another scene")
        self.refused(tandem("merge", a, self.render("plain.exr"), *out), "plain.exr", "holds no sums")
        self.refused(tandem("merge", a, self.scene, *out), "is no EXR image")
        self.assertFalse((self.folder / "out.exr").exists())
        kept = tandem("merge", a, c, *out, "--allow-gaps", "--json", self.folder / "out.json")
        self.assertEqual(kept.returncode, 0, kept.stderr)
        self.assertIn("missing are samples 64:128", kept.stdout)
        report = json.loads((self.folder / "out.json").read_text())
        self.assertEqual(report["gaps"], [{"begin": 64, "end": 128}])
        self.assertEqual(report["samples"], 128)

    def test_a_damaged_part_is_refused(self):
        part = self.render("part.exr", "--range", "0:64")
        bytes = part.read_bytes()
        for at in (len(bytes) // 2, len(bytes) - 40):
            part.write_bytes(bytes[:at])
            self.refused(tandem("merge", part, "-o", self.folder / "out.exr"), "part.exr")
        part.write_bytes(bytes.replace(b"0:64", b"0:6x"))
        self.refused(tandem("merge", part, "-o", self.folder / "out.exr"), "part.exr", "damaged")

    def test_ranges_that_cannot_be_are_refused_before_work(self):
        part = ("-o", self.folder / "part.exr")
        for options, reason in ((("--range", "10:64"), "begins at a multiple of 64, as 0 or 64, not at 10"),
                                (("--range", "64:64"), "is no range"), (("--range", "64"), "is no range"),
                                (("--range", "0:128", "--samples", "64"), "beyond the --samples 64"),
                                (("--range", "0:64", "--time", "1"), "--time"),
                                (("--range", "0:64", "--target-error", "5%"), "--target-error"),
                                (("--range", "0:64", "--sampling", "adaptive"), "adaptive"),
                                (("--range", "0:64", "--accumulation", "plain"), "plain")):
            with self.subTest(options=options):
                self.refused(tandem("render", self.scene, *part, *options), reason)
        self.refused(tandem("render", self.scene, "-o", self.folder / "part.png", "--range", "0:64"), "part.png", ".exr")
        self.assertEqual(self.left_behind(), [])


class Devices(PartsTest):
    """Lists of devices; lavapipe stands for several where it is named several times."""

    def test_equal_devices_share_an_image_of_the_same_bits(self):
        how = ("--backend", "vulkan", "--samples", "600")
        one = pixels(self.render("one.exr", *how))
        self.assertEqual(pixels(self.render("two.exr", *how, "--device", "0,0")), one)
        self.assertEqual(pixels(self.render("all.exr", *how, "--device", "all")), one)
        part = tandem("render", self.scene, "-o", self.folder / "rest.exr", "--size", "16", *how, "--device", "0,nonsense,0")
        self.assertEqual(part.returncode, 0, part.stderr)
        self.assertIn("device nonsense is left out", part.stderr)
        self.assertEqual(pixels(self.folder / "rest.exr"), one)

    def test_the_cpu_may_be_one_of_them(self):
        image = self.render("both.exr", "--backend", "vulkan", "--device", "cpu,0", "--samples", "600")
        told = subprocess.run(["oiiotool", "--info", "-v", image], capture_output=True, text=True).stdout
        self.assertIn("cpu + vulkan", told)
        self.assertEqual(tandem("compare", image, self.render("b.exr", "--samples", "600", "--seed", "2")).returncode, 0)

    def test_several_devices_are_judged_as_one(self):
        how = (self.scene, "--samples", "128", "--size", "8", "--oracle", "none", "--no-layer", "--json", self.folder / "out.json")
        result = tandem("verify", *how, "--device", "0,0")
        self.assertIn(result.returncode, (0, 3), result.stderr)
        self.assertIn("vulkan, 2 x ", result.stdout)
        self.assertEqual(result.stdout.count("Self-test of "), 2)
        self.assertEqual(len(json.loads((self.folder / "out.json").read_text())["device_self_tests"]), 2)
        self.refused(tandem("verify", *how, "--device", "0,cpu"), "cpu cannot be judged")
        self.refused(tandem("verify", *how, "--device", "0,1", "--candidate", "oracle"), "for the candidate vulkan")
        self.assertEqual(tandem("verify", *how, "--device", "0,none").returncode, 4)

    def test_none_that_is_left_is_an_error(self):
        out = ("-o", self.folder / "x.exr")
        self.assertEqual(tandem("render", self.scene, *out, "--backend", "vulkan", "--device", "none,nothing").returncode, 4)
        self.refused(tandem("render", self.scene, *out, "--device", "0,1"), "--backend vulkan")


class Resume(PartsTest):
    def test_a_render_goes_on_to_the_same_bits(self):
        whole = pixels(self.render("whole.exr", "--samples", "600"))
        sums = ("--resume", self.folder / "sums.exr")
        self.render("first.exr", "--samples", "256", *sums)
        self.assertEqual(pixels(self.render("second.exr", "--samples", "600", *sums)), whole)
        again = tandem("render", self.scene, "-o", self.folder / "third.exr", "--size", "16", "--samples", "600", *sums)
        self.assertIn("in 0.00 s", again.stdout)
        self.refused(tandem("render", self.scene, "-o", self.folder / "x.exr", "--size", "16", "--samples", "700", *sums),
                     "sums.exr", "ends at sample 600, within a block of 64")
        self.refused(tandem("render", self.scene, "-o", self.folder / "x.exr", "--size", "16", "--seed", "5", *sums), "sums.exr", "seed 0, not 5")

    def test_what_a_stop_or_a_kill_interrupts_goes_on(self):
        """Stopped in the midst of a block, and killed after it was kept."""
        sums, image = self.folder / "sums.exr", self.folder / "image.exr"
        how = ["render", SCENES / "cornell-classic.json", "-o", image, "--size", "96", "--samples", "2048"]
        # One thread, so that no machine is done before the signal comes.
        begin = [TANDEM, *map(str, how), "--resume", sums, "--threads", "1"]
        process = subprocess.Popen(begin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        until(sums.exists, "sums are kept")
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 3, errors)
        process = subprocess.Popen(begin, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        at_work(process, 0.5)
        process.kill()
        process.communicate(timeout=60)
        # Whole, whenever the kill came.
        self.assertEqual(tandem("merge", sums, "-o", self.folder / "kept.exr", "--allow-gaps").returncode, 0)
        self.assertEqual(tandem(*how, "--resume", sums).returncode, 0)
        resumed = pixels(image)
        self.assertEqual(tandem(*how).returncode, 0)
        self.assertEqual(resumed, pixels(image))


if __name__ == "__main__":
    unittest.main()
