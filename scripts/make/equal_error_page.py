"""Times to an equal error of two renderers, by interpolation between measured points, and the page of them. Imported by
scripts/measure/equal_error."""
import json
import math
import pathlib
import statistics

SCENES = pathlib.Path(__file__).resolve().parent.parent.parent / "scenes"

# Student's t, two-sided 95 %, by degrees of freedom.
T = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306, 9: 2.262, 10: 2.228, 15: 2.131, 20: 2.086}

TEXT = """# Cycles and Tandem at equal error

{found}

Made by `scripts/measure/equal_error`; do not edit.

- Cycles is {version}, with the best of these settings for each scene and error. It samples adaptively by a noise threshold, or an even number of
  samples. It has either sampling pattern, and roulette or none. No denoiser, no clamping.
- The settings are those that were soonest to the error on seed 0, which no row shows.{one_for_all} Where none reached it, they are
  those whose last render would have, with an error that goes on falling as the root of time.
- A lamp that is a rectangle is an area light in Cycles. Lamps of other shapes it finds by scattering alone: its own sampling of
  meshes is not exact enough at grazing angles. That goes for {found_by_scattering}.
- Tandem is `tandem render --target-error`, which chooses its settings in a trial. The trial's time is counted.
- Both rendered {size} pixels wide on the CPU, in turn, in one run a scene.
- Errors are root mean squares over pixels and channels, over the mean, against a reference by Tandem's other renderer (Vulkan). Its own
  noise is taken out. An error below twice the reference's uncertainty is not shown.
- Each time is read between two measured points of a seed, never beyond them. Shown are geometric means over {seeds} seeds, with
  Student's interval at 95 % of the logarithms. The first render above {most:g} s was the last of a seed.
- *≥*: some seed's last render did not reach the error yet, so that its time is a bound. *≤*: a shortest render was better already.
  Shown is then the end of the interval on that side. A dash: both are bounds on the same side.
- *Cycles over Tandem* pairs seeds measured next to each other; above 1 Tandem is sooner.
- Start and load of the scene are not in these times; the second table has them. Nor is what every render of Cycles takes besides: it
  takes the scene over from Blender, and writes the image. That is what a line through renders of 4 and 16 samples leaves for none.

| scene | error | Cycles, s | Tandem, s | Cycles over Tandem |
|---|---|---|---|---|
{rows}

| scene | Cycles' settings | Cycles starts, s | loads, s | each render besides, s | Tandem starts and loads, s | reference, uncertainty | measured on, at commit |
|---|---|---|---|---|---|---|---|
{starts}
"""


def seconds_to(curve, error):
    """Seconds on the line, in logarithms, between the two measured (seconds, error) around that error; None beyond them."""
    curve = sorted(curve, key=lambda point: point[0])
    for (t0, e0), (t1, e1) in zip(curve, curve[1:]):
        if e0 >= error >= e1 > 0 and e0 > e1:
            share = math.log(e0 / error) / math.log(e0 / e1)
            return math.exp((1 - share) * math.log(t0) + share * math.log(t1))
    return None


def interval(values):
    """Geometric mean with Student's interval of the logarithms; None for fewer than two."""
    if len(values) < 2:
        return None
    logs = [math.log(value) for value in values]
    freedom = len(logs) - 1
    t = T[max(known for known in T if known <= freedom)]
    half = t * statistics.stdev(logs) / math.sqrt(len(logs))
    middle = statistics.mean(logs)
    return tuple(math.exp(value) for value in (middle, middle - half, middle + half))


def fixed_seconds(row):
    """Of every render of Cycles: it takes the scene over from Blender, and writes the image. By the lines through the renders of 4 and
    of 16 samples, the median. Those of the rows shown go before those of the pilots. 0 where there are neither."""
    seconds = {(p["who"], p["seed"], p["level"]): p["seconds"] for p in row["points"] if p["who"] != "tandem"}
    lines = {(who, seed): t4 - 4 * (seconds[who, seed, 16] - t4) / 12 for (who, seed, level), t4 in seconds.items()
             if level == 4 and (who, seed, 16) in seconds}
    shown = [line for (_, seed), line in lines.items() if seed > 0] or list(lines.values())
    return max(0.0, statistics.median(shown)) if shown else 0.0


def time_of(curve, error):
    """Seconds to the error by a seed's measured points, ascending; and the sign where they are a bound: "≤ " where the shortest render
    was better already, "≥ " where the longest was not yet."""
    if not curve:
        return None, ""
    if curve[0][1] < error:
        return curve[0][0], "≤ "
    if curve[-1][1] > error:
        return curve[-1][0], "≥ "
    return seconds_to(curve, error), ""


def times(row, who, error, seeds):
    """By seed: seconds, None where a seed was not measured. And the sign of what they are together; None where some are bounds from
    above, others from below."""
    fixed, least = 0.0 if who == "tandem" else fixed_seconds(row), 1e-3
    found, signs = [], set()
    for seed in range(1, seeds + 1):
        curve = sorted((max(p["seconds"] - fixed, least), p["relative_error"])
                       for p in row["points"] if p["who"] == who and p["seed"] == seed)
        seconds, sign = time_of(curve, error)
        found.append(seconds)
        signs.add(sign)
    signs.discard("")
    return found, None if len(signs) > 1 else signs.pop() if signs else ""


def shown(value, sign=""):
    """Of bounds the end of the interval that is one."""
    if value is None:
        return "–"
    return {"": "{:.3g} ({:.3g} to {:.3g})", "≥ ": "≥ {1:.3g}", "≤ ": "≤ {2:.3g}"}[sign].format(*value)


