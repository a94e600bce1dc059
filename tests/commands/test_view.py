# The window on a virtual display, by real events of mouse and keyboard. Skipped, visibly, where there is no Xvfb.
import json
import os
import time
import unittest

from program import tandem, until
from viewer import ViewTest as WindowTest


class ViewTest(WindowTest):
    def test_an_image_of_n_samples_has_the_bits_of_a_render(self):
        seen, rendered = self.folder / "seen.pfm", self.folder / "rendered.pfm"
        result = self.view("--samples", 100, "--frames", 3, "-o", seen, "--json", self.folder / "view.json")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(tandem("render", self.scene, "--samples", 100, "-o", rendered).returncode, 0)
        self.assertEqual(seen.read_bytes(), rendered.read_bytes())
        report = json.loads((self.folder / "view.json").read_text())
        self.assertEqual(report["backends"][0]["samples"], 100)
        self.assertGreaterEqual(report["frames"], 3)
        self.assertIn("100 samples a pixel of 16x16", result.stdout)

    def test_frames_alone_close_the_window(self):
        result = self.view("--frames", 7)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("window: 7 frames", result.stdout)

    def test_every_present_mode_shows(self):
        for mode in ["fifo", "fifo-relaxed", "mailbox", "immediate"]:
            result = self.view("--samples", 1, "--frames", 5, "--present-mode", mode)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(mode, result.stdout)

    def test_a_drag_turns_the_camera_and_a_saved_view_renders(self):
        process, _ = self.start("--save", self.folder / "turned", "--json", self.folder / "view.json")
        files = [self.folder / name for name in ("turned.json", "turned.png", "turned-cpu.exr")]
        for _ in range(3):  # a window that has no frame meanwhile, as its machine was away, sees no drag
            self.poke("mousemove", 300, 300, "mousedown", 1)
            for _ in range(5):
                self.poke("mousemove_relative", "--", 10, 4)
                time.sleep(0.1)
            self.poke("mouseup", 1)
            time.sleep(1)
            self.poke("key", "F2")
            until(lambda: all(file.exists() for file in files), "the view is saved")
            position = json.loads(files[0].read_text())["camera"]["position"]
            if position[2] < 3.99:
                break
            for file in files:
                file.unlink()
        self.poke("key", "Escape")
        self.ended(process)
        self.assertEqual(position, json.loads((self.folder / "view.json").read_text())["camera"]["position"])
        self.assertAlmostEqual(sum(x * x for x in position), 16.0, places=6)  # about the target, 4 away
        self.assertLess(position[2], 3.99)
        for file in files:
            self.assertGreater(file.stat().st_size, 0)
        self.assertEqual(tandem("render", self.folder / "turned.json", "-o", self.folder / "x.pfm").returncode, 0)

    def test_a_saved_image_has_variances_where_samples_tell_them(self):
        for generator, has in (("philox", True), ("sobol", False)):
            image = self.folder / f"{generator}.exr"
            done = self.view("-o", image, "--samples", "8", "--frames", "20", "--generator", generator)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(b"variance.R" in image.read_bytes(), has, generator)

    def test_a_wish_to_stop_closes_the_window(self):
        process, _ = self.start("-o", self.folder / "seen.pfm")
        process.terminate()
        self.ended(process)
        self.assertTrue((self.folder / "seen.pfm").exists())

    def test_no_display_is_one_line(self):
        environment = {key: value for key, value in self.environment().items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self.refused(tandem("view", self.scene, "--backend", "cpu", env=environment), "no display", status=4)

    def test_nothing_that_was_read_is_overwritten(self):
        before = self.scene.read_bytes()
        self.refused(self.view("--save", str(self.scene).removesuffix(".json")), "would overwrite")
        self.refused(self.view("-o", self.folder / "x.jpg"), "x.jpg")
        self.assertEqual(self.scene.read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
