# The frontier, the sentences of README and the times to an equal error, of results that are written here. Run by ctest with
# SCRIPTS = scripts/.
import importlib.machinery
import importlib.util
import math
import os
import pathlib
import random
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(os.environ["SCRIPTS"]) / "make"))
import accuracy_claims  # noqa: E402  (after the path is set)
import accuracy_pages  # noqa: E402
import equal_error_page  # noqa: E402
import frontier  # noqa: E402

LOADER = importlib.machinery.SourceFileLoader("accuracy", str(pathlib.Path(os.environ["SCRIPTS"]) / "measure/accuracy"))
accuracy = importlib.util.module_from_spec(importlib.util.spec_from_loader("accuracy", LOADER))
sys.dont_write_bytecode = True  # no cache beside the script
LOADER.exec_module(accuracy)


def arm(knob, setting, points, cost=1.0, floor=0.0):
    return {"knob": knob, "setting": setting, "options": f"--{knob} {setting}", "keeps_estimate": floor == 0, "seconds_to": [],
            "bias_floor": floor, "bias_floor_low": 0.9 * floor, "bias_floor_high": 1.1 * floor + 1e-4, "bias_floor_significant": floor > 0,
            "cost_ratio": {"value": cost, "low": 0.9 * cost, "high": 1.1 * cost}, "efficiency": 1.0,
            "points": [{"seconds": t, "rmse": e, "rmse_low": 0.9 * e, "rmse_high": 1.1 * e} for t, e in points]}


def result(*arms):
    return {"scene": "box", "arms": [arm("baseline", "", [(1, 0.5), (4, 0.25), (16, 0.125)]), *arms]}


class Frontier(unittest.TestCase):
    def test_an_error_is_known_between_measured_points_alone(self):
        points = [(1, 0.5), (4, 0.25)]
        self.assertAlmostEqual(frontier.error_at(points, 2), math.sqrt(0.5 * 0.25))
        self.assertIsNone(frontier.error_at(points, 0.99))
        self.assertIsNone(frontier.error_at(points, 4.01))

    def test_a_biased_preview_leads_until_the_better_one_passes_it(self):
        stretches = frontier.frontier(result(arm("bounces", "1", [(0.1, 0.3), (1, 0.3), (16, 0.3)], floor=0.3)))
        self.assertEqual([name for name, _, _ in stretches], ["bounces 1", "baseline"])
        for _, _, points in stretches:
            self.assertTrue(all(0.1 <= t <= 16.001 and 0.124 <= e <= 0.5 for t, e in points), points)
        errors = [e for _, _, points in stretches for _, e in points]
        self.assertTrue(all(after <= frontier.FLAT * before for before, after in zip(errors, errors[1:])), errors)

    def test_a_setting_that_is_hardly_better_does_not_take_over(self):
        close = arm("generator", "hash", [(1, 0.49), (4, 0.245), (16, 0.122)])
        first = frontier.frontier(result(close))
        self.assertEqual(len(first), 1)

    def test_a_point_that_is_not_known_is_not_drawn(self):
        unknown = arm("bounces", "8", [(1, 0.4), (16, 0.001)])
        unknown["points"][1]["rmse_low"] = -0.01
        self.assertEqual(frontier.known_points(unknown), [(1, 0.4)])

    def test_a_plot_has_a_dot_a_point_and_nothing_outside(self):
        report = result(arm("roulette", "4", [(0.5, 0.5), (2, 0.25), (8, 0.125)]))
        plot = frontier.plot(report, frontier.limits([report]), "a title")
        dots = plot.split('class="dots" d="')[1].split('"')[0].strip("M").split("M")
        self.assertEqual(len(dots), 6)
        for dot in dots:
            x, y = map(float, dot.removesuffix("h0").split())
            self.assertTrue(frontier.LEFT <= x <= frontier.WIDTH - frontier.RIGHT and frontier.TOP <= y <= frontier.HEIGHT - frontier.BOTTOM)


class Bias(unittest.TestCase):
    def test_only_what_has_no_limit_of_bounces_is_called_unbiased(self):
        limited, unlimited = arm("generator", "sobol", []), arm("roulette", "4 --bounces 256", [])
        self.assertEqual(accuracy_pages.floor(limited), "no bias found above 0.01\u00a0%")
        self.assertEqual(accuracy_pages.floor(unlimited), "unbiased")
        unlimited["keeps_estimate"] = False  # with another reflectance, say
        self.assertEqual(accuracy_pages.floor(unlimited), "no bias found above 0.01\u00a0%")


def reached(error, seconds):
    return {"relative_error": error, "seconds": seconds, "seconds_low": 0.9 * seconds, "seconds_high": 1.1 * seconds, "extrapolated": False}


