"""The page of one `tandem bench --json`: verdicts, claims, a forest plot and a table for each amount of work. Imported by
scripts/report."""
import math
import pathlib

import jinja2
from bench_results import MARGIN, arms_of, base_time, device_of, names_of, percent, plot, svg_text, ticks_of, timed, verdict

COLOURS = {"faster": "#1b7837", "slower": "#b2182b", "same": "#2166ac", "ambiguous": "#777777"}


def is_bench(report):
    return {"arms", "raw", "families", "floor"} <= report.keys()


def forest(arms):
    """An arm a row: its ratio to the baseline, on a logarithmic axis, with its 95 % interval. Narrow enough for a telephone."""
    shown = [arm for arm in arms if timed(arm)]
    if not shown:
        return None
    width, left, row, top = 360, 10, 30, 8
    low = min(0.98, *(arm["ratio_low"] for arm in shown))
    high = max(1.02, *(arm["ratio_high"] for arm in shown))
    bottom = top + row * len(shown)

    def x_of(ratio):
        return left + (width - 2 * left) * math.log(ratio / low) / math.log(high / low)

    out = [f'<svg class="forest" viewBox="0 0 {width} {bottom + 34}" role="img" '
           f'aria-label="ratios of times to the first arm, with 95 % intervals">']
    labelled = []
    for tick in sorted(ticks_of(low, high), key=lambda tick: tick != 1):  # 1 has its label before all others
        if any(abs(x_of(tick) - x) < 28 for x in labelled):
            continue
        labelled.append(x_of(tick))
        out.append(f'<line x1="{x_of(tick):.1f}" x2="{x_of(tick):.1f}" y1="{top}" y2="{bottom}" '
                   f'stroke="{"#000" if tick == 1 else "#ddd"}"/>')
        out.append(svg_text(min(max(x_of(tick), left + 4), width - left - 8), bottom + 13, f"{tick:g}"))
    out.append(svg_text(width / 2, bottom + 28, "times the baseline's time, below 1 is faster"))
    for number, arm in enumerate(shown):
        y, colour = top + row * number + 22, COLOURS[verdict(arm)]
        out.append(f'<rect x="{left}" y="{y - 20}" width="{6.2 * len(arm["arm"]):.0f}" height="12" fill="#fff" fill-opacity="0.8"/>')
        out.append(svg_text(left, y - 10, arm["arm"], "start"))
        out.append(f'<line x1="{x_of(arm["ratio_low"]):.1f}" x2="{x_of(arm["ratio_high"]):.1f}" y1="{y}" y2="{y}" '
                   f'stroke="{colour}" stroke-width="2"/>')
        out.append(f'<circle cx="{x_of(arm["ratio"]):.1f}" cy="{y}" r="3.5" fill="{colour}"/>')
    return "\n".join(out) + "\n</svg>"


def change(arm):
    return f"{percent(arm['ratio'] - 1)} ({percent(arm['ratio_low'] - 1)} to {percent(arm['ratio_high'] - 1)})"


def row(report, arm):
    time = base_time(report, arm)
    compared = timed(arm)
    result = arm["identity"].replace("-", " ")
    return {"name": arm["arm"], "text": arm["text"], "time": f"{time[0]:.4g}" if time else "—",
            "range": f"{time[1]:.4g} to {time[2]:.4g}" if time else "—",
            "ratio": f"{arm['ratio']:.3f}" if compared else "baseline" if arm["arm"] == arm["baseline"] else "—",
            "interval": f"{arm['ratio_low']:.3f} to {arm['ratio_high']:.3f}" if compared else "—",
            "verdict": verdict(arm) if compared else "—",
            "identity": f"{result}: {arm['reason']}" if arm.get("reason") else result, "blocks": arm["samples"]}


def workloads_of(report, arms):
    names = dict.fromkeys(arm["workload"]["name"] for arm in arms)
    of = {name: [arm for arm in arms if arm["workload"]["name"] == name] for name in names}
    return [{"name": name, "forest": forest(own), "arms": [row(report, arm) for arm in own]} for name, own in of.items()]


def family_of(report, family):
    arms = arms_of(report, family["name"])
    picture = plot(arms, family["along"], family["name"]) if any(map(timed, arms)) else None
    return {**family, "base": family.get("base"), "plot": picture, "workloads": workloads_of(report, arms),
            "crossovers": [f"{one['arm']}: {one['text']}" for one in report["crossovers"] if one["family"] == family["name"]]}


def verdicts_of(report, families):
    """A line an arm, at the most work at which it was timed; of a user's own arms at each amount of work."""
    each = "arm_library_hash" in report["device"]
    lines = []
    for family in families:
        arms = arms_of(report, family["name"])
        for name in names_of(arms):
            own = [arm for arm in arms if arm["arm"] == name and timed(arm)]
            for last in own if each else own[-1:]:
                lines.append({"arm": name, "family": family["name"] if len(families) > 1 else "", "verdict": verdict(last),
                              "text": f"{'as' if verdict(last) == 'same' else 'than' if verdict(last) != 'ambiguous' else 'beside'} "
                                      f"{last['baseline']} at {last['workload']['name']}: {change(last)}"})
    return lines


def render(report):
    families = [family for family in report["families"] if arms_of(report, family["name"])]
    own = "arm_library_hash" in report["device"]
    title = f"{families[0]['name']}: {families[0]['question']}" if own and families else \
        f"Ways to use Vulkan on {report['device']['name']}"
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), autoescape=True,
                                     trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters.update(percent=percent)
    return environment.get_template("bench_template.html").render(
        report=report, title=title, device=device_of(report), margin=MARGIN, verdicts=verdicts_of(report, families),
        claims=[claim for claim in report["claims"] if claim["verdict"] != "not-applicable"],
        families=[family_of(report, family) for family in families])
