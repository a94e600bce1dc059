# Blender's Cycles for `tandem verify`: reads Tandem's scene files, stays up, and answers requests on its standard input
# (common/external/README.md has the protocol). Debian 12: apt-get install blender. Tried with 3.4.
#   tandem verify scenes/cornell-classic.json --size 64 --candidate \
#     'exec:blender --background --factory-startup --python scripts/adapters/cycles.py'
# What Cycles does by another text than common/MODEL.md is refused, with the reason. Where it only needs care, the code says so.
import json
import math
import os
import struct
import sys
import time

# Cycles and Blender write to standard output what they do; answers go their own way.
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import bpy  # noqa: E402
import mathutils  # noqa: E402

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from cycles_shaders import Lobes, Shader, fresnel_of_metal  # noqa: E402

# What tandem export --to blender puts in the place of None: the scene of a script that stands alone.
EXPORTED = None

GLASS = ("translucent", "colour", "alpha", "refractive_index", "fresnel", "fuzz", "roughness", "interior", "priority")
HAIR = 1e-4  # of a lamp's size: between its light and the sheet that stops light behind it


class Refusal(Exception):
    pass


def only(thing, known, where):
    for key in thing:
        if key not in known:
            raise Refusal(f"{where} has '{key}', which this adapter does not translate")


def read_pfm(path):
    with open(path, "rb") as file:
        kind = file.readline().strip()
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        if kind != b"PF":
            raise Refusal(f"{path} is no PFM file of three channels")
        return width, height, struct.unpack(f"{order}{width * height * 3}f", file.read(width * height * 12))


