#!/usr/bin/python3
# A path tracer in numpy, to read and to change: diffuse and emissive quads, triangles, cuboids and spheres.
# It is the tutorial of common/external/README.md. Debian: apt-get install python3-numpy
#   tandem verify scenes/cornell-classic.json --size 64 --reference cpu --candidate \
#     'exec:scripts/adapters/first_path_tracer.py {scene} {width} {height} {samples} {seed} {out:npy}'
# It follows common/MODEL.md and refuses what it cannot do.
import json
import sys

import numpy as np


def refuse(what):
    sys.exit(f"first_path_tracer refuses {what}")


def only(thing, known, where):
    for key in (key for key in thing if key not in known):
        refuse(f"'{key}' in {where}")


def placed(steps):
    """The 4x4 matrix of a transform (FORMAT.md): the first step acts on the object first."""
    whole = np.eye(4)
    for step in steps:
        m = np.eye(4)
        if "translate" in step:
            m[:3, 3] = step["translate"]
        elif "scale" in step:
            m[:3, :3] = np.diag(np.broadcast_to(step["scale"], 3))
        elif "matrix" in step:
            m = np.reshape(step["matrix"], (4, 4))
        else:
            x, y, z = axis = np.array(step["rotate"]["axis"]) / np.linalg.norm(step["rotate"]["axis"])
            a, cross = np.radians(step["rotate"]["degrees"]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            m[:3, :3] = np.cos(a) * np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * np.outer(axis, axis)
        whole = m @ whole
    return whole


class Flat:
    """A quad or a triangle (`most` = 1): corner c and edges e, g, front along e x g."""
    def __init__(self, c, e, g, most, matrix, material):
        turn = np.sign(np.linalg.det(matrix[:3, :3]))  # mirrored entities keep their front sides
        self.c, self.e, self.g = (matrix @ [*c, 1])[:3], matrix[:3, :3] @ e, matrix[:3, :3] @ g
        n = np.cross(self.e, self.g)
        self.along_e, self.along_g = np.cross(self.g, n) / (n @ -n), np.cross(n, self.e) / (n @ -n)
        self.along_e, self.along_g = -self.along_e, -self.along_g
        self.most, self.material, self.area = most, material, np.linalg.norm(n) * most / 2
        self.n = turn * n / np.linalg.norm(n)

    def hit(self, o, d):
        t = ((self.c - o) @ self.n) / (d @ self.n)
        p = o + t[:, None] * d - self.c
        u, v = p @ self.along_e, p @ self.along_g
        inside = (u >= 0) & (v >= 0) & (u <= 1) & (v <= 1) & (u + v <= self.most)
        return np.where(inside, t, np.inf), np.broadcast_to(self.n, d.shape)


class Solid:
    """A sphere (low is its centre) or a cuboid, met in its own space."""
    def __init__(self, low, high, radius, matrix, material):
        self.low, self.high, self.radius, self.material = np.array(low), high, radius, material
        self.inverse = np.linalg.inv(matrix)

    def hit(self, o, d):
        o, d = o @ self.inverse[:3, :3].T + self.inverse[:3, 3], d @ self.inverse[:3, :3].T
        if self.radius:
            a, b, c = (d * d).sum(1), ((o - self.low) * d).sum(1), ((o - self.low)**2).sum(1) - self.radius**2
            root = np.sqrt(b * b - a * c)  # NaN, a miss, where there is none
            near, far = (-b - root) / a, (-b + root) / a
        else:
            s, t = (self.low - o) / d, (self.high - o) / d
            near, far = np.minimum(s, t).max(1), np.maximum(s, t).min(1)
            near, far = np.where(near <= far, near, np.inf), np.where(near <= far, far, np.inf)
        t = np.where(near > EPSILON, near, far)
        p = o + np.where(np.isfinite(t), t, 0)[:, None] * d - self.low
        if not self.radius:  # the side whose distance is least
            p = 2 * p / (self.high - self.low) - 1
            p = np.where(np.abs(p) == np.abs(p).max(1)[:, None], p, 0)
        n = p @ self.inverse[:3, :3]
        return t, n / np.linalg.norm(n, axis=1)[:, None]


def load(path):
    scene = json.load(open(path))
    only(scene, ("$schema", "description", "film", "camera", "background", "render", "materials", "entities", "expect"), "the scene")
    only(scene["camera"], ("position", "target", "up", "vertical_field_degrees"), "the camera")
    only(scene.get("render", {}), ("integrator", "bounces", "roulette_start"), "render")
    if scene.get("render", {}).get("integrator") == "whitted":
        refuse("the integrator whitted")
    for name, material in scene["materials"].items():
        only(material, ("kind", "colour", "radiance", "sides"), name)
        if material["kind"] not in ("diffuse", "emissive") or isinstance(material.get("colour"), dict):
            refuse(f"the material {name}")
    shapes = []
    for entity in scene["entities"]:
        only(entity, ("name", "material", "primitives", "transform"), "an entity")
        place, material = placed(entity.get("transform", [])), scene["materials"][entity["material"]]
        for (kind, value), in (primitive.items() for primitive in entity["primitives"]):
            if kind == "sphere":
                shapes.append(Solid(value["centre"], None, value["radius"], place, material))
            elif kind == "cuboid":
                shapes.append(Solid(value["minimum"], np.array(value["maximum"]), 0, place, material))
            elif kind == "quad":
                shapes.append(Flat(value["corner"], *value["edges"], 2, place, material))
            elif kind == "triangle" and not isinstance(value, dict):
                shapes.append(Flat(value[0], np.subtract(value[1], value[0]), np.subtract(value[2], value[0]), 1, place, material))
            else:
                refuse(f"the primitive {kind}")
    return scene, shapes


def closest(shapes, o, d):
    best, normal, which = np.full(len(o), np.inf), np.zeros(o.shape), np.full(len(o), -1)
    for i, shape in enumerate(shapes):
        t, n = shape.hit(o, d)
        nearer = (t > EPSILON) & (t < best)
        best[nearer], normal[nearer], which[nearer] = t[nearer], n[nearer], i
    return best, normal, which


def camera_rays(camera, width, height, random):
    f = np.subtract(camera["target"], camera["position"]).astype(float)
    f /= np.linalg.norm(f)
    r = np.cross(f, camera.get("up", [0, 1, 0]))
    r /= np.linalg.norm(r)
    h = np.tan(np.radians(camera["vertical_field_degrees"]) / 2)
    y, x = np.mgrid[0:height, 0:width].reshape(2, -1) + random.random((2, width * height))
    d = f + (h * width / height * (2 * x / width - 1))[:, None] * r + (h * (1 - 2 * y / height))[:, None] * np.cross(r, f)
    return np.broadcast_to(np.array(camera["position"], float), d.shape), d / np.linalg.norm(d, axis=1)[:, None]


def sample(scene, shapes, width, height, random):
    """One sample of every pixel: light sampling of flat lamps, scattering finds all other light."""
    radiance, colour = (np.array([s.material.get(key, [0, 0, 0]) for s in shapes], float) for key in ("radiance", "colour"))
    both = np.array([s.material.get("sides", "both") == "both" for s in shapes])
    lamps = [i for i, s in enumerate(shapes) if isinstance(s, Flat) and radiance[i].any()]
    areas = np.array([shapes[i].area for i in lamps])
    sky = scene.get("background", [0, 0, 0])
    down, up = (np.array(sky.get("radiance", sky.get(end))) if isinstance(sky, dict) else np.array(sky) for end in ("down", "up"))
    result, beta, alive = np.zeros((width * height, 3)), np.ones((width * height, 3)), np.arange(width * height)
    o, d = camera_rays(scene["camera"], width, height, random)
    bounces = scene.get("render", {}).get("bounces", 12)
    for bounce in range(bounces + 1):
        t, n, which = closest(shapes, o, d)
        gone, a = which < 0, (d[:, 1:2] + 1) / 2
        result[alive[gone]] += (beta * ((1 - a) * down + a * up))[gone]
        front = (d * n).sum(1) < 0
        counts = (front | both[which]) & ~gone & ((bounce == 0) | ~np.isin(which, lamps))
        result[alive[counts]] += (beta * radiance[which])[counts]
        on = ~gone & (colour[which].max(1) > 0)
        if bounce == bounces or not on.any():
            break
        alive, which, beta, n = alive[on], which[on], (beta * colour[which])[on], np.where(front[:, None], n, -n)[on]
        p, count = (o + t[:, None] * d)[on], on.sum()
        if lamps:  # a point on the lamps, uniform by area
            lamp = random.choice(len(lamps), count, p=areas / areas.sum())
            u, v = random.random((2, count))
            flip = (u + v > 1) & (np.array([shapes[i].most for i in lamps])[lamp] == 1)
            u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
            c, e, g, m = (np.array([getattr(shapes[i], key) for i in lamps])[lamp] for key in ("c", "e", "g", "n"))
            w = c + u[:, None] * e + v[:, None] * g - p
            far2 = (w * w).sum(1)
            cosine, facing = (w * n).sum(1), -(w * m).sum(1)
            facing = np.where(both[np.array(lamps)[lamp]], np.abs(facing), np.maximum(facing, 0))
            weight = np.maximum(cosine, 0) * facing / far2**2 * areas.sum() / np.pi
            seen = weight > 0
            seen[seen] = closest(shapes, p[seen], w[seen])[0] > 1 - 1e-9
            result[alive[seen]] += (beta * radiance[np.array(lamps)[lamp]] * weight[:, None])[seen]
        u, v = random.random((2, count))  # a direction by the cosine
        tangent = np.cross(n, np.where(np.abs(n[:, :1]) > 0.9, [[0, 1, 0]], [[1, 0, 0]]))
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        r, phi = np.sqrt(u), 2 * np.pi * v
        o, d = p, ((r * np.cos(phi))[:, None] * tangent + (r * np.sin(phi))[:, None] * np.cross(n, tangent)
                   + np.sqrt(1 - u)[:, None] * n)
    return result.reshape(height, width, 3)


def main():
    path, width, height, samples, seed, out = sys.argv[1:]
    scene, shapes = load(path)
    global EPSILON
    EPSILON = 1e-9 * np.abs(scene["camera"]["position"]).max() + 1e-9
    np.seterr(all="ignore")  # rays along faces divide by 0, and miss
    random = np.random.default_rng(int(seed))
    total, squares = np.zeros((2, int(height), int(width), 3))
    for _ in range(int(samples)):
        one = sample(scene, shapes, int(width), int(height), random)
        total, squares = total + one, squares + one * one
    mean = total / int(samples)
    variance = (squares - total * mean) / max(int(samples) - 1, 1)
    np.save(out, np.concatenate([mean, np.maximum(variance, 0)], axis=2))


main()
