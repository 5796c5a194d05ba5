#!/usr/bin/env python3
"""Blender's Cycles as a peer of etendue bench: pip install "bpy==4.5.*" numpy, on Python 3.11.

On the CPU, without denoiser, clamps, adaptive sampling or light threshold; caustics unblurred. Cycles prepares a scene
for every picture; what that takes is measured when the scene is loaded and subtracted from the seconds. Where it takes
longer than the samples, as with many triangles and a small picture, what is left is noise.
"""
import os
import tempfile
import time

import bpy
import numpy as np

import gltf_scene
from gltf_scene import Cannot
from protocol import serve

PATTERNS = {"sobol": "TABULATED_SOBOL", "blue-noise": "BLUE_NOISE"}
SAMPLERS = os.environ.get("CYCLES_SAMPLERS", ",".join(PATTERNS)).split(",")
UNLIMITED = 1024
# Blender's watts of a point light that shines with one candela all around
POINT_POWER = 4 * np.pi
# Below, a microfacet surface counts as a mirror: etendue's GGX_MIN_ALPHA
MIN_ALPHA = 1e-3
WRAPS = {10497: "REPEAT", 33648: "MIRROR", 33071: "EXTEND"}
FOLDER = tempfile.TemporaryDirectory()
FILE = os.path.join(FOLDER.name, "picture.exr")


def rgba(values):
    return [float(v) for v in values] + [1.0]


def node(tree, kind, **inputs):
    """A node whose inputs are values or outputs of others."""
    made = tree.nodes.new(kind)
    for name, value in inputs.items():
        socket = made.inputs[name.replace("_", " ")]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made


