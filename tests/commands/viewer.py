# What tests of the window share: a virtual display of their own, tandem view on it, and real events. Where Xvfb or xdotool
# is not installed, whoever imports this is skipped, visibly.
import ctypes
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

import numpy

from program import TANDEM, ProgramTest, tandem

if not shutil.which("Xvfb") or not shutil.which("xdotool"):
    print("skipped: Xvfb or xdotool is not installed; run scripts/setup")
    sys.exit(77)


class ViewTest(ProgramTest):
    layer = {"TANDEM_VALIDATION": "1"}

    @classmethod
    def setUpClass(cls):
        # Xvfb chooses a free display and writes its number. What is on the screen lies in a file (XWD). Without -noreset a server
        # starts anew when its last client, here xdotool, leaves. Meanwhile it refuses windows.
        read, write = os.pipe()
        cls.screen_folder = tempfile.TemporaryDirectory()
        cls.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-noreset", "-screen", "0", "800x600x24", "-fbdir", cls.screen_folder.name],
                                      pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as lines:
            cls.display = ":" + lines.readline().strip()

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        cls.server.wait()
        cls.screen_folder.cleanup()

    def environment(self):
        return {**os.environ, **self.layer, "DISPLAY": self.display}

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

    def poke(self, *words, check=True, timeout=30):
        return subprocess.run(["xdotool", *map(str, words)], env=self.environment(), capture_output=True, text=True, check=check,
                              timeout=timeout)

    def ended(self, process):
        output, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        self.assertEqual(errors, "")
        return output

    def screen(self):
        """What is on the screen: [row, column, (red, green, blue)]."""
        data = (pathlib.Path(self.screen_folder.name) / "Xvfb_screen0").read_bytes()
        header = numpy.frombuffer(data, ">u4", 25)  # X11/XWDFile.h
        size, width, height, line, colours = (int(header[i]) for i in (0, 4, 5, 12, 19))
        rows = numpy.frombuffer(data, "u1", height * line, size + 12 * colours).reshape(height, line)
        return rows[:, :4 * width].reshape(height, width, 4)[:, :, 2::-1]


class Manager:
    """What a window manager would tell of a window: Xvfb has none."""

    def __init__(self, display):
        self.x = ctypes.CDLL("libX11.so.6")
        self.x.XOpenDisplay.restype = ctypes.c_void_p
        self.x.XInternAtom.restype = ctypes.c_ulong
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(display.encode()))
        self.state = ctypes.c_ulong(self.x.XInternAtom(self.display, b"WM_STATE", 0))

    def close(self):
        self.x.XCloseDisplay(self.display)

    def _set(self, window, state):
        value = (ctypes.c_ulong * 2)(state, 0)  # WM_STATE of ICCCM 4.1.3.1
        self.x.XChangeProperty(self.display, ctypes.c_ulong(window), self.state, self.state, 32, 0, ctypes.byref(value), 2)

    def minimise(self, window):
        self._set(window, 3)
        self.x.XUnmapWindow(self.display, ctypes.c_ulong(window))
        self.x.XSync(self.display, 0)

    def restore(self, window):
        self._set(window, 1)
        self.x.XMapWindow(self.display, ctypes.c_ulong(window))
        self.x.XSync(self.display, 0)