def who_is_cycles(row, error):
    """The settings of Cycles that an error is compared with; older results have one choice for all errors."""
    return next((arm["who"] for arm in row.get("arms", []) if arm["target"] == error), "cycles")


def comparisons(record):
    """(scene, error, Cycles' times, Tandem's times, ratios), each an interval or None, and the sign of each: "≤ ", "≥ " or "". With a
    sign the interval is that of the bounds' mean, and the mean of the times is beyond it."""
    opposite = {"≤ ": "≥ ", "≥ ": "≤ ", "": ""}
    for scene, row in record["scenes"].items():
        for error in row.get("targets", []):
            (cycles, sign_c), (tandem, sign_t) = (times(row, who, error, record["seeds"])
                                                  for who in (who_is_cycles(row, error), "tandem"))
            whole = [None if None in values or sign is None else interval(values)
                     for values, sign in ((cycles, sign_c), (tandem, sign_t))]
            both = None not in whole and not (sign_c and sign_t and sign_c == sign_t)
            ratio = interval([c / t for c, t in zip(cycles, tandem)]) if both else None
            yield scene, error, *whole, ratio, [sign_c or "", sign_t or "", (sign_c or opposite[sign_t]) if both else ""]


def settings(row):
    if "arms" in row:
        return "; ".join(f"{100 * arm['target']:g} %: {setting(arm)}" for arm in row["arms"])
    return setting(row["arm"]) if "arm" in row else "not chosen yet"


def setting(arm):
    pattern = "Sobol" if arm["sampling_pattern"] == "SOBOL" else "multi-jitter"
    return f"{'adaptive' if arm['adaptive'] else 'even'}, {pattern}, roulette {'on' if arm['roulette'] else 'off'}"


def has_lamps_without_area_light(scene):
    """Whether a lamp of a shipped scene is no rectangle, so that Cycles finds it by scattering alone (scripts/adapters/cycles.py)."""
    data = json.loads((SCENES / f"{scene}.json").read_text())
    lit = {name for name, material in data["materials"].items() if "radiance" in material}
    return any(entity.get("material") in lit and any("quad" not in primitive for primitive in entity["primitives"])
               for entity in data["entities"])


def outcome(ratio, signs):
    if ratio is None:
        return "untold"
    if ratio[1] > 1 and signs[2] != "≤ ":
        return "Tandem"
    return "Cycles" if ratio[2] < 1 and signs[2] != "≥ " else "undecided"


def counts(outcomes):
    """Who is significantly sooner in how many pairs."""
    told = f"Tandem is significantly sooner in {outcomes.count('Tandem')}, Cycles in {outcomes.count('Cycles')}."
    for kind, words in (("undecided", "Undecided"), ("untold", "Cannot be told")):
        told += f" {words}: {outcomes.count(kind)}." if kind in outcomes else ""
    return told


def page_of(record):
    rows, starts, outcomes = [], [], {}
    for scene, error, cycles, tandem, ratio, signs in comparisons(record):
        cells = " | ".join(map(shown, (cycles, tandem, ratio), signs))
        rows.append(f"| {scene} | {100 * error:g} % | {cells} |")
        outcomes.setdefault(scene, []).append(outcome(ratio, signs))
    for scene, row in record["scenes"].items():
        if not row.get("starts"):
            continue
        median = lambda key: statistics.median(start[key] for start in row["starts"])
        reference = row["reference"]
        starts.append(f"| {scene} | {settings(row)} | {median('cycles_start_seconds'):.3g} | "
                      f"{median('cycles_load_seconds'):.3g} | {fixed_seconds(row):.3g} | {median('tandem_start_and_load_seconds'):.3g} | "
                      f"{reference['backend']} on {reference['device']}, {reference['samples']} samples, "
                      f"{100 * reference['relative_uncertainty']:.2g} % | {row['processor']}, {row['commit']} |")
    versions = sorted({row["version"] for row in record["scenes"].values() if "version" in row})
    by_scattering = [scene for scene in record["scenes"] if has_lamps_without_area_light(scene)]
    every = sum(outcomes.values(), [])
    sampled = [one for scene, found in outcomes.items() for one in found if scene not in by_scattering]
    found = f"- {len(every)} pairs of scene and error: {counts(every)}"
    if by_scattering:
        found += f"\n- The {len(sampled)} of scenes whose lights Cycles samples: {counts(sampled)}"
    older = [scene for scene, row in record["scenes"].items() if "arm" in row]
    one_for_all = (f" On {', '.join(older)} one choice goes\n  for all errors: it was soonest at the smallest that most reached in 5 s. "
                   "At others different settings may be sooner." if older else "")
    return TEXT.format(found=found, version=", ".join(versions), size=record["size"], one_for_all=one_for_all,
                       found_by_scattering=", ".join(by_scattering) or "no scene here",
                       seeds=record["seeds"], most=record["most_seconds"], rows="\n".join(rows), starts="\n".join(starts))


def text_of(record):
    """JSON with a line a point, so that a changed result reads as one."""
    record = json.loads(json.dumps(record))
    points = {}
    for scene, row in record["scenes"].items():
        points[scene] = row.get("points", [])
        row["points"] = f"POINTS {scene}"
    text = json.dumps(record, indent=1)
    for scene, found in points.items():
        lines = ",\n".join("    " + json.dumps(point) for point in found)
        text = text.replace(json.dumps(f"POINTS {scene}"), f"[\n{lines}\n   ]" if found else "[]")
    return text + "\n"