def base_color(tree, reader, material):
    if material["texture"] is None:
        return rgba(material["color"])
    is_linear, wrap = reader.sampler(material["texture"])
    path = os.path.join(FOLDER.name, "texture.png")
    with open(path, "wb") as file:
        file.write(reader.image(material["texture"]))
    stored = bpy.data.images.load(path)
    values = np.empty(len(stored.pixels), np.float32)
    stored.pixels.foreach_get(values)
    # Cycles would filter the encoded bytes; etendue filters light
    pixels = values.reshape(-1, 4)
    low = pixels[:, :3] / 12.92
    pixels[:, :3] = np.where(pixels[:, :3] <= 0.04045, low, ((pixels[:, :3] + 0.055) / 1.055) ** 2.4)
    pixels[:, :3] *= material["color"]
    image = bpy.data.images.new("texture", *stored.size, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    texture = node(tree, "ShaderNodeTexImage")
    texture.image, texture.extension = image, WRAPS[wrap]
    texture.interpolation = "Linear" if is_linear else "Closest"
    return texture.outputs["Color"]


def math(tree, operation, a, b):
    made = tree.nodes.new("ShaderNodeMath")
    made.operation = operation
    for socket, value in zip(made.inputs, (a, b)):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made.outputs[0]


def sheet(tree, ior):
    """Smooth glass without thickness, with all reflections between its faces: R = 2r/(1 + r). [Born99] §7.6"""
    back = node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
    # Fresnel's node takes the inverse index at the back
    index = math(tree, "POWER", ior, math(tree, "SUBTRACT", 1.0, math(tree, "MULTIPLY", 2.0, back)))
    r = node(tree, "ShaderNodeFresnel", IOR=index).outputs[0]
    reflected = math(tree, "DIVIDE", math(tree, "MULTIPLY", 2.0, r), math(tree, "ADD", 1.0, r))
    mirror = node(tree, "ShaderNodeBsdfAnisotropic", Color=rgba([1, 1, 1]), Roughness=0.0)
    straight = node(tree, "ShaderNodeBsdfTransparent", Color=rgba([1, 1, 1]))
    mix = node(tree, "ShaderNodeMixShader", Fac=reflected)
    tree.links.new(straight.outputs[0], mix.inputs[1])
    tree.links.new(mirror.outputs[0], mix.inputs[2])
    return mix


def surface(tree, reader, material):
    name = material["name"]
    if material["transmission"] == 0:
        if material["volume"]:
            raise Cannot(f"material {name}: an opaque solid")
        if material["surface"] is not None:
            raise Cannot(f"material {name}: a metallic-roughness texture")
        if material["metallic"] == 0 and material["specular"] == 0:
            return node(tree, "ShaderNodeBsdfDiffuse", Color=base_color(tree, reader, material))
        if material["metallic"] != 1:
            raise Cannot(f"material {name}: a coat")
        metal = node(tree, "ShaderNodeBsdfMetallic", Base_Color=base_color(tree, reader, material),
                     Edge_Tint=rgba([1, 1, 1]), Roughness=float(material["alpha"]) ** 0.5)
        metal.distribution, metal.fresnel_type = "GGX", "F82"
        return metal
    if material["transmission"] != 1 or material["metallic"] != 0 or np.any(material["color"] != 1):
        raise Cannot(f"material {name}: glass that is also something else")
    if material["specular"] != 1 or material["medium"].get("priority", 0):
        raise Cannot(f"material {name}: priorities or weakened reflection")
    if not (material["volume"] or {}).get("thicknessFactor", 0) > 0:
        if material["alpha"] >= MIN_ALPHA:
            raise Cannot(f"material {name}: a rough sheet")
        return sheet(tree, float(material["ior"]))
    if material["ior"] == 1:
        return None
    glass = node(tree, "ShaderNodeBsdfGlass", Color=rgba([1, 1, 1]), Roughness=float(material["alpha"]) ** 0.5,
                 IOR=float(material["ior"]))
    glass.distribution = "GGX"
    return glass


def shader(reader, material):
    made = bpy.data.materials.new(material["name"])
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = node(tree, "ShaderNodeOutputMaterial")
    last = surface(tree, reader, material)
    if material["emission"].max() > 0:
        if not last:
            raise Cannot(f"material {material['name']}: a boundary that shines")
        back = node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        most = float(material["emission"].max())
        strength = math(tree, "MULTIPLY", math(tree, "SUBTRACT", 1.0, back), most)
        light = node(tree, "ShaderNodeEmission", Color=rgba(material["emission"] / most), Strength=strength)
        both = node(tree, "ShaderNodeAddShader")
        tree.links.new(last.outputs[0], both.inputs[0])
        tree.links.new(light.outputs[0], both.inputs[1])
        last = both
        made.cycles.emission_sampling = "FRONT"
    if last:
        tree.links.new(last.outputs[0], output.inputs["Surface"])
    if material["transmission"]:
        volume(tree, output, gltf_scene.coefficients(material["medium"], material["volume"]))
        made.cycles.homogeneous_volume = True
    return made


def volume(tree, output, coefficients):
    """Absorption and scattering of a medium."""
    absorption, scattering, phase, g = coefficients
    parts = []
    if absorption.max() > 0:
        most = float(absorption.max())
        parts.append(node(tree, "ShaderNodeVolumeAbsorption", Color=rgba(1 - absorption / most), Density=most))
    if scattering.max() > 0:
        most = float(scattering.max())
        scatter = node(tree, "ShaderNodeVolumeScatter", Color=rgba(scattering / most), Density=most)
        scatter.phase = "RAYLEIGH" if phase == "rayleigh" else "HENYEY_GREENSTEIN"
        if phase == "henyey-greenstein":
            scatter.inputs["Anisotropy"].default_value = float(g)
        elif phase == "isotropic":
            scatter.inputs["Anisotropy"].default_value = 0.0
        parts.append(scatter)
    if len(parts) == 2:
        both = node(tree, "ShaderNodeAddShader")
        for part, socket in zip(parts, both.inputs):
            tree.links.new(part.outputs[0], socket)
        parts = [both]
    for part in parts:
        tree.links.new(part.outputs[0], output.inputs["Volume"])


def add(reader, mesh, index):
    data = bpy.data.meshes.new(f"mesh{index}")
    # (from_pydata takes minutes for millions of triangles)
    data.vertices.add(len(mesh.positions))
    data.vertices.foreach_set("co", mesh.positions.astype(np.float32).ravel())
    data.loops.add(3 * len(mesh.faces))
    data.loops.foreach_set("vertex_index", mesh.faces.astype(np.int32).ravel())
    data.polygons.add(len(mesh.faces))
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * len(mesh.faces), 3, dtype=np.int32))
    data.update(calc_edges=True)
    if mesh.uvs is not None:
        layer = data.uv_layers.new()
        corners = mesh.uvs[mesh.faces.ravel()] * [1, -1] + [0, 1]
        layer.uv.foreach_set("vector", corners.astype(np.float32).ravel())
    smooth = mesh.normals is not None
    data.polygons.foreach_set("use_smooth", np.full(len(mesh.faces), smooth))
    if smooth:
        data.normals_split_custom_set_from_vertices(mesh.normals.tolist())
    data.materials.append(shader(reader, mesh.material))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(data.name, data))


