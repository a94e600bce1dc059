"""What `tandem bench --method thesis --json` wrote: its tables, and a page of them. Imported by scripts/report and
scripts/measure/guidelines."""
import pathlib

import jinja2
from bench_results import device_of, sentence

NOT_ITS_SIZE = "Not the thesis's size: its figures stand beside for the record only."


def is_thesis(report):
    return {"fit", "configurations", "sweep", "two_bounces"} <= report.get("thesis", {}).keys()


def thesis_title(result):
    report = result["thesis"]
    return f"{device_of(result)}: {report['width']}x{report['height']}, {report['bounces']} bounces"


def thesis_frame(run):
    if "frame" not in run:
        return "Frame: the wavefront's in place of the thesis's, Scene and Camera in the device's memory, no window."
    return f"Frame: {sentence(run['frame'])}. Clock: {sentence(run['clock'])}."


def mean(part):
    if part["low_milliseconds"] is None:
        return "—"
    return f"{part['mean_milliseconds']:.4g} ({part['low_milliseconds']:.4g} to {part['high_milliseconds']:.4g})"


def cells_table(run):
    rows = []
    for cell in run["configurations"]:
        row = [f"{cell['samples']} spp, {cell['threads']} threads, {'cohesive' if cell['cohesive'] else 'split'}"]
        for part in "first", "fresh", "steady":
            row += [mean(cell[part]), f"{cell['thesis'][part + '_milliseconds']:.1f}"]
        rows.append(row)
    heads = ["milliseconds a frame", "first", "thesis", "fresh: mean (95 %)", "thesis", "steady: mean (95 %)", "thesis"]
    return {"heads": heads, "rows": rows, "note": ""}


def by_samples(name, points, *rows):
    """A column a number of samples, and rows of a name and its cells."""
    a_sample = [f"{point['frame']['mean_milliseconds'] / point['samples']:.4g}" for point in points]
    return {"heads": [name] + [str(point["samples"]) for point in points],
            "rows": [["milliseconds a sample", *a_sample], *rows], "note": ""}


def thesis_tables(run):
    """[{"heads", "rows", "note"}]: the eight cells, the sweep over samples, the runs of two bounces."""
    fit, sweep = run["fit"], by_samples("samples a frame", run["sweep"])
    if fit is not None:  # a stopped run has none
        sweep["note"] = f"Fit: {fit['a']:.4g} + {fit['b']:.3g} ({fit['b_low']:.3g} to {fit['b_high']:.3g}) ln(samples)."
    theirs = [f"{point['thesis_milliseconds_a_sample']:.3f}" for point in run["two_bounces"]]
    return [cells_table(run), sweep,
            by_samples("samples a frame, at two bounces", run["two_bounces"], ["thesis", *theirs])]


def render(result):
    """One HTML page."""
    report = result["thesis"]
    runs = [("Without a window", report)]
    if "presented" in report:
        runs.append(("In a window", report["presented"]))
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), autoescape=True,
                                     trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    return environment.get_template("thesis_template.html").render(
        title=thesis_title(result), report=result, not_its_size="" if report["protocol_size"] else NOT_ITS_SIZE,
        not_presented=report.get("not_presented"),
        runs=[{"name": name, "frame": thesis_frame(run), "tables": thesis_tables(run)} for name, run in runs])