class Tables(unittest.TestCase):
    def report(self, confirmations=()):
        sobol = arm("generator", "sobol", [(1, 0.1), (8, 0.02)], 0.5)
        sobol |= {"cost_differs": True, "seconds_to": [reached(0.05, 2.0)]}
        report = result(sobol)
        report["arms"][0] |= {"cost_differs": False, "seconds_to": [reached(0.05, 9.0)]}
        return report | {"confirmations": list(confirmations)}

    def test_what_is_not_reached_tells_the_longest_render(self):
        report = self.report()
        self.assertEqual(accuracy.time_cell(report, 0.003), "not reached by renders up to 16 s")
        self.assertEqual(accuracy_pages.cell(report, report["arms"][0] | {"seconds_to": []}, 0.003), "–")
        unreached = report["arms"][1] | {"seconds_to": [reached(0.003, 0.0) | {"seconds": None}]}
        self.assertEqual(accuracy_pages.cell(report, unreached, 0.003), "not reached in 8 s")

    def test_the_soonest_setting_has_the_time_of_its_rounds_beside_its_rivals(self):
        anew = {"relative_error": 0.05, "recommended": "generator sobol", "forecast": False, "seconds": 3.0}
        for confirmation, seconds in (({}, "2 s"), (anew, "3 s"), (anew | {"forecast": True}, "2 s")):
            report = self.report([confirmation] if confirmation else [])
            self.assertEqual(accuracy.time_cell(report, 0.05), f"{seconds}, `--generator sobol`")
            self.assertEqual(accuracy_pages.cell(report, report["arms"][1], 0.05), seconds)

    def test_a_floor_counts_where_it_is_above_the_baselines_and_not_of_what_keeps_the_estimate(self):
        def floors(floor, base_floor, keeps):
            tried = arm("bounces", "1", [(1, 0.5)], floor=floor) | {"keeps_estimate": keeps, "time_ratio": {"value": 1.0}}
            report = result(tried)
            report["arms"][0] |= {"bias_floor_high": base_floor, "bias_floor_significant": base_floor > 0.01}
            return accuracy.knob_rows({"box": report})[2].split("|")[5].strip()
        self.assertEqual(floors(0.1, 0.05, False), "1: 10 % (box)")  # 9 % is the low end
        self.assertEqual(floors(0.1, 0.005, False), "1: 10 % (box)")
        self.assertEqual(floors(0.1, 0.095, False), "none found")
        self.assertEqual(floors(0.1, 0.05, True), "none found")

    def test_durations_are_rounded_before_their_unit_is_chosen(self):
        self.assertEqual([accuracy.duration(s) for s in (0.0994, 0.0996, 0.9996)], ["99 ms", "100 ms", "1 s"])
        self.assertEqual([frontier.duration(s) for s in (0.9994e-3, 0.9996e-3, 0.9996)], ["999 µs", "1 ms", "1 s"])


class Sentences(unittest.TestCase):
    def machines(self, sobol=0.5, path=3.0, floor=0.1):
        arms = [arm("generator", "sobol", [], sobol), arm("integrator", "path", [], path), arm("bounces", "4", [], 0.9, floor)]
        return {"cpu": {name: result(*arms) for name in ("a", "b")}, "gpu": {"a": result(*arms)}}

    def test_they_name_each_machine_with_its_figure(self):
        told = accuracy_claims.sentences(self.machines())
        self.assertEqual(len(told), 3)
        self.assertIn("2.0 (cpu) and 2.0 (gpu)", told[0])
        self.assertIn("2 of 2 (cpu) and 1 of 1 (gpu)", told[1])

    def test_scenes_whose_own_settings_sample_no_lights_count_too(self):
        results = self.machines()
        results["cpu"] |= {"c": result(arm("integrator", "next-event", [], 0.3)), "d": result(arm("integrator", "next-event", [], 2.0))}
        self.assertIn("3 of 4 (cpu) and 1 of 1 (gpu)", accuracy_claims.light_sampling(results))

    def test_scenes_without_noise_tell_nothing_of_sobol_points(self):
        results = self.machines()
        results["cpu"] |= {name: result(arm("generator", "sobol", [], 1.0) | {"efficiency": None}) for name in "cdef"}
        self.assertIn("2.0 (cpu)", accuracy_claims.sobol(results))

    def test_each_is_refused_where_one_machine_contradicts_it(self):
        for claim, wrong in zip(accuracy_claims.CLAIMS, ({"sobol": 1.5}, {"path": 0.5}, {"floor": 0.0})):
            results = self.machines()
            claim(results)
            results["gpu"] = self.machines(**wrong)["gpu"]
            with self.assertRaises(accuracy_claims.DoesNotHold):
                claim(results)


