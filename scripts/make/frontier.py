"""Error against time of what `tandem cost --json` measured: the frontier, and a log-log plot of it as SVG. Nothing between
measured points is drawn but the line that joins them, and nothing beyond. Imported by scripts/report."""
import html
import math

# Okabe and Ito's colours, told apart by colour-blind readers; the numbers beside the lines tell the same without colour.
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#7a5c00", "#56b4e9", "#000000"]
STEPS = 240        # times at which the frontier is sought
BETTER = 0.9       # a setting takes the frontier over where its error is below this share of the former's
FLAT = 1.001       # of the least error so far: a line that has levelled off stays on the frontier
KNOWN = 0.5        # a point whose interval reaches below this share of its error is not drawn: it is not known
WIDTH, HEIGHT = 360, 270
LEFT, RIGHT, TOP, BOTTOM = 50, 12, 20, 34


def name_of(arm):
    return (arm["knob"] + " " + arm["setting"]).strip()


def known_points(arm):
    """(seconds, relative error) of what was measured well enough to draw, by time."""
    return sorted((point["seconds"], point["rmse"]) for point in arm["points"]
                  if point["rmse"] > 0 and point["seconds"] > 0 and point["rmse_low"] > KNOWN * point["rmse"])


def error_at(points, seconds):
    """The error on the line between the two measured points around that time; None outside of them."""
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if t0 <= seconds <= t1 and t0 < t1:
            share = math.log(seconds / t0) / math.log(t1 / t0)
            return math.exp((1 - share) * math.log(e0) + share * math.log(e1))
    return None


def frontier(report):
    """[(name, arm, [(seconds, error), ...])]: who has the smallest error at each time, by time. Each stretch lies on lines
    between measured points. A name may come twice."""
    arms = [(arm, known_points(arm)) for arm in report["arms"]]
    times = [t for _, points in arms for t, _ in points]
    if len(times) < 2:
        return []
    first, last = math.log(min(times)), math.log(max(times))
    stretches, best, holder = [], math.inf, None
    for step in range(STEPS + 1):
        seconds = math.exp(first + (last - first) * step / STEPS)
        errors = [(error, index) for index, (_, points) in enumerate(arms)
                  if (error := error_at(points, seconds)) is not None]
        if not errors:
            continue
        error, index = min(errors)
        kept = dict((i, e) for e, i in errors).get(holder)
        if kept is not None and error > BETTER * kept:
            error, index = kept, holder
        if error > FLAT * best:
            continue
        best = min(best, error)
        if index != holder or not stretches:
            stretches.append((index, []))
            holder = index
        stretches[-1][1].append((seconds, error))
    return [(name_of(arms[index][0]), arms[index][0], points) for index, points in stretches if len(points) > 1]


def is_unbiased(arm):
    """By design: no shipped scene has so many bounces by itself (common/cost/knobs.h, unlimited_bounces)."""
    return arm["keeps_estimate"] and "--bounces 256" in arm["options"]


def keeps_answer(arm):
    """Whether nothing speaks for a bias beyond that of the scene's own number of bounces, by design or as no floor is significant."""
    return arm["keeps_estimate"] or not arm["bias_floor_significant"]


def measured(arm, error):
    """The time to an error, if it was measured."""
    return next((time for time in arm["seconds_to"]
                 if time["relative_error"] == error and time["seconds"] is not None and not time["extrapolated"]), None)


def has_time_ratio(arm):
    """Whether it was rendered beside the baseline, so that their times are compared."""
    return arm["time_ratio"] is not None and arm["time_ratio"]["high"] is not None


def percent(value):
    value *= 100
    return f"{value:.0f}\u00a0%" if value >= 10 else f"{value:.2g}\u00a0%"


def duration(seconds):
    for limit, scale, unit in ((0.9995e-3, 1e6, "µs"), (0.9995, 1e3, "ms"), (600, 1, "s"), (7200, 1 / 60, "min")):
        if seconds < limit:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds / 3600:.3g} h"


def longest(arms):
    """Seconds of the longest render of these settings."""
    return max((point["seconds"] for arm in arms for point in arm["points"]), default=0.0)


def measured_anew(report, error):
    """What the recommended setting took to the error beside its rivals, where it was rendered to it for that; or None. The oldest results
    tell no such thing."""
    return next((c for c in report.get("confirmations", []) if abs(c["relative_error"] - error) < 1e-9 and not c["forecast"]), None)