class Scene:
    def __init__(self, folder, data):
        self.folder, self.data = folder, data
        only(self.data, ("$schema", "description", "film", "camera", "background", "render", "textures", "materials", "media",
                         "medium", "lights", "entities", "expect"), "the scene")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.materials, self.images = {}, {}
        self.origin = bpy.data.objects.new("origin", None)
        self.scene.collection.objects.link(self.origin)
        self.set_world(self.data.get("background", [0, 0, 0]))
        for light in self.data.get("lights", []):
            self.add_light(light)
        for number, entity in enumerate(self.data["entities"]):
            self.add_entity(entity, number)

    # -- Materials

    def image(self, name, space):
        """Linear floats: Tandem interpolates between linear texels, and Blender reads no PFM."""
        if not name.endswith(".pfm") or space != "linear":
            raise Refusal(f"the image {name} is no linear PFM file")
        if name not in self.images:
            width, height, values = read_pfm(os.path.join(self.folder, name))
            image = bpy.data.images.new(name, width, height, float_buffer=True, alpha=False)
            image.colorspace_settings.name = "Linear"
            image.pixels = [v for i in range(0, len(values), 3) for v in (*values[i:i + 3], 1.0)]
            image.pack()
            self.images[name] = image
        return self.images[name]

    def colour(self, shader, value):
        """A colour, or the socket of a texture."""
        if not isinstance(value, dict):
            return value
        texture = self.data["textures"][value["texture"]]
        if texture["kind"] == "image":
            node = shader.node("TexImage", Vector=shader.node("TexCoord").outputs["UV"])
            node.image, node.interpolation, node.extension = self.image(texture["file"], texture["colour_space"]), "Linear", "REPEAT"
            return node.outputs["Color"]
        if texture["kind"] != "checker" or texture.get("space", "object") != "object":
            raise Refusal(f"the texture {value['texture']}: Cycles' noise is another function than MODEL.md's")
        point = shader.node("SeparateXYZ", Vector=shader.node("TexCoord").outputs["Object"])
        frequency = texture.get("frequency", 1)
        frequency = frequency if isinstance(frequency, list) else [frequency] * 3
        # Cycles' own checker moves its points by 1e-6; parity by nodes does not.
        cells = [(shader.number(point.outputs[i]) * f).math("FLOOR") for i, f in enumerate(frequency)]
        odd = ((cells[0] + cells[1] + cells[2]) * 0.5).math("FRACT") * 2.0
        mixed = shader.node("MixRGB", Fac=odd, Color1=texture["colours"][0], Color2=texture["colours"][1])
        return mixed.outputs[0]

    def material(self, name):
        if name in self.materials:
            return self.materials[name]
        data = self.data["materials"][name]
        made = bpy.data.materials.new(name)
        made.use_nodes = True
        # Cycles 3.4 samples the triangles of meshes too seldom at grazing angles (1.3 % too dark near a wall). Scattering alone
        # finds lamps that are meshes. Rectangles become area lights (add_rectangle).
        made.cycles.sample_as_light = False
        shader = Shader(made.node_tree)
        output = shader.nodes.new("ShaderNodeOutputMaterial")
        if data["kind"] == "boundary":  # a volume alone
            only(data, ("kind", "interior", "priority"), f"the material {name}")
        else:
            shader.links.new(self.surface(shader, name, data), output.inputs["Surface"])
        if data.get("priority", 0) != 0:
            raise Refusal(f"the material {name}: Cycles knows no priorities")
        if "medium" in self.data and ("interior" in data or "priority" in data):
            raise Refusal(f"the material {name}: media within a medium add up in Cycles")
        if "interior" in data:
            shader.links.new(self.volume(shader, data["interior"]), output.inputs["Volume"])
        self.materials[name] = made
        return made

    def volume(self, shader, name):
        """MODEL.md 10."""
        data = self.data["media"][name]
        only(data, ("absorption", "scattering", "anisotropy"), f"the medium {name}")
        absorbed, scattered = (value if isinstance(value, list) else [value] * 3
                               for value in (data.get("absorption", 0), data.get("scattering", 0)))
        most, density = max(absorbed) or 1.0, max(scattered) or 1.0  # colours of nodes end at 1
        result = shader.node("VolumeAbsorption", Color=[1 - value / most for value in absorbed], Density=max(absorbed)).outputs[0]
        if max(scattered) == 0:
            return result
        return shader.add(result, shader.node("VolumeScatter", Color=[value / density for value in scattered], Density=density,
                                              Anisotropy=data.get("anisotropy", 0)).outputs[0])

    def surface(self, shader, name, data):
        kind, where = data["kind"], f"the material {name}"
        if kind == "rough-diffuse" and data.get("roughness", 0) > 0:
            raise Refusal(f"{where}: Cycles' fit of Oren and Nayar's model is another one than MODEL.md 7.9")
        if kind in ("diffuse", "rough-diffuse"):
            only(data, ("kind", "colour", "radiance", "sides", "roughness"), where)
            result = shader.node("BsdfDiffuse", Color=self.colour(shader, data["colour"]), Roughness=0.0).outputs[0]
            if "radiance" in data:
                result = shader.add(result, shader.emission(data["radiance"], data.get("sides", "both")))
            return result
        if kind == "emissive":
            only(data, ("kind", "radiance", "sides", *(GLASS if data.get("translucent") else ())), where)
            if not data.get("translucent"):
                return shader.emission(data["radiance"], data.get("sides", "both"))
            radiance = [data.get("alpha", 1) * value for value in data["radiance"]]
            return shader.add(self.glass(shader, data), shader.emission(radiance, data.get("sides", "both")))
        if kind == "specular" and data.get("translucent"):
            only(data, ("kind", *GLASS), where)
            return self.glass(shader, data)
        if kind == "specular":
            only(data, ("kind", "translucent", "colour", "fuzz"), where)
            if data.get("fuzz", 0) > 0:
                return Lobes(shader).mirror(self.tint(shader, data["colour"]), data["fuzz"])
            return shader.mirror(self.colour(shader, data["colour"]))
        if kind == "conductor":
            only(data, ("kind", "eta", "k", "roughness"), where)
            lobes = Lobes(shader)
            if data.get("roughness", 0) > 0:
                return lobes.conductor(data["eta"], data["k"], data["roughness"] ** 2)
            return shader.mirror(shader.combine(*[fresnel_of_metal(lobes.cosine, eta, k) for eta, k in zip(data["eta"], data["k"])]))
        raise Refusal(f"{where}: the adapter has no {kind}")

    def tint(self, shader, value):
        colour = self.colour(shader, value)
        return shader.vector(colour) if isinstance(value, dict) else shader.constant(colour)

    def glass(self, shader, data):
        alpha, index, fuzz, roughness = (data.get(key, standard) for key, standard in
                                         (("alpha", 1), ("refractive_index", 1.5), ("fuzz", 0), ("roughness", 0)))
        colour = self.tint(shader, data.get("colour", [1, 1, 1])) * alpha + [1 - alpha] * 3
        if fuzz == 0 and roughness == 0 and data.get("fresnel", "exact") == "exact":
            return shader.glass(colour, index)
        return Lobes(shader).glass(colour, index, data.get("fresnel", "exact"), fuzz, roughness ** 2)

    # -- Light from everywhere, and from points

    def set_world(self, background):
        self.scene.world = bpy.data.worlds.new("world")
        self.scene.world.use_nodes = True
        shader = Shader(self.scene.world.node_tree)
        parts = shader.node("SeparateXYZ", Vector=shader.node("TexCoord").outputs["Generated"])
        x, y, z = (shader.number(parts.outputs[i]) for i in range(3))
        strength, finest = 1.0, 64
        if isinstance(background, dict) and "image" in background:
            only(background, ("image", "colour_space", "scale", "rotation_degrees", "sampled"), "the background")
            angle = math.radians(background.get("rotation_degrees", 0))
            cos, sin = math.cos(angle), math.sin(angle)
            # MODEL.md 8.1 turns d by -rotation about +y; Cycles measures u from x towards -y, and height along z.
            node = shader.node("TexEnvironment", Vector=shader.combine(x * cos - z * sin, x * sin + z * cos, y))
            node.image, node.interpolation = self.image(background["image"], background["colour_space"]), "Linear"
            colour, strength, finest = node.outputs["Color"], background.get("scale", 1), 2 * node.image.size[0]
        else:
            ends = background if isinstance(background, dict) else {"radiance": background}
            down, up = (ends.get("radiance", ends.get(end)) for end in ("down", "up"))
            a = (y + 1.0) * 0.5
            mixed = [a * (end - begin) + begin for begin, end in zip(down, up)]
            colour = shader.combine(*mixed, "CombineColor", ("Red", "Green", "Blue"))
        # By itself Cycles makes a map of millions of directions to sample, anew for each image.
        self.scene.world.cycles.sampling_method, self.scene.world.cycles.sample_map_resolution = "MANUAL", finest
        made = shader.node("Background", Color=colour, Strength=strength)
        output = shader.nodes.new("ShaderNodeOutputWorld")
        shader.links.new(made.outputs[0], output.inputs["Surface"])
        if "medium" in self.data:
            shader.links.new(self.volume(shader, self.data["medium"]), output.inputs["Volume"])

    def place(self, thing, name, matrix):
        placed = bpy.data.objects.new(name, thing)
        # An object's own matrix loses what shears. The inverse matrix of its parent, which stands at the origin, keeps it.
        placed.parent, placed.matrix_parent_inverse = self.origin, matrix
        self.scene.collection.objects.link(placed)
        return placed

    def add_light(self, light):
        if "point" in light:
            data = bpy.data.lights.new("point", "POINT")
            value, data.shadow_soft_size = light["point"]["intensity"], 0.0
            matrix, factor = mathutils.Matrix.Translation(light["point"]["position"]), 4 * math.pi * math.pi
        elif "sun" in light:
            data = bpy.data.lights.new("sun", "SUN")
            value, data.angle = light["sun"]["irradiance"], 0.0
            matrix, factor = mathutils.Vector(light["sun"]["direction"]).to_track_quat("-Z", "Y").to_matrix().to_4x4(), 1.0
        else:
            raise Refusal("a spot: Cycles blends the edge of the cone by another curve than MODEL.md 8.3")
        data.energy = factor * (max(value) or 1.0)
        data.color = [v / (max(value) or 1.0) for v in value]
        self.place(data, "light", matrix)

    def add_rectangle(self, name, corner, e, g, data):
        """A lamp: area lights, which emit from their front alone, a black sheet behind, and a face that the camera alone sees."""
        normal = e.cross(g).normalized()
        hair = HAIR * min(e.length, g.length)
        both = data.get("sides", "both") == "both"
        centre, strength = corner + (e + g) / 2, max(data["radiance"])
        for side in (1, -1) if both else (1,):
            light = bpy.data.lights.new(name, "AREA")
            light.shape, light.size, light.size_y = "RECTANGLE", e.length, g.length
            light.energy = 4.0 * strength * e.length * g.length  # radiance = energy / (4 area)
            light.color = [value / strength for value in data["radiance"]]
            z = -side * normal  # it emits along its -z
            x = e.normalized()
            matrix = mathutils.Matrix((x, z.cross(x), z)).transposed().to_4x4()
            matrix.translation = centre + side * (hair if both else 0) * normal
            self.place(light, name, matrix)
        black = bpy.data.materials.get("black") or bpy.data.materials.new("black")
        black.use_nodes = True
        shader = Shader(black.node_tree)
        shader.links.new(shader.node("BsdfDiffuse", Color=(0, 0, 0)).outputs[0],
                         shader.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        behind = corner - (0 if both else hair) * normal
        self.add_mesh("sheet", [behind, behind + e, behind + e + g, behind + g], [(0, 1, 2, 3)], black)
        for side in (1, -1) if both else (1,):
            at = corner + side * (hair / 2 if both else 0) * normal
            face = self.add_mesh("face", [at, at + e, at + e + g, at + g], [(0, 1, 2, 3)], self.material(name))
            for ray in ("diffuse", "glossy", "shadow", "transmission", "volume_scatter"):  # of the lights all others see
                setattr(face, "visible_" + ray, False)

    # -- Shapes

    def add_mesh(self, name, points, faces, material, matrix=mathutils.Matrix(), coordinates=None, smooth=False):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([tuple(point) for point in points], [], faces)
        mesh.materials.append(material)
        if coordinates:
            layer = mesh.uv_layers.new()
            for loop, face in zip(layer.data, (corner for face in faces for corner in face)):
                loop.uv = coordinates[face]
        for polygon in mesh.polygons:
            polygon.use_smooth = smooth
        return self.place(mesh, name, matrix)

    def transform(self, steps):
        whole = mathutils.Matrix()
        for step in steps:
            if "translate" in step:
                m = mathutils.Matrix.Translation(step["translate"])
            elif "rotate" in step:
                m = mathutils.Matrix.Rotation(math.radians(step["rotate"]["degrees"]), 4, mathutils.Vector(step["rotate"]["axis"]))
            elif "scale" in step:
                s = step["scale"]
                m = mathutils.Matrix.Diagonal((*(s if isinstance(s, list) else [s] * 3), 1.0))
            else:
                v = step["matrix"]
                m = mathutils.Matrix((v[0:4], v[4:8], v[8:12], v[12:16]))
            whole = m @ whole
        return whole

    def add_entity(self, entity, number):
        where = entity.get("name", f"entity {number}")
        only(entity, ("name", "material", "primitives", "transform"), where)
        if "material" not in entity:
            raise Refusal(f"{where}: models with materials of their own")
        name, matrix = entity["material"], self.transform(entity.get("transform", []))
        data = self.data["materials"][name]
        if matrix.determinant() < 0 and data.get("sides") == "front":
            raise Refusal(f"{where}: a mirrored lamp")
        for primitive in entity["primitives"]:
            (kind, value), = primitive.items()
            if kind == "sphere":
                self.add_sphere(where, value, self.material(name), matrix, data)
            elif kind == "cuboid":
                low, high = value["minimum"], value["maximum"]
                points = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
                faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
                self.add_mesh(where, points, faces, self.material(name), matrix)
            elif kind == "triangle" and isinstance(value, list):
                self.add_mesh(where, value, [(0, 1, 2)], self.material(name), matrix)
            elif kind == "quad":
                only(value, ("corner", "edges"), where)
                c, e, g = (mathutils.Vector(v) for v in (value["corner"], *value["edges"]))
                turn = matrix.to_3x3()
                lamp = data["kind"] == "emissive" and abs((turn @ e).normalized().dot((turn @ g).normalized())) < 1e-6
                if lamp and max(data["radiance"]) > 0:
                    self.add_rectangle(name, matrix @ c, turn @ e, turn @ g, data)
                else:
                    self.add_mesh(where, [c, c + e, c + e + g, c + g], [(0, 1, 2), (0, 2, 3)], self.material(name), matrix,
                                  [(0, 0), (1, 0), (1, 1), (0, 1)])
            elif kind == "obj":
                points, faces = self.read_obj(value, where)
                self.add_mesh(where, points, faces, self.material(name), matrix)
            elif kind == "mesh":
                self.add_mesh(where, value["points"], value["faces"], self.material(name), matrix, value["coordinates"])
            else:
                raise Refusal(f"{where}: the primitive {kind}")

    def read_obj(self, value, where):
        """Points and faces alone: the entity has the material."""
        points, faces = [], []
        with open(os.path.join(self.folder, value["file"])) as file:
            for kind, *words in (line.split() for line in file if line.strip()):
                if kind == "vn" and value.get("normals") != "flat":
                    raise Refusal(f"{where}: a model with vertex normals, which Cycles uses by another rule than MODEL.md 5.4")
                if kind == "v":
                    points.append(tuple(map(float, words[:3])))
                elif kind == "f":
                    corners = [int(word.split("/")[0]) for word in words]
                    corners = [i - 1 if i > 0 else len(points) + i for i in corners]
                    faces += [(corners[0], a, b) for a, b in zip(corners[1:], corners[2:])]
        return points, faces

    def add_sphere(self, where, value, material, matrix, data):
        """Cycles has no spheres whose inside can be seen. The mesh's points are off by 4e-5 of the radius at most."""
        import bmesh
        texture = data.get("colour")
        if isinstance(texture, dict) and self.data["textures"][texture["texture"]].get("space", "coordinates") != "object":
            raise Refusal(f"{where}: a sphere with texture coordinates")
        made = bmesh.new()
        bmesh.ops.create_icosphere(made, subdivisions=7, radius=value["radius"])
        points = [vertex.co + mathutils.Vector(value["centre"]) for vertex in made.verts]
        made.verts.index_update()
        faces = [[vertex.index for vertex in face.verts] for face in made.faces]
        made.free()
        self.add_mesh(where, points, faces, material, matrix, smooth=data["kind"] in ("specular", "conductor") or data.get("translucent", False))

    # -- One image

    def set_camera(self, width, height):
        data = self.data["camera"]
        only(data, ("position", "target", "up", "vertical_field_degrees", "lens_radius", "focus_distance"), "the camera")
        if data["vertical_field_degrees"] < 0.5:
            raise Refusal("the camera's field is below what Blender's single precision resolves")
        for old in [thing for thing in bpy.data.objects if thing.type == "CAMERA"]:
            bpy.data.objects.remove(old)
        camera = bpy.data.cameras.new("camera")
        camera.sensor_fit = "VERTICAL"
        camera.angle = math.radians(data["vertical_field_degrees"])
        camera.clip_start, camera.clip_end = 1e-3, 1e6
        if data.get("lens_radius", 0) > 0:
            camera.dof.use_dof, camera.dof.focus_distance = True, data["focus_distance"]
            camera.dof.aperture_fstop = camera.lens * 1e-3 / (2 * data["lens_radius"])
        position, target = mathutils.Vector(data["position"]), mathutils.Vector(data["target"])
        back = (position - target).normalized()
        right = mathutils.Vector(data.get("up", [0, 1, 0])).cross(back).normalized()
        matrix = mathutils.Matrix((right, back.cross(right), back)).transposed().to_4x4()
        matrix.translation = position
        self.scene.camera = self.place(camera, "camera", matrix)
        self.scene.render.resolution_x, self.scene.render.resolution_y = width, height
        self.scene.render.resolution_percentage = 100

    def render(self, request):
        settings = self.data.get("render", {})
        only(settings, ("integrator", "bounces", "roulette_start"), "render")
        if settings.get("integrator") == "whitted":
            raise Refusal("the integrator whitted: Cycles follows whole paths")
        if request["bounces"] < 1:
            raise Refusal("0 bounces: Cycles always has one")
        self.set_camera(request["width"], request["height"])
        scene, cycles, render = self.scene, self.scene.cycles, self.scene.render
        render.engine = "CYCLES"
        cycles.device, cycles.samples, cycles.seed = "CPU", request["samples"], request["seed"]
        cycles.use_denoising = False
        # scripts/measure/equal_error asks for Cycles' own ways of saving time; a verdict is on equal samples.
        cycles.use_adaptive_sampling = "noise_threshold" in request
        if cycles.use_adaptive_sampling:
            cycles.adaptive_threshold, cycles.adaptive_min_samples = request["noise_threshold"], 0
        cycles.sampling_pattern = request.get("sampling_pattern", "PROGRESSIVE_MULTI_JITTER")
        # Cycles counts the scattering events after the first. No roulette, no clamping, no blur, every caustic.
        bounces = request["bounces"] - 1
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = bounces
        cycles.min_light_bounces = 0 if request.get("roulette") else bounces
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = cycles.blur_glossy = 0.0
        cycles.caustics_reflective = cycles.caustics_refractive = True
        cycles.pixel_filter_type = "BOX"  # of one pixel, whatever the filter's width
        cycles.use_auto_tile = False
        render.threads_mode, render.threads = "FIXED", request["threads"]
        render.use_persistent_data = True
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        render.image_settings.color_mode = "RGB"
        render.filepath = request["out"]
        begin = time.monotonic()
        bpy.ops.render.render(write_still=True)
        return time.monotonic() - begin


def say(**answer):
    print(json.dumps(answer), file=answers, flush=True)


def scene_of(path):
    if EXPORTED:
        return Scene(os.path.dirname(os.path.abspath(__file__)), EXPORTED)
    with open(path) as file:
        return Scene(os.path.dirname(path), json.load(file))


def main():
    if EXPORTED and "--" in sys.argv:  # blender ... --python SCRIPT -- IMAGE.exr SAMPLES
        image, samples = sys.argv[sys.argv.index("--") + 1:]
        film, bounces = EXPORTED["film"], EXPORTED["render"]["bounces"]
        scene_of(None).render({**film, "bounces": bounces, "samples": int(samples), "seed": 0, "threads": os.cpu_count(), "out": image})
        return
    say(tandem=1, name="Cycles", version="Blender " + bpy.app.version_string)
    path, scene = None, None
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if request["scene"] != path:
                path, scene = None, scene_of(request["scene"])
                path = request["scene"]
            say(done=True, seconds=scene.render(request))
        except Refusal as refusal:
            say(error=f"refuses {refusal}")


main()
