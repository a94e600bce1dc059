# Shader nodes for scripts/adapters/cycles.py: arithmetic on them, and the lobes of common/MODEL.md that Cycles 3.4 lacks. Such a
# lobe is sampled by nodes. White noise of the hit point gives the random numbers. A smooth reflection or refraction about a
# computed normal sends the path in the direction that the nodes chose. So Cycles' light sampling does not reach these lobes: more
# noise, the same mean.
import math

import bpy

STRONG = 50.0  # the index of made-up refractions: dense, or thin by its inverse, so that Cycles bends no normal


class Number:
    """A node's value, with arithmetic."""

    def __init__(self, shader, socket):
        self.shader, self.socket = shader, socket

    def math(self, operation, other=None):
        node = self.shader.nodes.new("ShaderNodeMath")
        node.operation = operation
        for place, value in enumerate([self, other][:1 if other is None else 2]):
            if isinstance(value, Number):
                self.shader.links.new(value.socket, node.inputs[place])
            else:
                node.inputs[place].default_value = value
        return Number(self.shader, node.outputs[0])

    def __add__(self, other): return self.math("ADD", other)
    def __sub__(self, other): return self.math("SUBTRACT", other)
    def __mul__(self, other): return self.math("MULTIPLY", other)
    def __truediv__(self, other): return self.math("DIVIDE", other)
    __radd__, __rmul__ = __add__, __mul__

    def sqrt(self): return self.math("MAXIMUM", 0.0).math("SQRT")
    def exceeds(self, other): return self.math("GREATER_THAN", other)


class Vector:
    """A node's vector, or its colour."""

    def __init__(self, shader, socket):
        self.shader, self.socket = shader, socket

    def math(self, operation, other=None, output="Vector"):
        node = self.shader.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        self.shader.links.new(self.socket, node.inputs[0])
        if other is not None:
            place = node.inputs["Scale"] if operation == "SCALE" else node.inputs[1]
            if isinstance(other, (Number, Vector)):
                self.shader.links.new(other.socket, place)
            else:
                place.default_value = other
        return (Number if output == "Value" else Vector)(self.shader, node.outputs[output])

    def __add__(self, other): return self.math("ADD", other)
    def __sub__(self, other): return self.math("SUBTRACT", other)
    def __mul__(self, scale): return self.math("SCALE", scale)
    def dot(self, other): return self.math("DOT_PRODUCT", other, "Value")
    def unit(self): return self.math("NORMALIZE")


class Shader:
    """Builds the nodes of one tree."""

    def __init__(self, tree):
        self.nodes, self.links = tree.nodes, tree.links
        self.nodes.clear()

    def node(self, kind, **values):
        made = self.nodes.new("ShaderNode" + kind)
        for name, value in values.items():
            socket = made.inputs[name]
            if isinstance(value, (bpy.types.NodeSocket, Number, Vector)):
                self.links.new(getattr(value, "socket", value), socket)
            else:
                socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
        return made

    def number(self, socket):
        return Number(self, socket)

    def vector(self, socket):
        return Vector(self, socket)

    def constant(self, values):
        node = self.nodes.new("ShaderNodeCombineXYZ")
        for place, value in zip(node.inputs, values):
            place.default_value = value
        return Vector(self, node.outputs[0])

    def combine(self, x, y, z, kind="CombineXYZ", names="XYZ"):
        made = self.nodes.new("ShaderNode" + kind)
        for value, name in zip((x, y, z), names):
            if isinstance(value, Number):
                self.links.new(value.socket, made.inputs[name])
            else:
                made.inputs[name].default_value = value
        return made.outputs[0]

    def mix(self, amount, a, b):
        made = self.node("MixShader", Fac=amount)
        self.links.new(a, made.inputs[1])
        self.links.new(b, made.inputs[2])
        return made.outputs[0]

    def add(self, a, b):
        made = self.nodes.new("ShaderNodeAddShader")
        self.links.new(a, made.inputs[0])
        self.links.new(b, made.inputs[1])
        return made.outputs[0]

    def mirror(self, colour):
        made = self.node("BsdfGlossy", Color=colour, Roughness=0.0)
        made.distribution = "SHARP"
        return made.outputs[0]

    def glass(self, colour, index):
        made = self.node("BsdfGlass", Color=colour, Roughness=0.0, IOR=index)
        made.distribution = "SHARP"
        return made.outputs[0]

    def emission(self, radiance, sides):
        strength = max(radiance) or 1.0  # colours of nodes end at 1
        lit = self.node("Emission", Color=[value / strength for value in radiance], Strength=strength).outputs[0]
        if sides == "both":
            return lit
        # An emitting mesh shines on both sides of itself in Cycles.
        return self.mix(self.number(self.node("NewGeometry").outputs["Backfacing"]), lit, self.node("Emission", Strength=0.0).outputs[0])


def fresnel_of_metal(c, eta, k):
    """MODEL.md 7.6, one channel, as nodes: Cycles 3.4 has no complex index."""
    s2 = (c * c) * -1.0 + 1.0
    t = s2 * -1.0 + (eta * eta - k * k)
    root = (t * t + 4 * eta * eta * k * k).sqrt()
    a, b2 = ((root + t) * 0.5).sqrt(), (root - t) * 0.5
    rs = ((a - c) * (a - c) + b2) / ((a + c) * (a + c) + b2)
    u, v = a * c - s2, a * c + s2
    rp = rs * (u * u + b2 * c * c) / (v * v + b2 * c * c)
    return (rs + rp) * 0.5


