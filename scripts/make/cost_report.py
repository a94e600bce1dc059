"""The page of `tandem cost --json`: log-log plots of error against time, the table and the recommendations. Imported by
scripts/report."""
import io
import pathlib

import jinja2
import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402  (after the backend is chosen)

GREY = "#999999"
COLOURS = ["#2166ac", "#b2182b", "#1b7837", "#b35806", "#762a83", "#01665e", "#c51b7d", "#8c510a"]


def name_of(arm):
    return (arm["knob"] + " " + arm["setting"]).strip()


def percent(value):
    value *= 100
    return f"{value:.0f} %" if value >= 10 else f"{value:.2g} %"


def duration(seconds):
    if seconds is None:
        return "never"
    for limit, scale, unit in ((1, 1e3, "ms"), (600, 1, "s"), (7200, 1 / 60, "min")):
        if seconds < limit:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds / 3600:.3g} h"


def time_cell(time):
    if time["seconds"] is None:
        return "unknown" if time.get("unknown") else "never"  # older results know no "unknown"
    return ("~" if time["extrapolated"] else "") + duration(time["seconds"]) + ("?" if time["floor_unknown"] else "")


def draw(axes, arm, colour, label, width=1.4):
    """Measured errors with intervals, what is foretold beyond them dashed, and the floor dotted."""
    points = [point for point in arm["points"] if point["rmse"] > 0 and point["seconds"] > 0]
    if not points:
        return
    x = [point["seconds"] for point in points]
    y = [100 * point["rmse"] for point in points]
    below = [100 * (point["rmse"] - max(point["rmse_low"], 0)) for point in points]
    above = [max(0.0, 100 * (point["rmse_high"] - point["rmse"])) for point in points]
    below = [min(max(0.0, low), 0.95 * value) for low, value in zip(below, y)]
    axes.errorbar(x, y, [below, above], fmt="o-", color=colour, markersize=2.5, capsize=1.5, linewidth=width, label=label)
    beyond = [(time["seconds"], 100 * time["relative_error"]) for time in arm["seconds_to"]
              if time["extrapolated"] and time["seconds"] and time["seconds"] > x[-1]]
    if beyond:
        axes.plot([x[-1]] + [p[0] for p in beyond], [y[-1]] + [p[1] for p in beyond], "--", color=colour, linewidth=0.8)
    if arm["bias_floor_significant"] and arm["bias_floor"] > 0:
        axes.axhline(100 * arm["bias_floor"], color=colour, linestyle=":", linewidth=0.9)


def finish(axes, title):
    axes.set(xscale="log", yscale="log", xlabel="seconds", ylabel="RMSE, % of the mean")
    axes.set_title(title, fontsize=9)
    axes.grid(True, which="major", linewidth=0.3)
    axes.legend(fontsize=6.5)


def svg_of(figure):
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    pyplot.close(figure)
    svg = text.getvalue()
    return svg[svg.index("<svg"):]


def front_plot(report):
    figure, axes = pyplot.subplots(figsize=(7.5, 4.2), layout="constrained")
    arms = report["arms"]
    for arm in arms[1:]:
        if not arm["pareto"]:
            draw(axes, arm, GREY, None, 0.5)
    draw(axes, arms[0], "black", "baseline" + (" (Pareto front)" if arms[0]["pareto"] else ""), 2)
    front = [arm for arm in arms[1:] if arm["pareto"]]
    for colour, arm in zip(COLOURS * 4, front):
        draw(axes, arm, colour, name_of(arm) + " (Pareto front)")
    finish(axes, "All settings; the Pareto front in colour, the others grey")
    return svg_of(figure)


def knob_plots(report):
    """One plot a knob: its settings beside the baseline."""
    plots = []
    for knob in dict.fromkeys(arm["knob"] for arm in report["arms"][1:]):
        figure, axes = pyplot.subplots(figsize=(4.6, 3.2), layout="constrained")
        draw(axes, report["arms"][0], "black", "baseline")
        for colour, arm in zip(COLOURS * 4, [arm for arm in report["arms"] if arm["knob"] == knob]):
            draw(axes, arm, colour, arm["setting"])
        finish(axes, knob)
        plots.append(svg_of(figure))
    return plots


def render(report):
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), autoescape=True,
                                     trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters.update(percent=percent, name_of=name_of, time_cell=time_cell)
    return environment.get_template("cost_template.html").render(
        report=report, front=front_plot(report), knobs=knob_plots(report))
