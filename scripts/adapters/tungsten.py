#!/usr/bin/python3
"""Tungsten for `tandem verify`: renders what `tandem export --to mitsuba` writes, said in Tungsten's words.

    tandem verify scenes/cornell-classic.json --size 64 --candidate \\
      'exec:scripts/adapters/tungsten.py {scene} {width} {height} {samples} {seed} {bounces} {threads} {out:pfm}'

$TUNGSTEN is the program; without it, tungsten on PATH. $TANDEM is tandem. Debian has no Tungsten: build it from its sources.
Suns, skies that are no single colour and scenes without lights are refused, besides what the export refuses.
Rays start 5e-4 units beside surfaces: scenes of hundreds of units shadow themselves. Images of lenses are half a pixel off.
"""
import json
import math
import sys
import xml.etree.ElementTree as xml

from exported import adapter, run


def refuse(what):
    sys.exit(f"tungsten.py refuses {what}")


def triple(text):
    return [float(number) for number in text.split(",")]


class Element:
    """A plugin of Mitsuba's XML: its values by name, and the plugins in it."""

    def __init__(self, element):
        self.kind, self.type, self.id = element.tag, element.get("type"), element.get("id")
        self.values, self.parts, self.references = {}, [], {}
        for child in element:
            name, value = child.get("name"), child.get("value")
            if child.tag in ("float", "integer"):
                self.values[name] = 0 if value.startswith("$") else float(value)
            elif child.tag in ("rgb", "point", "vector"):
                self.values[name] = triple(value)
            elif child.tag in ("string", "boolean"):
                self.values[name] = value
            elif child.tag == "transform":
                self.values[name] = child[0].attrib
            elif child.tag == "ref":
                self.references[name or "bsdf"] = child.get("id")
            else:
                self.parts.append(Element(child))
                if name:
                    self.values[name] = self.parts[-1]

    def part(self, kind):
        return next((part for part in self.parts if part.kind == kind), None)


def texture(value):
    if not isinstance(value, Element):
        return value
    if value.type == "bitmap":
        return {"type": "bitmap", "file": value.values["filename"], "gamma_correct": False, "interpolate": True, "clamp": False}
    # Tungsten's checker has whole numbers of cells, and cells of color0 where they are even.
    cells = [2 * abs(float(value.values["to_uv"][axis])) for axis in "xy"]
    if any(count != round(count) for count in cells):
        refuse(f"a checker of {cells} cells")
    return {"type": "checker", "on_color": value.values["color1"], "off_color": value.values["color0"], "res_u": int(cells[0]), "res_v": int(cells[1])}


def bsdf(element, name):
    values = element.values
    if element.type == "twosided":  # Tungsten turns every opaque surface to the ray
        return bsdf(element.parts[0], name)
    made = {"name": name}
    if element.type == "diffuse":
        return made | {"type": "lambert", "albedo": texture(values["reflectance"])}
    if element.type == "conductor" and values.get("material") == "none":
        return made | {"type": "mirror", "albedo": texture(values["specular_reflectance"])}
    if element.type in ("conductor", "roughconductor"):
        made |= {"type": element.type.replace("rough", "rough_"), "eta": values["eta"], "k": values["k"], "albedo": 1}
    elif element.type in ("dielectric", "roughdielectric"):
        made |= {"type": element.type.replace("rough", "rough_"), "ior": values["int_ior"], "albedo": texture(values["specular_reflectance"])}
    elif element.type == "null":
        return made | {"type": "forward"}
    else:
        refuse(f"the material {element.type}")
    return made | ({"distribution": "ggx", "roughness": values["alpha"]} if element.type.startswith("rough") else {})


def medium(element):
    extinction, albedo = element.values["sigma_t"], element.values["albedo"]
    phase = element.part("phase")
    return {"name": element.id, "type": "homogeneous", "sigma_s": [t * a for t, a in zip(extinction, albedo)],
            "sigma_a": [t * (1 - a) for t, a in zip(extinction, albedo)],
            "phase_function": {"type": "henyey_greenstein", "g": phase.values["g"]} if phase else {"type": "isotropic"}}


def shape(element):
    if element.type == "sphere":
        made = {"type": "sphere", "transform": {"position": element.values["center"], "scale": element.values["radius"]}}
    else:
        made = {"type": "mesh", "file": element.values["filename"], "smooth": element.values["face_normals"] == "false", "recompute_normals": False}
    made["bsdf"] = element.references["bsdf"]
    for ours, theirs in (("interior", "int_medium"), ("exterior", "ext_medium")):
        if ours in element.references:
            made[theirs] = element.references[ours]
    if element.part("emitter"):
        made["emission"] = element.part("emitter").values["radiance"]
    return made


def light(element):
    if element.type == "point":
        return {"type": "point", "transform": {"position": element.values["position"]}, "emission": element.values["intensity"]}
    if element.type == "constant":
        return {"type": "infinite_sphere", "emission": element.values["radiance"], "sample": True}
    return refuse("a sky that is no single colour" if element.type == "envmap" else "a sun: Tungsten's suns are wide")


def camera(element, width, height):
    values, look = element.values, element.values["to_world"]
    field = math.radians(values["fov"]) / 2  # vertical; Tungsten's is horizontal
    made = {"type": "pinhole", "resolution": [width, height], "tonemap": "linear", "reconstruction_filter": "box",
            "fov": 2 * math.degrees(math.atan(math.tan(field) * width / height)),
            "transform": {"position": triple(look["origin"]), "look_at": triple(look["target"]), "up": triple(look["up"])}}
    if element.type == "thinlens":
        made |= {"type": "thinlens", "aperture_size": values["aperture_radius"], "focus_distance": values["focus_distance"],
                 "aperture": {"type": "disk"}}
    return made | ({"medium": element.references["medium"]} if "medium" in element.references else {})


def translated(root, arguments):
    parts = [Element(element) for element in root if element.tag != "default"]
    of = {kind: [part for part in parts if part.kind == kind] for kind in ("integrator", "sensor", "medium", "bsdf", "emitter", "shape")}
    primitives = [shape(part) for part in of["shape"]] + [light(part) for part in of["emitter"]]
    if not any("emission" in primitive for primitive in primitives):
        refuse("a scene without lights: Tungsten lights it with a white sky")
    return {"media": [medium(part) for part in of["medium"]], "bsdfs": [bsdf(part, part.id) for part in of["bsdf"]], "primitives": primitives,
            "camera": camera(of["sensor"][0], arguments.width, arguments.height),
            "integrator": {"type": "path_tracer", "max_bounces": arguments.bounces + 1, "enable_consistency_checks": True},
            "renderer": {"spp": arguments.samples, "spp_step": arguments.samples, "adaptive_sampling": False, "stratified_sampler": False,
                         "overwrite_output_files": True, "output_file": ""}}


def image_of(tungsten, scene, image, arguments):
    if image.suffix != ".pfm":
        refuse(f"{image.suffix} images: write {{out:pfm}}")
    json_file = scene.with_suffix(".json")
    json_file.write_text(json.dumps(translated(xml.parse(scene).getroot(), arguments), indent=1))
    return run([tungsten, "-t", arguments.threads, "-s", arguments.seed, "-e", image, json_file])


adapter(__doc__, "TUNGSTEN", "tungsten", "mitsuba", image_of)
