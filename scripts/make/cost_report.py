"""The page of one `tandem cost --json`: log-log plots of error against time, the table and the recommendations. Imported by
scripts/report."""
import io
import pathlib

import frontier
import jinja2
import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402  (after the backend is chosen)

COLOURS = ["#2166ac", "#b2182b", "#1b7837", "#b35806", "#762a83", "#01665e", "#c51b7d", "#8c510a"]


def time_cell(time):
    if time["seconds"] is None:
        return "unknown" if time.get("unknown") else "never"  # older results know no "unknown"
    return ("~" if time["extrapolated"] else "") + frontier.duration(time["seconds"]) + ("?" if time["floor_unknown"] else "")


def noise_cell(arm):
    """Without the bias."""
    return frontier.percent(arm["noise"]) if "noise" in arm else "—"  # older results know none


def number_cell(arm, key):
    value = arm.get(key)
    return "—" if value is None else f"{value:.3g}"


def time_ratio_cell(arm):
    """Older results give a ratio of 1 without an upper end to what was not rendered beside the baseline."""
    ratio = arm["time_ratio"]
    return "unknown" if ratio is None or ratio["high"] is None else f"{ratio['value']:.2f}×"


def region_cell(arm, name):
    region = arm.get("regions", {}).get(name)
    return "—" if region is None else frontier.percent(region["rmse"])


def tile_cell(arm):
    tile = arm.get("most_biased_tile")  # older results know none
    if tile is None:
        return "<td>—</td>"
    bias = tile["relative_bias"]
    chance = "" if tile["significant"] else ' class="chance"'
    return (f'<td{chance}>({tile["x"]}, {tile["y"]}): {100 * bias["value"]:+.2g}\u00a0% '
            f'({100 * bias["low"]:+.2g} to {100 * bias["high"]:+.2g})</td>')


def draw(axes, arm, colour, label, width=1.4):
    """Measured errors with intervals, and the floor dotted."""
    points = [point for point in arm["points"] if point["rmse"] > 0 and point["seconds"] > 0]
    if not points:
        return
    x = [point["seconds"] for point in points]
    y = [100 * point["rmse"] for point in points]
    below = [100 * (point["rmse"] - max(point["rmse_low"], 0)) for point in points]
    above = [max(0.0, 100 * (point["rmse_high"] - point["rmse"])) for point in points]
    below = [min(max(0.0, low), 0.95 * value) for low, value in zip(below, y)]
    axes.errorbar(x, y, [below, above], fmt="o-", color=colour, markersize=2.5, capsize=1.5, linewidth=width, label=label)
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
    environment.filters.update(percent=frontier.percent, name_of=frontier.name_of, time_cell=time_cell,
                               time_ratio_cell=time_ratio_cell,
                               noise_cell=noise_cell, number_cell=number_cell, region_cell=region_cell, tile_cell=tile_cell)
    bounds = frontier.limits([report])
    front = frontier.plot(report, bounds, "Error against time") if bounds else "No point is known well enough to draw."
    numbers = frontier.number_of_settings(frontier.frontier(report))
    return environment.get_template("cost_template.html").render(
        report=report, front=front, numbers=numbers, style=frontier.STYLE, knobs=knob_plots(report))
