# The HTML report as a browser shows it. Every picture decodes, every plot is there, nothing is fetched, nothing runs
# over the side, and hovering flips the images. Run by ctest with TANDEM = the program, SCENES = the folder, SCRIPTS =
# scripts/.
import html
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TANDEM, SCENES, SCRIPTS = (pathlib.Path(os.environ[name]) for name in ("TANDEM", "SCENES", "SCRIPTS"))
BROWSER = next(filter(None, map(shutil.which, ("chromium", "google-chrome", "chromium-browser"))), None)
SKIPPED = 77  # what ctest counts as skipped
# One in the history, which --check looks for; without history any will do.
COMMIT = subprocess.run(["git", "-C", SCRIPTS, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True).stdout.strip() or "0123456789ab"

# Appended to a copy of the page: what it measures becomes the page's title.
PROBE = """<script>
addEventListener("load", () => {
  const shown = sheet => [...sheet.cssRules].map(rule => rule.cssText).join(" ");
  const figures = [...document.querySelectorAll("figure")];
  document.title = JSON.stringify({
    pictures: [...document.images].map(i => [i.alt, i.naturalWidth, i.naturalHeight, i.getBoundingClientRect().width]),
    plots: [...document.querySelectorAll("svg")].map(s => s.getBoundingClientRect().width),
    wide: document.documentElement.scrollWidth - innerWidth,
    clipped: [...document.querySelectorAll(".scroll, figure, p, li")].filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.innerText),
    rows: document.querySelectorAll("#verdicts tbody tr").length,
    hidden: [...document.querySelectorAll(".flip img + img")].map(i => getComputedStyle(i).opacity),
    focused: (() => { const f = document.querySelector(".flip"); f.focus();
                      return getComputedStyle(f.querySelector("img + img")).opacity; })(),
    hover: [...document.styleSheets].map(shown).join(" ").includes(".flip:hover img + img"),
    fetched: performance.getEntriesByType("resource").filter(r => !r.name.startsWith("data:")).map(r => r.name),
    text: document.body.innerText,
    captions: figures.map(f => f.innerText),
  });
});
</script>"""


def run(*arguments):
    result = subprocess.run(list(map(str, arguments)), capture_output=True, text=True, timeout=300)
    if result.returncode not in (0, 1, 3):
        raise RuntimeError(f"{arguments}: {result.stderr}")
    return result


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        # How long the first takes to show how its errors fall depends on the machine.
        scenes = [SCENES / "cornell-thesis.json", SCENES / "mirror-corridor.json"]
        for seconds in (10, 40, 80):
            run(TANDEM, "verify", *scenes, "--candidate", "oracle", "--oracle", "none", "--size", "8", "--samples", "256",
                "--time", seconds, "--convergence", "--report", cls.folder)
            if json.loads((cls.folder / "report.json").read_text())["scenes"][0]["convergence"]:
                break
        run(sys.executable, SCRIPTS / "report", cls.folder)
        page = (cls.folder / "report.html").read_text()
        cls.page = page
        (cls.folder / "probed.html").write_text(page.replace("</body>", PROBE + "</body>"))
        cls.seen = cls.see(1280)
        cls.report = json.loads((cls.folder / "report.json").read_text())

    @classmethod
    def see(cls, width):
        """What the page measures of itself in a window of that width."""
        dom = run(BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={cls.folder / 'profile'}",
                  f"--window-size={width},1600", "--virtual-time-budget=5000", "--dump-dom",
                  (cls.folder / "probed.html").as_uri()).stdout
        title = dom.split("<title>", 1)[1].split("</title>", 1)[0]
        for entity, character in (("&lt;", "<"), ("&gt;", ">"), ("&nbsp;", "\u00a0"), ("&amp;", "&")):
            title = title.replace(entity, character)
        return json.loads(title)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_every_scene_has_a_row_and_six_pictures_that_decode(self):
        self.assertEqual(self.seen["rows"], 2)
        self.assertEqual(len(self.seen["pictures"]), 2 * 6)
        sizes = [(scene["settings"]["width"], scene["settings"]["height"]) for scene in self.report["scenes"]]
        self.assertEqual(max(sizes[0]), 8)
        for index, (alt, width, height, shown) in enumerate(self.seen["pictures"]):
            self.assertEqual((width, height), sizes[index // 6], alt)
            self.assertGreater(shown, 100, alt)

    def test_the_two_images_flip(self):
        self.assertEqual(self.seen["hidden"], ["0", "0"])
        self.assertEqual(self.seen["focused"], "1")
        self.assertTrue(self.seen["hover"])

    def test_convergence_is_plotted(self):
        measured = [scene["convergence"] for scene in self.report["scenes"] if scene["convergence"]]
        self.assertTrue(measured)
        noisy = measured[0]
        self.assertGreaterEqual(len(noisy["samples"]), 3)
        for side in ("reference", "candidate"):  # of what the plot shows the errors fall, as they were measured
            errors = [error["value"] for error in noisy[side]["squared_errors_relative"]]
            self.assertLess(errors[-1], errors[0])
        self.assertGreaterEqual(len(self.seen["plots"]), len(measured))
        for count in noisy["samples"]:
            self.assertIn(f"<!-- {count} -->", self.page)
        for width in self.seen["plots"]:
            self.assertGreater(width, 200)

    def test_it_stands_by_itself_and_fits_the_window(self):
        self.assertEqual(self.seen["fetched"], [])
        for width in (1200, 400):
            seen = self.see(width)
            self.assertLessEqual(seen["wide"], 0, width)
            self.assertEqual(seen["clipped"], [], width)

    def test_captions_follow_the_verdict(self):
        for scene, captions in zip(self.report["scenes"], (self.seen["captions"][:5], self.seen["captions"][5:])):
            text = " ".join(captions).replace("\n", " ")
            said = {"agree": "What is left is noise or rounding.", "disagree": "where the sides disagree", "undecided": "what may hide in it"}
            for verdict, mention in said.items():
                if scene["images"]["difference_range_relative"]:
                    self.assertEqual(mention in text, verdict == scene["verdict"], text)
            within = scene["worst_tile_relative"] < scene["margin_tile_relative"]
            self.assertEqual("Every tile is shown to lie within it" in text, within, text)

    def test_it_says_what_issue_and_reader_ask_for(self):
        text = self.seen["text"]
        for mention in ("Verdict:", "Levels", "Looks", "Convergence", "relMSE", "ε = 0.01", "tandem trace", "Paired seeds",
                        "Devices, settings and criteria", "How to read this"):
            self.assertIn(mention, text)
        for mention in ("Tiles 16×16", "least p of the three channels", "candidate − reference"):
            self.assertTrue(any(mention in caption for caption in self.seen["captions"]), mention)


def cost_arm(knob, setting, factor, floor, pareto):
    times = [{"relative_error": e, "seconds": None if floor > e else factor / e**2, "seconds_low": None, "seconds_high": None,
              "samples": None if floor > e else 1 / e**2, "extrapolated": e < 0.01, "floor_unknown": False}
             for e in (0.05, 0.01, 0.005, 0.001)]
    points = [{"samples": n, "seconds": factor * n, "seconds_low": factor * n, "seconds_high": factor * n,
               "rmse": (1 / n + floor**2)**0.5, "rmse_low": 0.9 / n**0.5, "rmse_high": 1.1 / n**0.5, "relmse": 1 / n}
              for n in (16, 64, 256, 1024)]
    ratio = {"value": factor, "low": 0.9 * factor, "high": 1.1 * factor}
    return {"knob": knob, "setting": setting, "options": "", "replicates": 12, "points": points, "bias_floor": floor,
            "bias_floor_low": 0.9 * floor, "bias_floor_high": 1.1 * floor + 1e-4, "bias_floor_significant": floor > 0,
            "efficiency": 1.0, "slope": None if setting == "8" else -0.5, "slope_low": -0.52, "slope_high": -0.48,
            "seconds_to": times, "seconds_to_one_percent": times[1]["seconds"], "pareto": pareto, "time_ratio": ratio,
            "cost_ratio": ratio, "cost_differs": True, "keeps_estimate": floor == 0}


class CostReport(unittest.TestCase):
    def test_the_page_of_tandem_cost_has_plots_table_and_recommendations(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        report = {"scene": "box", "backend": "cpu", "device": "a device", "driver": "a driver", "width": 64, "height": 36,
                  "reference": {"samples": 4096, "relative_uncertainty": 0.01, "backend": "cpu", "options": "--bounces 256"},
                  "arms": [cost_arm("baseline", "", 1e-3, 0, False), cost_arm("bounces", "1", 4e-4, 0.2, True),
                           cost_arm("bounces", "8", 9e-4, 0, False), cost_arm("roulette", "4", 5e-4, 0, True)],
                  "not_measured": [{"knob": "precision", "setting": "mixed", "reason": "not here"}],
                  "recommendations": ["To 1 %: `tandem render box.json --roulette 4 --samples 10000`"]}
        report["arms"][1] |= {"flip": 0.031, "noise": 0.02, "regions": {name: {"rmse": 0.4} for name in ("dark", "bright", "edges")},
                              "most_biased_tile": {"x": 16, "y": 32, "edge": 16, "significant": True,
                                                   "relative_bias": {"value": -0.12, "low": -0.15, "high": -0.09}}}
        file = folder / "cost.json"
        file.write_text(json.dumps(report))
        run(sys.executable, SCRIPTS / "report", file)
        page = folder / "cost.html"
        page.write_text(page.read_text() + PROBE.replace('document.querySelector(".flip")', "document.body").replace(
            'getComputedStyle(f.querySelector("img + img")).opacity', '""'))
        shown = run(BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}",
                    "--virtual-time-budget=5000", "--dump-dom", page.as_uri()).stdout
        title = shown.split("<title>", 1)[1].split("</title>", 1)[0]
        told = json.loads(html.unescape(title))
        self.assertEqual(len(told["plots"]), 3)  # all, bounces, roulette
        self.assertTrue(all(width > 200 for width in told["plots"]), told["plots"])
        self.assertEqual(told["fetched"], [])
        for text in ("roulette 4", "never", "20 % (18 % to 22 %)", "precision mixed: not here", "0.031", "40 %",
                     "(16, 32): -12 % (-15 to -9)", "--roulette 4 --samples 10000"):
            self.assertIn(text, told["text"].replace("\u00a0", " "))


def bench_report():
    """As tandem bench --arm-library writes: an arm that is slower, and one that this device has not."""
    def arm(name, work, ms, ratio, **more):
        compared = {"p": 0.001, "p_family": 0.001, "verdict": "slower"} if ratio != 1 else {}
        return {"family": "fills", "arm": name, "text": f"what {name} does", "baseline": "one-fill", "clock": "total",
                "workload": {"name": f"{work} bytes", "factors": {"bytes": work}}, "milliseconds": {"total": ms}, "samples": 40,
                "ratio": ratio, "ratio_low": 0.97 * ratio, "ratio_high": 1.03 * ratio, "identity": "identical", **compared, **more}
    arms, raw = [], []
    for work in (65536, 1048576):
        lacks = {"family": "fills", "arm": "never", "text": "", "baseline": "one-fill", "clock": "total", "samples": 0,
                 "workload": {"name": f"{work} bytes", "factors": {"bytes": work}}, "milliseconds": {},
                 "identity": "not-applicable", "reason": "a reason of so many words that it does not fit a line of a telephone"}
        arms += [arm("one-fill", work, 0.1, 1), arm("many-fills", work, 0.3, 3), lacks]
        raw += [{"family": "fills", "workload": {"name": f"{work} bytes"}, "arms": [
            {"arm": "one-fill", "milliseconds": {"total": [0.1 * x] * 5}},
            {"arm": "many-fills", "milliseconds": {"total": [0.3 * x] * 5}}, {"arm": "never", "milliseconds": {}}]} for x in (0.9, 1, 1.2)]
    family = {"name": "fills", "question": "Does it matter?", "held": "all", "clock": "total", "along": "bytes", "base": "a fill"}
    return {"device": {"name": "a device", "driver_name": "d", "driver_version": "1", "arm_library_hash": "0"}, "git": "abc",
            "command": "tandem bench --arm-library my.so", "floor": {"median_milliseconds": 0.05}, "families": [family], "arms": arms,
            "claims": [], "crossovers": [], "raw": raw}


class BenchReport(unittest.TestCase):
    def shown(self, width):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        file = folder / "bench.json"
        file.write_text(json.dumps(bench_report()))
        run(sys.executable, SCRIPTS / "report", file)
        page = folder / "bench.html"
        page.write_text(page.read_text() + PROBE.replace('document.querySelector(".flip")', "document.body").replace(
            'getComputedStyle(f.querySelector("img + img")).opacity', '""').replace('".scroll, figure, p, li"', '"p, li, td, h1, h2"'))
        shown = run(BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}",
                    f"--window-size={width},1600", "--virtual-time-budget=5000", "--dump-dom", page.as_uri()).stdout
        return json.loads(html.unescape(shown.split("<title>", 1)[1].split("</title>", 1)[0]))

    def test_the_page_of_tandem_bench_has_verdict_plots_and_tables(self):
        told = self.shown(1200)
        self.assertEqual(len(told["plots"]), 3)  # over the work, and one at each amount
        self.assertEqual(told["fetched"], [])
        for text in ("many-fills: slower than one-fill at 1048576 bytes: +200.0 %", "0.09 to 0.12", "a fill",
                     "not applicable: a reason of so many words"):
            self.assertIn(text, told["text"].replace("\u00a0", " "))

    def test_it_fits_a_telephone(self):
        told = self.shown(400)
        self.assertLessEqual(told["wide"], 0)
        self.assertEqual(told["clipped"], [])

    def test_the_thesis_s_experiment_has_a_page_of_its_own(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        stored = SCENES.parent / "tests/records/patterns/h100-thesis.json"
        subprocess.run([sys.executable, SCRIPTS / "report", stored, "-o", folder / "page.html"], check=True, timeout=60)
        page = (folder / "page.html").read_text()
        cell = json.loads(stored.read_text())["thesis"]["configurations"][0]
        for text in (f"{cell['steady']['mean_milliseconds']:.4g} (", f"{cell['thesis']['first_milliseconds']:.1f}",
                     "samples a frame, at two bounces", "Not applicable: "):
            self.assertIn(text, page)
        self.assertEqual(page.count("<table>"), 3)

    def test_what_has_no_arms_is_refused(self):
        file = pathlib.Path(tempfile.mkdtemp()) / "thesis.json"
        self.addCleanup(shutil.rmtree, file.parent)
        for wrong in ({"thesis": {}}, [1], {"arms": [], "recommendations": []}):
            file.write_text(json.dumps(wrong))
            result = subprocess.run([sys.executable, SCRIPTS / "report", file], capture_output=True, text=True, timeout=60)
            self.assertEqual(result.returncode, 2, wrong)
            self.assertIn("tandem bench --json", result.stderr)
            self.assertNotIn("Traceback", result.stderr)


# Appended to a copy of the overview: moves the slider, chooses another picture, and tells what the page measures of itself.
OVERVIEW_PROBE = """<script>
addEventListener("load", () => {
  const [left, right] = document.querySelectorAll(".slider img"), range = document.querySelector(".slider input");
  const before = left.src;
  range.value = 25; range.dispatchEvent(new Event("input"));
  const choice = document.querySelector(".slider select");
  choice.value = "0"; choice.dispatchEvent(new Event("change"));
  document.title = JSON.stringify({
    plots: [...document.querySelectorAll("svg.frontier")].map(s => s.getBoundingClientRect().width),
    dots: [...document.querySelectorAll(".dots")].map(d => (d.getAttribute("d").match(/M/g) || []).length),
    best: [...document.querySelectorAll("svg.frontier")].map(s => s.querySelectorAll(".best").length),
    pictures: [...document.querySelectorAll("img.picture, img.difference")].map(i => [i.naturalWidth, i.naturalHeight]),
    clip: right.style.clipPath, changed: left.src !== before,
    same: left.src === document.querySelector("img.picture").src,
    wide: document.documentElement.scrollWidth - innerWidth,
    clipped: [...document.querySelectorAll("p, li, td, figure, h3")].filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.innerText),
    fetched: performance.getEntriesByType("resource").filter(r => !r.name.startsWith("data:")).map(r => r.name),
    text: document.body.innerText,
  });
});
</script>"""


def stored_result(scene, factor):
    arms = [cost_arm("baseline", "", 2e-3 * factor, 0, False), cost_arm("bounces", "1", 1e-4 * factor, 0.2, True),
            cost_arm("roulette", "4", 5e-4 * factor, 0, True)]
    for point in arms[1]["points"]:
        point["rmse_low"] = 0.9 * point["rmse"]
    arms[2]["seconds_to"][1]["extrapolated"] = True  # to 1 %
    return {"scene": scene, "backend": "cpu", "device": "a device with a long name, 128 threads", "driver": "a driver", "width": 64,
            "height": 36, "git": COMMIT, "arms": arms, "not_measured": [], "recommendations": [],
            "reference": {"samples": 4096, "relative_uncertainty": 0.001, "backend": "cpu", "options": "--bounces 256"}}


class Overview(unittest.TestCase):
    """The page over scenes and machines, of results and pictures that are written here."""

    @classmethod
    def setUpClass(cls):
        from PIL import Image  # python3-matplotlib brings it
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        for machine, factor in (("cpu", 1), ("gpu", 0.01)):
            (cls.folder / machine).mkdir()
            for scene in ("box", "glass"):
                (cls.folder / machine / f"{scene}.json").write_text(json.dumps(stored_result(scene, factor)))
        pictures = cls.folder / "pictures/cpu/box"
        pictures.mkdir(parents=True)
        kept = [{"file": "r.png", "title": "reference", "options": "--bounces 256", "seconds": None, "error": None,
                 "shown_error": None}]
        for number, title in enumerate(("1 s, roulette 4", "1 s, baseline")):
            kept.append({"file": f"{number}.png", "difference": f"{number}d.png", "title": title, "options": "--roulette 4", "seconds": 1.0,
                         "error": 0.125, "shown_error": (0.12, 0.07)[number], "at_most": bool(number)})
        for number, name in enumerate(name for picture in kept for name in (picture["file"], picture.get("difference")) if name):
            Image.new("RGB", (32, 18), (40 * number, 90, 120)).save(pictures / name)
        (pictures / "pictures.json").write_text(json.dumps(
            {"scene": "box", "width": 32, "height": 18, "device": "a device", "commit": COMMIT, "full_colour": 0.5,
             "reference": {"samples": 4096, "relative_uncertainty": 0.001, "seconds": 60}, "missing": ["5 %, baseline: not reached"],
             "pictures": kept}))
        run(sys.executable, SCRIPTS / "report", cls.folder)
        cls.page = (cls.folder / "overview.html").read_text()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def see(self, width):
        probed = self.folder / "probed.html"
        probed.write_text(self.page.replace("</body>", OVERVIEW_PROBE + "</body>"))
        shown = run(BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={self.folder / 'profile'}",
                    f"--window-size={width},1600", "--virtual-time-budget=5000", "--dump-dom", probed.as_uri()).stdout
        return json.loads(html.unescape(shown.split("<title>", 1)[1].split("</title>", 1)[0]))

    def test_every_scene_and_machine_has_a_plot_and_the_slider_moves(self):
        seen = self.see(1200)
        self.assertEqual(len(seen["plots"]), 4)
        self.assertTrue(all(width > 250 for width in seen["plots"]), seen["plots"])
        # A dot for each of three settings' four points, without those whose interval reaches too low.
        known = [p for p in stored_result("box", 1)["arms"] for p in p["points"] if p["rmse_low"] > 0.5 * p["rmse"]]
        self.assertEqual(seen["dots"], 4 * [len(known)])
        self.assertTrue(all(count >= 1 for count in seen["best"]), seen["best"])
        self.assertEqual(seen["pictures"], 5 * [[32, 18]])
        self.assertIn("25%", seen["clip"])
        self.assertTrue(seen["changed"] and seen["same"])
        self.assertEqual(seen["fetched"], [])
        text = seen["text"].replace("\u00a0", " ").replace("\n", " ")
        for mention in ("not reached", "never", "bias 20 %", "error 12 %", "error below 12 %", "as shown, clipped: 7 %",
                        "5 %, baseline: not reached", f"commit {COMMIT}"):
            self.assertIn(mention, text)
        self.assertNotIn("clipped: 12 %", text)  # where it is near, the error alone is told
        self.assertNotIn("forecast", text.replace("Nothing is forecast", ""))

    def test_nothing_runs_over_the_side(self):
        for width in (1200, 400):
            seen = self.see(width)
            self.assertLessEqual(seen["wide"], 0, width)
            self.assertEqual(seen["clipped"], [], width)

    def test_check_finds_a_page_that_is_not_of_the_results(self):
        check = [sys.executable, SCRIPTS / "report", self.folder, "--check"]
        self.assertEqual(run(*check).returncode, 0)
        page = self.folder / "overview.html"
        page.write_text(self.page + " ")
        self.assertEqual(run(*check).returncode, 1)
        page.write_text(self.page)
        pictures = self.folder / "pictures/cpu/box/pictures.json"
        clean = pictures.read_text()
        pictures.write_text(clean.replace(f'"{COMMIT}"', f'"{COMMIT}-dirty"'))
        run(sys.executable, SCRIPTS / "report", self.folder)
        self.assertEqual(run(*check).returncode, 1)
        pictures.write_text(clean)
        page.write_text(self.page)

    def test_each_scene_has_a_page_of_its_own(self):
        run(sys.executable, SCRIPTS / "report", self.folder, "--scenes", self.folder / "pages")
        pages = {path.stem: path.read_text() for path in (self.folder / "pages").iterdir()}
        self.assertEqual(sorted(pages), ["box", "glass"])
        self.assertEqual([page.count("<svg class=") for page in pages.values()], [2, 2])
        self.assertNotIn('id="glass"', pages["box"])


if __name__ == "__main__":
    if BROWSER is None:
        print("skipped: there is no Chromium here; apt-get install chromium")
        sys.exit(SKIPPED)
    unittest.main()
