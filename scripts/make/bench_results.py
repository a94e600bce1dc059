"""What `tandem bench --json` wrote: its arms and their times, and plots of them. Imported by scripts/report and
scripts/measure/guidelines."""
import math
import statistics

COLOURS = ["#2166ac", "#b2182b", "#1b7837", "#762a83", "#b35806", "#01665e", "#808000", "#4d4d4d", "#c51b7d", "#e6550d",
           "#00a1d5", "#79af97", "#8c6d31"]


MARGIN = 0.02  # relative: what common/experiment/analysis.h calls negligible


def percent(value):
    return "—" if value is None else f"{100 * value:+.1f} %"


def sentence(text):
    """Clauses become sentences."""
    return ". ".join(part[:1].upper() + part[1:] for part in text.split("; "))


def device_of(result):
    return f"{result['device']['name']}, {result['device']['driver_name']} {result['device']['driver_version']}"


def arms_of(result, family):
    return [arm for arm in result["arms"] if arm["family"] == family]


def names_of(arms):
    return list(dict.fromkeys(arm["arm"] for arm in arms))


def trimmed_mean(values):
    """20 % of either side left out, as common/statistics/paired_effect.h does."""
    values = sorted(values)
    cut = int(0.2 * len(values))
    return statistics.fmean(values[cut:len(values) - cut])


def replicate_times(result, arm):
    """Milliseconds a run by the arm's clock: a trimmed mean for each replicate, from the raw readings."""
    times = []
    for raw in result["raw"]:
        if raw["family"] == arm["family"] and raw["workload"]["name"] == arm["workload"]["name"]:
            times += [trimmed_mean(one["milliseconds"][arm["clock"]]) for one in raw["arms"]
                      if one["arm"] == arm["arm"] and one["milliseconds"].get(arm["clock"])]
    return times


def stored(result):
    """The result with those raw readings alone that a page is computed from. One that lacks some says so in `left_out`, and
    bench neither resumes it nor compares with it."""
    pooled = {(arm["family"], arm["workload"]["name"], arm["arm"]): arm["clock"] for arm in result["arms"]
              if not arm.get("replicate_milliseconds")}
    raw = []
    for entry in result["raw"]:
        arms = []
        for arm in entry["arms"]:
            clock = pooled.get((entry["family"], entry["workload"]["name"], arm["arm"]))
            if arm["milliseconds"].get(clock):
                arms.append({"arm": arm["arm"], "milliseconds": {clock: arm["milliseconds"][clock]}})
        if arms:
            raw.append({"family": entry["family"], "workload": entry["workload"], "arms": arms})
    if raw == result["raw"]:
        return result
    kept = {key: value for key, value in result.items() if key != "raw_checksum"}
    return kept | {"raw": raw, "left_out": "raw readings that no page is computed from"}


def base_time(result, arm):
    """Milliseconds a run, and the lowest and highest replicate's. It is the median over replicates, so that one in
    which the device was slow as a whole moves it little."""
    if arm.get("replicate_milliseconds"):
        times = arm["replicate_milliseconds"]
        return arm["milliseconds"][arm["clock"]], min(times), max(times)
    times = replicate_times(result, arm)  # results from before that pooled the blocks of all replicates
    return (statistics.median(times), min(times), max(times)) if times else None


def timed(arm):
    return "p_family" in arm


def verdict(arm):
    """faster, slower, same or ambiguous, as common/experiment/analysis.cpp says; older results have no verdict."""
    if "verdict" in arm:
        return arm["verdict"]
    if arm["ratio_low"] >= 1 - MARGIN and arm["ratio_high"] <= 1 + MARGIN:
        return "same"
    if arm["p_family"] > 0.05 or arm["ratio_low"] <= 1 <= arm["ratio_high"]:
        return "ambiguous"
    return "faster" if arm["ratio_high"] < 1 else "slower"


def svg_text(x, y, text, anchor="middle", colour="#000"):
    text = text.replace("&", "&amp;").replace("<", "&lt;")
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{text}</text>'


def ticks_of(low, high):
    """Ratios worth a line, between two of them."""
    steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.8, 0.9, 0.95, 0.98, 1, 1.02, 1.05, 1.1, 1.25, 1.5, 2, 3, 5, 10, 20, 50, 100]
    return [step for step in steps if low <= step <= high] or [1]