def world(scene):
    made = bpy.data.worlds.new("world")
    made.use_nodes = True
    tree, environment = made.node_tree, scene.environment or {}
    back = tree.nodes["Background"]
    if "uri" in environment:
        tree.links.new(sky(tree, scene), back.inputs["Color"])
        back.inputs["Strength"].default_value = float(environment.get("intensity", 1))
    else:
        radiance = np.array(environment.get("radiance", [0, 0, 0]), float)
        most = max(float(radiance.max()), 1e-30)
        back.inputs["Color"].default_value = rgba(radiance / most)
        back.inputs["Strength"].default_value = most if radiance.max() > 0 else 0.0
    if scene.medium:
        if environment:
            raise Cannot("an environment behind a medium without bounds")
        output = tree.nodes["World Output"]
        tree.links.remove(output.inputs["Surface"].links[0])
        volume(tree, output, gltf_scene.coefficients(scene.medium))
        made.cycles.homogeneous_volume = True
    return made


def sky(tree, scene):
    """Blender's map has its middle at −X and Z upwards, in what we hand it as directions."""
    environment = scene.environment
    image = bpy.data.images.load(os.path.join(os.path.dirname(scene.path), environment["uri"]))
    image.colorspace_settings.name = "Linear Rec.709"
    toward = node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    turn = node(tree, "ShaderNodeVectorRotate", Vector=toward, Angle=-float(environment.get("rotation", 0)))
    turn.rotation_type = "Y_AXIS"
    apart = node(tree, "ShaderNodeSeparateXYZ", Vector=turn.outputs[0]).outputs
    there = node(tree, "ShaderNodeCombineXYZ", X=math(tree, "MULTIPLY", apart["Z"], -1.0),
                 Y=math(tree, "MULTIPLY", apart["X"], -1.0), Z=apart["Y"])
    texture = node(tree, "ShaderNodeTexEnvironment", Vector=there.outputs[0])
    texture.image, texture.projection, texture.interpolation = image, "EQUIRECTANGULAR", "Linear"
    return texture.outputs["Color"]


def lamp(light, matrix, index):
    color = np.array(light.get("color", [1, 1, 1]), float)
    most = float(color.max())
    kind = "SUN" if light["type"] == "directional" else "POINT"
    data = bpy.data.lights.new(f"light{index}", kind)
    data.color = color / most
    strength = most * light.get("intensity", 1)
    if kind == "SUN":
        data.angle, data.energy = 0.0, strength
    else:
        data.shadow_soft_size, data.energy = 0.0, POINT_POWER * strength
    if light["type"] == "spot":
        cone(data, light["spot"], -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]))
    made = bpy.data.objects.new(data.name, data)
    place = matrix.copy()
    place[:3, :3] /= np.linalg.norm(place[:3, :3], axis=0)
    made.matrix_world = place.T.tolist()  # by columns
    bpy.context.scene.collection.objects.link(made)