def dielectric_reflectance(shader, model, c, eta, index):
    """MODEL.md 7.4 at cosine c, and the refracted cosine. Both are right under total reflection too, where that cosine is 0."""
    inner = (c * c * -1.0 + 1.0) * eta * eta * -1.0 + 1.0
    inner = inner.sqrt()
    if model == "schlick":
        outside = Number(shader, shader.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"])
        inside = outside if index >= 1 else outside * -1.0 + 1.0  # whether the ray is on the dense side
        x = c + inside * (inner - c)
        r0 = ((1 - index) / (1 + index)) ** 2
        return (x * -1.0 + 1.0).math("MAXIMUM", 0.0).math("POWER", 5.0) * (1 - r0) + r0, inner
    rs = (eta * c - inner) / (eta * c + inner)
    rp = (c - eta * inner) / (c + eta * inner)
    return (rs * rs + rp * rp) * 0.5, inner


class Lobes:
    """Lobes about one hit. `eye` is −d, `normal` n_f, `back` 1 where the ray comes from inside."""

    def __init__(self, shader):
        self.shader = shader
        geometry = shader.node("NewGeometry")
        self.position = geometry.outputs["Position"]
        self.normal, self.eye = (shader.vector(geometry.outputs[name]) for name in ("Normal", "Incoming"))
        self.back = shader.number(geometry.outputs["Backfacing"])
        self.cosine = self.eye.dot(self.normal).math("ABSOLUTE")

    def random(self, number):
        """Uniform in [0, 1], by a hash of the bits of the hit point: no two paths have the same."""
        node = self.shader.node("TexWhiteNoise", Vector=self.position, W=float(number))
        node.noise_dimensions = "4D"
        return self.shader.number(node.outputs["Value"])

    def on_sphere(self):
        z, angle = self.random(1) * 2.0 - 1.0, self.random(2) * (2 * math.pi)
        r = (z * z * -1.0 + 1.0).sqrt()
        return self.shader.vector(self.shader.combine(r * angle.math("COSINE"), r * angle.math("SINE"), z))

    def visible_normal(self, alpha):
        """MODEL.md 7.6. A direction on the sphere, laid on the surface, has the azimuth."""
        n, i = self.normal, self.eye
        around = self.on_sphere()
        around = (around - n * around.dot(n)).unit()
        v = ((i - n * self.cosine) * alpha + n * self.cosine).unit()
        vz = v.dot(n)
        z = (self.random(3) * -1.0 + 1.0) * (vz + 1.0) - vz
        s = around * (z * z * -1.0 + 1.0).sqrt() + n * z + v
        sz = s.dot(n)
        return ((s - n * sz) * alpha + n * sz).unit()

    def smith(self, alpha, cosine):
        squared = cosine * cosine
        return (((squared * -1.0 + 1.0) / squared * (alpha * alpha) + 1.0).sqrt() - 1.0) * 0.5

    def shadowing(self, alpha, w):
        """G₂/G₁."""
        own = self.smith(alpha, self.cosine) + 1.0
        return own / (own + self.smith(alpha, w.dot(self.normal)))

    def mirrored(self, h):
        return h * (self.eye.dot(h) * 2.0) - self.eye

    def reflect(self, w, colour):
        """All that is sent to w, where that is above the surface."""
        colour = colour * w.dot(self.normal).exceeds(0.0)
        node = self.shader.node("BsdfGlossy", Color=colour, Roughness=0.0, Normal=(self.eye + w).unit())
        node.distribution = "SHARP"
        return node.outputs[0]

    def refract(self, w, colour):
        """All that is sent to w, where that is below the surface."""
        below = w.dot(self.normal) * -1.0
        # Cycles turns normals whose mirrored ray would lie below the surface. A thin or dense enough body's does not.
        dense = below.exceeds(self.cosine)
        normal = self.eye * (dense * -(STRONG + 1) + STRONG) + w * (dense * -(STRONG + 1) + 1.0)
        power = (dense * 2.0 - 1.0) * (self.back * -2.0 + 1.0)  # Cycles inverts the index inside
        index = self.shader.number(self.shader.node("Value").outputs[0])
        index.socket.default_value = STRONG
        node = self.shader.node("BsdfRefraction", Color=colour * below.exceeds(0.0), Roughness=0.0, Normal=normal.unit(),
                                IOR=index.math("POWER", power))
        node.distribution = "SHARP"
        return node.outputs[0]

    def mirror(self, colour, fuzz):
        """MODEL.md 7.3. `colour` is a Vector."""
        return self.reflect((self.mirrored(self.normal) + self.on_sphere() * fuzz).unit(), colour)

    def conductor(self, etas, ks, alpha):
        h = self.visible_normal(alpha)
        o, c = self.mirrored(h), self.eye.dot(h)
        colour = self.shader.combine(*[fresnel_of_metal(c, eta, k) for eta, k in zip(etas, ks)])
        return self.reflect(o, self.shader.vector(colour) * self.shadowing(alpha, o))

    def glass(self, colour, index, model, fuzz, alpha):
        """MODEL.md 7.4 and 7.7. `colour` is a Vector."""
        h = self.visible_normal(alpha) if alpha > 0 else self.normal
        c = self.eye.dot(h)
        eta = self.back * (index - 1 / index) + 1 / index
        reflectance, inner = dielectric_reflectance(self.shader, model, c, eta, index)
        up, down = self.mirrored(h), h * (eta * c - inner) - self.eye * eta
        if fuzz > 0:
            up, down = (way + self.on_sphere() * fuzz for way in (up, down))
        up, down = up.unit(), down.unit()
        above, below = (colour * self.shadowing(alpha, way) if alpha > 0 else colour for way in (up, down))
        return self.shader.mix(reflectance, self.refract(down, below), self.reflect(up, above))
