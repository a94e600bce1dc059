# The window on a virtual display, by real events of mouse and keyboard. Skipped, visibly, where there is no Xvfb.
import json
import os
import shutil
import subprocess
import sys
import time
import unittest

from program import TANDEM, ProgramTest, tandem

LAYER = {"TANDEM_VALIDATION": "1"}
if not shutil.which("Xvfb") or not shutil.which("xdotool"):
    print("skipped: Xvfb or xdotool is not installed; run scripts/setup")
    sys.exit(77)


class ViewTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        # Xvfb chooses a free display and writes its number.
        read, write = os.pipe()
        cls.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"], pass_fds=[write],
                                      stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as lines:
            cls.display = ":" + lines.readline().strip()

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        cls.server.wait()

    def environment(self):
        return {**os.environ, **LAYER, "DISPLAY": self.display}

    def view(self, *arguments, **options):
        return tandem("view", self.scene, "--backend", "cpu", *arguments, env=self.environment(), **options)

    def start(self, *arguments):
        """A window that stays open, and how to poke it."""
        process = subprocess.Popen([TANDEM, "view", str(self.scene), "--backend", "cpu", *map(str, arguments)],
                                   env=self.environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and process.poll() is None:
            found = self.poke("search", "--name", "Tandem", check=False).stdout.split()
            if found:
                time.sleep(1)
                return process, found[-1]
            time.sleep(0.1)
        self.fail(f"no window appeared: {process.communicate(timeout=10)}")

    def poke(self, *words, check=True):
        return subprocess.run(["xdotool", *map(str, words)], env=self.environment(), capture_output=True, text=True, check=check, timeout=30)

    def ended(self, process):
        output, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        self.assertEqual(errors, "")
        return output

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
        self.poke("mousemove", 300, 300, "mousedown", 1)
        for _ in range(5):
            self.poke("mousemove_relative", "--", 10, 4)
            time.sleep(0.1)
        self.poke("mouseup", 1)
        time.sleep(1)
        self.poke("key", "F2")
        time.sleep(1)
        self.poke("key", "Escape")
        self.ended(process)
        saved = json.loads((self.folder / "turned.json").read_text())
        position = saved["camera"]["position"]
        self.assertEqual(position, json.loads((self.folder / "view.json").read_text())["camera"]["position"])
        self.assertAlmostEqual(sum(x * x for x in position), 16.0, places=6)  # about the target, 4 away
        self.assertLess(position[2], 3.99)
        for name in ["turned.png", "turned-cpu.exr"]:
            self.assertGreater((self.folder / name).stat().st_size, 0)
        self.assertEqual(tandem("render", self.folder / "turned.json", "-o", self.folder / "x.pfm").returncode, 0)

    def test_the_layer_has_nothing_to_say_about_sizes_and_hiding(self):
        process, window = self.start("--json", self.folder / "view.json")
        for i in range(60):
            if i % 10 == 5:
                self.poke("windowunmap", window)
                self.poke("windowmap", window)
            else:
                self.poke("windowsize", window, 1 + 37 * i % 700, 1 + 53 * i % 500)
        self.poke("windowsize", window, 640, 400)
        time.sleep(1)
        self.poke("key", "--window", window, "Escape")
        self.ended(process)
        self.assertGreater(json.loads((self.folder / "view.json").read_text())["swapchains"], 5)

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
