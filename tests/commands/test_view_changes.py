# A window whose size, state and present mode change all the time, and that meets what window systems and devices in trouble
# answer. Run with CHANGES = how many changes, FAULTS = the folder of the layer that lets calls fail (tests/window), if built.
import json
import os
import pathlib
import random
import time
import unittest

from program import until
from viewer import Manager, ViewTest as WindowTest, tandem

CHANGES = int(os.environ.get("CHANGES", "60"))
FAULTS = os.environ.get("FAULTS")
SIZES = [(1, 1), (1, 300), (500, 1), (2, 2), (1200, 900), (640, 360)]


def resident_bytes(process):
    pages = int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def open_files(process):
    return len(list(pathlib.Path(f"/proc/{process.pid}/fd").iterdir()))


class ChangesTest(WindowTest):
    def change(self, manager, window, kind, random_numbers):
        if kind == "size":
            width, height = random_numbers.choice(SIZES + 6 * [(random_numbers.randint(1, 780), random_numbers.randint(1, 580))])
            self.poke("windowsize", window, width, height)
        elif kind == "minimise":
            manager.minimise(int(window))
            time.sleep(random_numbers.choice([0.0, 0.02, 0.2]))
            manager.restore(int(window))
        elif kind == "unmap":
            self.poke("windowunmap", window, "windowmap", window)
        else:
            self.poke("key", "--window", window, {"mode": "p", "full screen": "F11"}[kind])

    def change_often(self, between=lambda process, i: None):
        """Changes, and what the window tells in the end."""
        process, window = self.start("--json", self.folder / "view.json")
        manager = Manager(self.display)
        self.addCleanup(manager.close)
        random_numbers = random.Random(1)
        kinds = 12 * ["size"] + 3 * ["minimise"] + ["unmap"] + 3 * ["mode"] + ["full screen"]
        for i in range(CHANGES):
            self.change(manager, window, random_numbers.choice(kinds), random_numbers)
            time.sleep(random_numbers.choice([0.0, 0.0, 0.03, 0.1]))  # in bursts, or one by one
            if process.poll() is not None:
                self.fail(f"it ended after {i + 1} changes: {process.communicate()}")
            between(process, i)
        self.show_once_more(manager, window)
        self.poke("key", "--window", window, "Escape", check=False)  # the window may be gone before the key is let go
        self.ended(process)
        report = json.loads((self.folder / "view.json").read_text())
        self.assertGreater(report["swapchains"], CHANGES / 4)
        self.assertGreater(report["frames"], CHANGES / 4)
        return report

    def test_changes_leave_the_layer_silent(self):
        self.change_often()

    def test_changes_leave_nothing_behind(self):
        # Without the layer: 1.3.239 itself keeps 0.2 MB of each swapchain.
        self.layer = {"TANDEM_VALIDATION": "0"}
        seen = {}

        def look(process, i):
            if i in (CHANGES // 3, CHANGES - 1):
                seen[i] = resident_bytes(process), open_files(process)

        self.change_often(look)
        (early, early_files), (late, late_files) = seen.values()
        self.assertLess(late - early, 24 * 2**20)  # three images of this screen, which the last swapchain may have more
        self.assertLessEqual(late_files, early_files + 4)

    def show_once_more(self, manager, window):
        """The window is alive: it has the size that it is given, and the picture in its middle."""
        manager.restore(int(window))
        self.poke("windowmove", window, 0, 0, "windowsize", window, 600, 500)
        time.sleep(2)
        if "600x500" not in self.poke("getwindowgeometry", window).stdout:  # it filled the screen
            self.poke("key", "--window", window, "F11")
            time.sleep(1)
            self.poke("windowmove", window, 0, 0, "windowsize", window, 600, 500)
            time.sleep(2)

        def shown():
            picture = self.screen()[:500, :600]
            centre, corner = picture[250, 300], picture[10, 590]  # the ball; the window's grey, 0.1
            return (abs(corner.astype(int) - 26) <= 1).all() and (centre > 100).all() and (centre < 200).all()

        until(shown, "the ball on grey is seen")


@unittest.skipUnless(FAULTS, "the layer that lets calls fail is not built")
class FaultsTest(WindowTest):
    def under(self, faults, validation=True):
        paths = [FAULTS, "/usr/share/vulkan/explicit_layer.d", "/etc/vulkan/explicit_layer.d"]
        return {**self.environment(), "VK_LAYER_PATH": ":".join(paths), "VK_INSTANCE_LAYERS": "VK_LAYER_TANDEM_faults",
                "TANDEM_FAULTS": faults, "TANDEM_VALIDATION": "1" if validation else "0"}

    def faulty(self, faults, *arguments, validation=True):
        return tandem("view", self.scene, "--backend", "cpu", "--frames", 12, "--json", self.folder / "view.json", *arguments,
                      env=self.under(faults, validation))

    def shown_through(self, faults):
        result = self.faulty(faults)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        report = json.loads((self.folder / "view.json").read_text())
        self.assertEqual(report["frames"], 12)
        return report["swapchains"]

    def test_without_faults_one_swapchain_is_enough(self):
        self.assertEqual(self.shown_through(""), 1)

    def test_images_out_of_date_make_a_new_swapchain(self):
        for faults in ["acquire 1 out-of-date", "acquire 5 out-of-date", "acquire 5 suboptimal", "present 1 out-of-date",
                       "present 5 out-of-date", "present 5 suboptimal"]:
            self.assertEqual(self.shown_through(faults), 2, faults)
        many = ", ".join(f"acquire {i} out-of-date, present {i} suboptimal" for i in range(1, 10))
        self.assertGreater(self.shown_through(many), 9)

    def test_a_lost_device_is_one_line(self):
        for faults in ["acquire 5 lost", "present 5 lost", "submit 5 lost", "wait 5 lost"]:
            self.refused(self.faulty(faults, validation=False), "the device that shows the window was lost", status=4)

    def test_a_lost_device_of_a_render_is_one_line(self):
        for faults in ["submit 1 lost", "submit 4 lost", "wait 3 lost"]:
            result = tandem("render", self.scene, "--backend", "vulkan", "--kernel", "stages", "--size", 16, "--samples", 600,
                            "-o", self.folder / "x.pfm", env=self.under(faults, validation=False))
            self.refused(result, "was lost: its driver", "--resume", status=4)
            self.assertFalse((self.folder / "x.pfm").exists())

    def test_a_lost_surface_is_one_line(self):
        for faults in ["acquire 5 surface-lost", "present 5 surface-lost"]:
            self.refused(self.faulty(faults), "the window cannot be shown", status=4)


if __name__ == "__main__":
    unittest.main()