class EqualError(unittest.TestCase):
    def record(self, factor):
        """Errors that fall as the root of time, Tandem's factor times sooner, with noise of 3 %."""
        noise = random.Random(1)
        points = [{"who": who, "level": level, "seed": seed, "seconds": seconds * speed * math.exp(noise.gauss(0, 0.03)),
                   "relative_error": 0.1 / math.sqrt(seconds)}
                  for who, speed in (("cycles", factor), ("tandem", 1.0)) for seed in range(1, 6) for level, seconds in enumerate((1, 4, 16, 64))]
        return {"seeds": 5, "scenes": {"box": {"targets": [0.05, 0.02, 0.01], "points": points}}}

    def test_times_are_read_between_points_and_never_beyond(self):
        curve = [(1, 0.1), (4, 0.05), (16, 0.025)]
        self.assertAlmostEqual(equal_error_page.seconds_to(curve, 0.05), 4)
        self.assertAlmostEqual(equal_error_page.seconds_to(curve, 0.1 / math.sqrt(2)), 2)
        self.assertIsNone(equal_error_page.seconds_to(curve, 0.2))
        self.assertIsNone(equal_error_page.seconds_to(curve, 0.02))

    def test_the_interval_holds_the_factor_and_what_neither_reaches_is_a_dash(self):
        found = {error: (cycles, tandem, ratio) for _, error, cycles, tandem, ratio, _ in equal_error_page.comparisons(self.record(3.0))}
        for error, seconds in ((0.05, 4), (0.02, 25)):
            cycles, tandem, ratio = found[error]
            self.assertTrue(ratio[1] < 3.0 < ratio[2] and ratio[2] < 3.5, ratio)
            self.assertAlmostEqual(tandem[0], seconds, delta=0.1 * seconds)
        cycles, tandem, ratio = found[0.01]  # errors end at 1.25 %, after 192 and 64 s
        self.assertIsNone(ratio)
        self.assertEqual(equal_error_page.shown(ratio), "–")
        self.assertTrue(cycles[1] < 192 < cycles[2] and tandem[1] < 64 < tandem[2], (cycles, tandem))

    def test_the_longest_render_that_is_not_good_enough_is_a_bound(self):
        record = self.record(3.0)
        for point in record["scenes"]["box"]["points"]:
            if point["who"] == "cycles" and point["seed"] == 2 and point["level"] == 3:
                point["relative_error"] = 0.021  # one seed suffices
        found = {error: (cycles, ratio, signs) for _, error, cycles, _, ratio, signs in equal_error_page.comparisons(record)}
        cycles, ratio, signs = found[0.02]
        self.assertEqual(signs, ["≥ ", "", "≥ "])
        self.assertTrue(1.5 < ratio[1] < 3.0, ratio)  # the bound of one seed is 7.7 times Tandem's time
        self.assertEqual(equal_error_page.shown(ratio, signs[2]), f"≥ {ratio[1]:.3g}")
        self.assertEqual(found[0.05][2], ["", "", ""])

    def test_what_every_render_of_cycles_takes_besides_is_left_out(self):
        record = self.record(1.0)
        box = record["scenes"]["box"]
        without = next(equal_error_page.comparisons(record))
        for point in box["points"]:
            if point["who"] == "cycles":
                point["seconds"] += 0.5
        box["points"] += [{"who": "pilot 4", "level": n, "seed": 0, "seconds": 0.5 + n / 100, "relative_error": 1.0} for n in (4, 16)]
        self.assertAlmostEqual(equal_error_page.fixed_seconds(box), 0.5)
        self.assertAlmostEqual(next(equal_error_page.comparisons(record))[4][0], without[4][0])

    def test_a_seed_that_lacks_leaves_the_cell_empty(self):
        record = self.record(1.0)
        record["scenes"]["box"]["points"] = [p for p in record["scenes"]["box"]["points"] if (p["who"], p["seed"]) != ("cycles", 5)]
        _, _, cycles, tandem, ratio, _ = next(equal_error_page.comparisons(record))
        self.assertIsNone(cycles)
        self.assertIsNotNone(tandem)
        self.assertIsNone(ratio)

    def test_the_shortest_render_that_is_better_already_is_a_bound(self):
        record = self.record(3.0)
        record["scenes"]["box"]["targets"] = [0.2]  # errors begin at 10 %
        *_, ratio, signs = next(equal_error_page.comparisons(record))
        self.assertEqual((ratio, signs[:2]), (None, ["≤ ", "≤ "]))
        first = [p for p in record["scenes"]["box"]["points"] if p["who"] == "cycles" and p["level"] == 0]
        for point in first:
            point["relative_error"] = 0.3
        _, _, _, tandem, ratio, signs = next(equal_error_page.comparisons(record))
        self.assertEqual(signs, ["", "≤ ", "≥ "])
        self.assertAlmostEqual(tandem[0], 1.0, delta=0.1)
        self.assertGreater(ratio[1], 3.0)  # Cycles reaches it later than its first render, which took three times as long


if __name__ == "__main__":
    unittest.main()
