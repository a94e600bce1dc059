# Renders scenes/cornell-classic.json's box with Blender's Cycles, to hold Tandem against a renderer that it shares nothing
# with. Debian: apt-get install blender. Run it for seeds 1 and 2, then compare.
#   blender --background --factory-startup --python scripts/adapters/cycles_cornell_classic.py -- \
#       --size 600 --samples 1024 --seed 1 --bounces 12 --output cycles-1.exr
#   tandem compare cycles-1.exr cycles-2.exr vs tandem.exr
# Written from the numbers, not from the scene file, so that a fault in the file shows too.
import argparse
import math
import sys

import bpy
import mathutils


def parse_arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--size", type=int, default=600)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bounces", type=int, default=12, help="scattering events, as Tandem counts them")
    parser.add_argument("--output", required=True)
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


def material(name, build):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    links.new(build(nodes, links).outputs[0], output.inputs["Surface"])
    return made


def diffuse(name, colour):
    def build(nodes, links):
        shader = nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*colour, 1.0)
        shader.inputs["Roughness"].default_value = 0.0
        return shader
    return material(name, build)


def emitter(name, radiance):
    def build(nodes, links):
        shader = nodes.new("ShaderNodeEmission")
        shader.inputs["Strength"].default_value = radiance
        return shader
    made = material(name, build)
    made.cycles.sample_as_light = False
    return made


def add_lamp(corner, size, radiance):
    """A rectangle in a horizontal plane that emits downwards only, and a black sheet a hair above it that blocks rays.

    An area light rather than an emitting mesh. At grazing angles Cycles 3.4 under-samples the triangles of a mesh: 1.3
    % too dark on the upper back wall against Lambert's formula, which Tandem meets."""
    light = bpy.data.lights.new("lamp", "AREA")
    light.shape, light.size, light.size_y = "RECTANGLE", *size
    light.energy = 4.0 * radiance * size[0] * size[1]  # Blender: radiance = energy / (4 area)
    placed = bpy.data.objects.new("lamp", light)
    x, y, z = corner
    placed.location = (x + size[0] / 2, y, z + size[1] / 2)
    placed.rotation_euler = (math.radians(-90.0), 0.0, 0.0)  # its -z turns to world -y
    bpy.context.scene.collection.objects.link(placed)
    x1, z1 = x + size[0], z + size[1]

    def sheet(name, height, shader):
        return add_mesh(name, [(x, height, z), (x1, height, z), (x1, height, z1), (x, height, z1)], [(0, 1, 2, 3)], shader)

    sheet("cap", y + 0.01, diffuse("black", (0.0, 0.0, 0.0)))
    face = sheet("face", y, emitter("face", radiance))  # the camera does not see area lights
    face.visible_diffuse = face.visible_glossy = face.visible_shadow = face.visible_transmission = False


def add_mesh(name, vertices, faces, shader, matrix=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(shader)
    placed = bpy.data.objects.new(name, mesh)
    if matrix is not None:
        placed.matrix_world = matrix
    bpy.context.scene.collection.objects.link(placed)
    return placed


def add_box(name, size, degrees, offset, shader):
    x, y, z = size
    vertices = [(a, b, c) for a in (0, x) for b in (0, y) for c in (0, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    matrix = mathutils.Matrix.Translation(offset) @ mathutils.Matrix.Rotation(math.radians(degrees), 4, "Y")
    add_mesh(name, vertices, faces, shader, matrix)


def build_scene():
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    white, red, green = diffuse("white", (0.73,) * 3), diffuse("red", (0.65, 0.05, 0.05)), diffuse("green", (0.12, 0.45, 0.15))
    s = 555
    quad = [(0, 1, 2, 3)]
    add_mesh("red", [(0, 0, 0), (0, s, 0), (0, s, s), (0, 0, s)], quad, red)
    add_mesh("green", [(s, 0, 0), (s, s, 0), (s, s, s), (s, 0, s)], quad, green)
    add_mesh("floor", [(0, 0, 0), (s, 0, 0), (s, 0, s), (0, 0, s)], quad, white)
    add_mesh("ceiling", [(0, s, 0), (s, s, 0), (s, s, s), (0, s, s)], quad, white)
    add_mesh("back", [(0, 0, s), (s, 0, s), (s, s, s), (0, s, s)], quad, white)
    add_lamp((213, 554, 227), (130, 105), 15.0)
    add_box("tall", (165, 330, 165), 15, (265, 0, 295), white)
    add_box("short", (165, 165, 165), -18, (130, 0, 65), white)


def set_camera(scene):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = math.radians(40.0)
    camera.clip_end = 1e5
    placed = bpy.data.objects.new("camera", camera)
    # Columns: right, up, backwards of a camera at (278, 278, -800) that looks along +z.
    placed.matrix_world = mathutils.Matrix(((-1, 0, 0, 278), (0, 1, 0, 278), (0, 0, -1, -800), (0, 0, 0, 1)))
    scene.collection.objects.link(placed)
    scene.camera = placed


def set_renderer(scene, arguments):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = arguments.samples
    cycles.seed = arguments.seed
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    # Cycles counts the bounces after the first scattering event.
    bounces = arguments.bounces - 1
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.min_light_bounces = bounces
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.pixel_filter_type = "BOX"
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    render = scene.render
    render.resolution_x = render.resolution_y = arguments.size
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.color_mode = "RGB"
    render.filepath = arguments.output


def main():
    arguments = parse_arguments()
    scene = bpy.context.scene
    build_scene()
    set_camera(scene)
    set_renderer(scene, arguments)
    bpy.ops.render.render(write_still=True)


main()