def limits(reports):
    """Common to several plots: least and greatest time and error, in powers of ten and in thirds of them."""
    points = [point for report in reports for arm in report["arms"] for point in known_points(arm)]
    if not points:
        return None
    times, errors = zip(*points)
    thirds = lambda value, round_: round_(3 * math.log10(value) - 1e-9 * (round_ is math.floor)) / 3
    return thirds(min(times), math.floor), thirds(max(times), math.ceil), thirds(min(errors), math.floor), \
        thirds(max(errors), math.ceil)


class Axes:
    def __init__(self, bounds):
        self.bounds = bounds

    def x(self, seconds):
        low, high = self.bounds[:2]
        return LEFT + (WIDTH - LEFT - RIGHT) * (math.log10(seconds) - low) / (high - low)

    def y(self, error):
        low, high = self.bounds[2:]
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (math.log10(error) - low) / (high - low)

    def path(self, points):
        return "M" + "L".join(f"{self.x(t):.0f} {self.y(e):.0f}" for t, e in points)

    def grid(self):
        parts = []
        low, high, least, greatest = self.bounds
        decades = range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
        for power in decades:
            x = self.x(10.0**power)
            anchor = "end" if x > WIDTH - RIGHT - 16 else "middle"
            parts.append(f'<path class="grid" d="M{x:.0f} {TOP}V{HEIGHT - BOTTOM}"/>'
                         f'<text x="{x:.0f}" y="{HEIGHT - BOTTOM + 14}" text-anchor="{anchor}">{duration(10.0**power)}</text>')
        for value in (v * 10.0**p for p in range(-5, 3) for v in (1, 2, 5)):
            if least - 1e-9 <= math.log10(value) <= greatest + 1e-9 and (f"{value:.0e}"[0] == "1" or greatest - least < 1.7):
                y = self.y(value)
                parts.append(f'<path class="grid" d="M{LEFT} {y:.0f}H{WIDTH - RIGHT}"/>'
                             f'<text x="{LEFT - 4}" y="{y + 4:.0f}" text-anchor="end">{percent(value)}</text>')
        return "".join(parts)


def number_of_settings(stretches):
    """{name: number}, in the order of the frontier."""
    return {name: number for number, name in enumerate(dict.fromkeys(name for name, _, _ in stretches), 1)}


def plot(report, bounds, title):
    """The plot as SVG. Every setting is a thin line with a dot at each measured point; the frontier is bold and numbered."""
    axes, stretches = Axes(bounds), frontier(report)
    lines = [points for arm in report["arms"] if (points := known_points(arm))]
    numbers = number_of_settings(stretches)
    parts = [f'<svg class="frontier" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(title, quote=True)}">',
             axes.grid(), f'<path class="setting" d="{"".join(axes.path(points) for points in lines if len(points) > 1)}"/>']
    # A dot is a stroke of no length with round ends: a path for all of them is a third of as many circles.
    dots = "".join(f"M{axes.x(t):.0f} {axes.y(e):.0f}h0" for points in lines for t, e in points)
    parts.append(f'<path class="dots" d="{dots}"/>')
    for name, _, points in stretches:
        colour = COLOURS[(numbers[name] - 1) % len(COLOURS)]
        thinned = points[::8] + ([points[-1]] if (len(points) - 1) % 8 else [])
        parts.append(f'<path class="best" stroke="{colour}" d="{axes.path(thinned)}"><title>{html.escape(name)}</title></path>')
    taken = []
    for name, _, points in stretches:
        t, e = points[len(points) // 2]
        x, y = axes.x(t) - 8, axes.y(e) + 14
        while any(abs(x - a) < 11 and abs(y - b) < 12 for a, b in taken) and y < HEIGHT - BOTTOM - 6:
            y += 12
        taken.append((x, y))
        x, y = max(x, LEFT + 5), min(y, HEIGHT - BOTTOM - 3)
        parts.append(f'<text class="number" x="{x:.0f}" y="{y:.0f}" fill="{COLOURS[(numbers[name] - 1) % len(COLOURS)]}" '
                     f'text-anchor="middle">{numbers[name]}</text>')
    parts.append(f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 3}" text-anchor="end">time</text>'
                 f'<text x="{LEFT}" y="11">error</text></svg>')
    return "".join(parts)


STYLE = """.frontier { font: 11px sans-serif; }
.frontier text { fill: #222; }
.frontier .grid { stroke: #e4e4e4; fill: none; }
.frontier .setting { stroke: #b4b4b4; stroke-width: .7; fill: none; }
.frontier .dots { stroke: #8c8c8c; stroke-width: 2.4; stroke-linecap: round; fill: none; }
.frontier .best { stroke-width: 3; fill: none; stroke-linejoin: round; }
.frontier .number { font-weight: bold; font-size: 12px; fill: revert-layer; paint-order: stroke; stroke: #fff; stroke-width: 3px; }
"""
