"""Pages of stored results of `tandem cost --json`: one over all scenes and machines, and one a scene. Imported by scripts/report.

A folder of results holds MACHINE/SCENE.json, and pictures/MACHINE/SCENE/pictures.json with what
scripts/measure/accuracy_pictures rendered."""
import base64
import json
import pathlib

import accuracy_claims
import commits
import frontier
import jinja2

PICTURES = "pictures"
CLIPPED = 0.2  # share of an error: a caption tells the file's too where it is off by more
SHOWN = (0.05, 0.01, 0.003)  # errors of the tables, where the results have them


def load(folder):
    """{machine: {scene: report}}, in the order of their names."""
    results = {}
    for path in sorted(folder.glob("*/*.json")):
        if path.parent.name == PICTURES:
            continue
        report = json.loads(path.read_text())
        if "arms" not in report:
            raise OSError(f"{path}: was not written by tandem cost --json")
        results.setdefault(path.parent.name, {})[path.stem] = report
    if not results:
        raise OSError(f"{folder}: holds no MACHINE/SCENE.json of tandem cost --json")
    return results


def load_pictures(folder, scene):
    """What was rendered of a scene, a set a machine, images inlined."""
    sets = []
    for path in sorted((folder / PICTURES).glob(f"*/{scene}/pictures.json")):
        found = json.loads(path.read_text())
        found["machine"] = path.parent.parent.name
        for picture in found["pictures"]:
            for key in ("file", "difference"):
                if picture.get(key):
                    data = base64.b64encode((path.parent / picture[key]).read_bytes()).decode()
                    picture[key] = f"data:image/png;base64,{data}"
        sets.append(found)
    return sets


def commit_faults(folder):
    """A line for each result and set of pictures whose commit makes it no evidence."""
    results = [(path, "git") for path in sorted(folder.glob("*/*.json")) if path.parent.name != PICTURES]
    pictures = [(path, "commit") for path in sorted((folder / PICTURES).glob("*/*/pictures.json"))]
    return [f"{path}: {fault}" for path, key in results + pictures
            if (fault := commits.commit_fault(json.loads(path.read_text()).get(key)))]


def cell(report, arm, error):
    """When a setting reached an error: what was not measured is no evidence."""
    time = next((time for time in arm["seconds_to"] if abs(time["relative_error"] - error) < 1e-9), None)
    if time is None:
        return "–"
    if time["seconds"] is None or time["extrapolated"]:
        never = arm["bias_floor_significant"] and arm["bias_floor_low"] >= error
        return "never" if never else f"not reached in {frontier.duration(frontier.longest([arm]))}"
    anew = frontier.measured_anew(report, error)
    return frontier.duration(anew["seconds"] if anew and anew["recommended"] == frontier.name_of(arm) else time["seconds"])


def errors_of(reports):
    known = {time["relative_error"] for report in reports for time in report["arms"][0]["seconds_to"]}
    return [error for error in SHOWN if any(abs(error - other) < 1e-9 for other in known)]


def floor(arm):
    if arm["bias_floor_significant"]:
        return f"bias {frontier.percent(arm['bias_floor'])}"
    return "unbiased" if frontier.is_unbiased(arm) else f"no bias found above {frontier.percent(arm['bias_floor_high'])}"


def view(machine, report, bounds, errors):
    """What the template shows of one scene on one machine."""
    stretches = frontier.frontier(report)
    numbers = frontier.number_of_settings(stretches)
    arms = {name: arm for name, arm, _ in stretches}
    rows = [{"number": number, "colour": frontier.COLOURS[(number - 1) % len(frontier.COLOURS)], "name": name,
             "arm": arms[name]} for name, number in numbers.items()]
    if "baseline" not in numbers:
        rows.append({"number": "", "colour": "#222", "name": "baseline", "arm": report["arms"][0]})
    for row in rows:
        row.update(floor=floor(row["arm"]), times=[cell(report, row["arm"], error) for error in errors])
    return {"machine": machine, "report": report, "rows": rows,
            "plot": frontier.plot(report, bounds, f"Error against time: {report['scene']}, {machine}") if bounds else None}


def scene_view(folder, scene, results):
    reports = {machine: found[scene] for machine, found in results.items() if scene in found}
    bounds, errors = frontier.limits(reports.values()), errors_of(reports.values())
    views = [view(machine, report, bounds, errors) for machine, report in reports.items()]
    return {"name": scene, "errors": errors, "views": views, "sets": load_pictures(folder, scene)}


def page(folder, results, scenes, title):
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent), autoescape=True,
                                     trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters.update(percent=frontier.percent, duration=frontier.duration)
    return environment.get_template("accuracy_template.html").render(
        title=title, results=results, style=frontier.STYLE, better=1 - frontier.BETTER, clipped=CLIPPED,
        sentences=accuracy_claims.sentences(results) if len(scenes) > 1 else [],
        scenes=[scene_view(folder, scene, results) for scene in scenes])


def scenes_of(results):
    return sorted({scene for reports in results.values() for scene in reports})


def overview(folder):
    results = load(folder)
    return page(folder, results, scenes_of(results), "What accuracy costs in time")


def scene_pages(folder):
    """{scene: page}"""
    results = load(folder)
    return {scene: page(folder, results, [scene], f"What accuracy costs: {scene}")
            for scene in scenes_of(results)}