def cone(data, spot, axis):
    """KHR_lights_punctual's edge on a point light: the square of a linear ramp in the cosine between the cones."""
    inner, outer = (float(np.cos(spot.get(key, other)))
                    for key, other in (("innerConeAngle", 0), ("outerConeAngle", np.pi / 4)))
    data.use_nodes = True
    tree = data.node_tree
    away = node(tree, "ShaderNodeNewGeometry").outputs["Incoming"]
    product = tree.nodes.new("ShaderNodeVectorMath")
    product.operation = "DOT_PRODUCT"
    tree.links.new(away, product.inputs[0])
    product.inputs[1].default_value = [float(v) for v in axis]
    ramp = math(tree, "DIVIDE", math(tree, "SUBTRACT", product.outputs["Value"], outer), max(inner - outer, 1e-6))
    ramp = math(tree, "MINIMUM", math(tree, "MAXIMUM", ramp, 0.0), 1.0)
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(math(tree, "MULTIPLY", ramp, ramp), emission.inputs["Strength"])


def camera(scene):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle_y = scene.yfov
    data.clip_start, data.clip_end = 1e-4, 1e6
    made = bpy.data.objects.new("camera", data)
    matrix = scene.camera.copy()
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    made.matrix_world = matrix.T.tolist()  # by columns
    bpy.context.scene.collection.objects.link(made)
    return made


def settings(width, height, max_depth):
    scene, cycles = bpy.context.scene, bpy.context.scene.cycles
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "NONE"
    scene.view_settings.view_transform = "Raw"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.blur_glossy = 0
    cycles.pixel_filter_type = "BOX"
    cycles.caustics_reflective = cycles.caustics_refractive = True
    bounces = max_depth - 1 if max_depth else UNLIMITED
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.transmission_bounces = cycles.volume_bounces = bounces
    cycles.transparent_max_bounces = UNLIMITED


class Cycles:
    def load(self, scene, width, height, max_depth):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        settings(width, height, max_depth)
        read = gltf_scene.load(scene)
        if read.medium and any(mesh.material["transmission"] for mesh in read.meshes):
            raise Cannot("solids in a medium without bounds")
        for index, (light, matrix) in enumerate(read.lights):
            lamp(light, matrix, index)
        for index, mesh in enumerate(read.meshes):
            add(read.textures, mesh, index)
        bpy.context.scene.world = world(read)
        bpy.context.scene.camera = camera(read)
        self.overhead = 0.0
        few, many = (min(self.render(SAMPLERS[0], spp, 0)[2] for _ in range(3)) for spp in (1, 17))
        self.overhead = max(few - (many - few) / 16, 0.0)
        return SAMPLERS

    def render(self, sampler, spp, seed):
        scene = bpy.context.scene
        scene.cycles.samples = spp
        scene.cycles.seed = seed
        scene.cycles.sampling_pattern = PATTERNS[sampler]
        start = time.perf_counter()
        bpy.ops.render.render()
        seconds = time.perf_counter() - start
        bpy.data.images["Render Result"].save_render(FILE)
        stored = bpy.data.images.load(FILE)
        stored.colorspace_settings.name = "Non-Color"
        values = np.empty(len(stored.pixels), np.float32)
        stored.pixels.foreach_get(values)
        width, height = stored.size
        bpy.data.images.remove(stored)
        # from the bottom row up, with alpha
        picture = values.reshape(height, width, 4)[::-1, :, :3]
        return picture, spp, max(seconds - self.overhead, 0.05 * seconds)


cycles = Cycles()
serve(f"Cycles {bpy.app.version_string.split()[0]}", cycles.load, cycles.render)