def plot(arms, along, title):
    """Ratio to the baseline over the size of the work, both logarithmic, with 95 % intervals. The SVG is written by
    hand so that it is the same on every machine."""
    width, height, left, right, top, bottom = 640, 300, 60, 170, 30, 45
    shown = [arm for arm in arms if timed(arm) and along in arm["workload"]["factors"]]
    sizes = sorted({arm["workload"]["factors"][along] for arm in shown})
    if len(sizes) < 2:
        return None
    low = max(0.01, min(0.98, *(arm["ratio_low"] for arm in shown)))
    high = min(100, max(1.02, *(arm["ratio_high"] for arm in shown)))
    span = math.log(sizes[-1] / sizes[0])

    def x_of(size, shift):
        return left + 20 + (width - left - right - 40) * math.log(size / sizes[0]) / span + shift

    def y_of(ratio):
        ratio = min(max(ratio, low), high)
        return height - bottom - (height - top - bottom) * math.log(ratio / low) / math.log(high / low)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
           f'font-size="11"><rect width="{width}" height="{height}" fill="#fff"/>', svg_text(left, 18, title, "start")]
    labelled = []
    for tick in sorted(ticks_of(low, high), key=lambda tick: tick != 1):  # 1 has its label before all others
        if any(abs(y_of(tick) - y) < 12 for y in labelled):
            continue
        labelled.append(y_of(tick))
        colour = "#000" if tick == 1 else "#ddd"
        out.append(f'<line x1="{left}" x2="{width - right}" y1="{y_of(tick):.1f}" y2="{y_of(tick):.1f}" stroke="{colour}"/>')
        out.append(svg_text(left - 5, y_of(tick) + 4, f"{tick:g}", "end"))
    for size in sizes:
        out.append(svg_text(x_of(size, 0), height - bottom + 16, f"{size:,.0f}"))
    out.append(svg_text((left + width - right) / 2, height - 8, f"{along}; times the baseline's time, below 1 is faster"))
    for number, name in enumerate(names_of(shown)):
        colour = COLOURS[number % len(COLOURS)]
        shift = 3 * (number - len(names_of(shown)) / 2)
        points = sorted((arm["workload"]["factors"][along], arm["ratio"], arm["ratio_low"], arm["ratio_high"],
                         arm["workload"]["factors"].get("pixels") if along != "pixels" else None)
                        for arm in shown if arm["arm"] == name)
        for pixels in dict.fromkeys(point[4] for point in points):  # a line for each image size
            line = " ".join(f"{x_of(p[0], shift):.1f},{y_of(p[1]):.1f}" for p in points if p[4] == pixels)
            out.append(f'<polyline points="{line}" fill="none" stroke="{colour}"/>')
        for size, ratio, below, above, _ in points:
            x = x_of(size, shift)
            out.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y_of(below):.1f}" y2="{y_of(above):.1f}" stroke="{colour}"/>')
            out.append(f'<circle cx="{x:.1f}" cy="{y_of(ratio):.1f}" r="2.5" fill="{colour}"/>')
        out.append(svg_text(width - right + 10, top + 12 + 15 * number, name, "start", colour))
    return "\n".join(out) + "\n</svg>\n"


def waterfall(arms, title):
    """The time of each arm beside the first one's, with 95 % intervals, at the greatest amount of work. Each arm has
    one change more than the one above it."""
    last = max((arm["workload"]["factors"]["samples"] for arm in arms if timed(arm)), default=None)
    shown = [arm for arm in arms if arm["workload"]["factors"]["samples"] == last
             and (timed(arm) or arm["arm"] == arm["baseline"])]
    if len(shown) < 2:
        return None
    ratios = [(1, 1, 1) if arm["arm"] == arm["baseline"] else (arm["ratio"], arm["ratio_low"], arm["ratio_high"])
              for arm in shown]
    width, left, right, row, top = 640, 130, 190, 24, 34
    height = top + row * len(shown) + 12
    scale = (width - left - right) / max(high for _, _, high in ratios)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
           f'font-size="11"><rect width="{width}" height="{height}" fill="#fff"/>',
           svg_text(10, 18, f"{title}, {shown[0]['workload']['name']}", "start")]
    for number, (arm, (ratio, low, high)) in enumerate(zip(shown, ratios)):
        y, before = top + row * number, ratios[max(number - 1, 0)][0]
        colour = COLOURS[0] if ratio <= before else COLOURS[1]
        out.append(svg_text(left - 8, y + 14, arm["arm"], "end"))
        out.append(f'<rect x="{left}" y="{y}" width="{scale * ratio:.1f}" height="18" fill="{colour}" fill-opacity="0.35"/>')
        start, end = sorted((scale * before, scale * ratio))  # what the change is worth
        out.append(f'<rect x="{left + start:.1f}" y="{y}" width="{end - start:.1f}" height="18" fill="{colour}"/>')
        out.append(f'<line x1="{left + scale * low:.1f}" x2="{left + scale * high:.1f}" y1="{y + 9}" y2="{y + 9}" stroke="#000"/>')
        change = "" if number == 0 else f", step {percent(ratio / before - 1)}"
        out.append(svg_text(left + scale * max(high, before) + 8, y + 14,
                            f"{arm['milliseconds'][arm['clock']]:.4g} ms{change}", "start"))
    return "\n".join(out) + "\n</svg>\n"
