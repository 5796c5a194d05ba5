#!/usr/bin/env python3
"""Blender's Cycles as a peer of etendue bench: pip install "bpy==4.5.*" numpy, on Python 3.11.

On the CPU, without denoiser, clamps, adaptive sampling or light threshold; caustics unblurred. Cycles prepares a scene
for every picture; what that takes is measured when the scene is loaded and subtracted from the seconds.
"""
import os
import tempfile
import time

import bpy
import numpy as np

import gltf_scene
from gltf_scene import Cannot
from protocol import serve

SAMPLERS = {"sobol": "TABULATED_SOBOL", "blue-noise": "BLUE_NOISE"}
UNLIMITED = 1024
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
    if np.any(material["color"] != 1):
        raise Cannot(f"material {material['name']}: a texture times a colour")
    sampler = reader.sampler(material["texture"])
    wrap = {WRAPS[sampler.get(key, 10497)] for key in ("wrapS", "wrapT")}
    if len(wrap) > 1:
        raise Cannot(f"material {material['name']}: two kinds of wrapping")
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
    image = bpy.data.images.new("texture", *stored.size, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    texture = node(tree, "ShaderNodeTexImage")
    texture.image, texture.extension = image, wrap.pop()
    texture.interpolation = "Closest" if sampler.get("magFilter") == 9728 else "Linear"
    return texture.outputs["Color"]


def surface(tree, reader, material):
    name = material["name"]
    if material["transmission"] == 0:
        if material["volume"]:
            raise Cannot(f"material {name}: an opaque solid")
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
        raise Cannot(f"material {name}: a sheet")
    if material["ior"] == 1:
        raise Cannot(f"material {name}: a boundary without an index")
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
    last = surface(tree, reader, material).outputs[0]
    if material["emission"].max() > 0:
        back = node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        front = node(tree, "ShaderNodeMath", )
        front.operation = "SUBTRACT"
        front.inputs[0].default_value = 1.0
        tree.links.new(back, front.inputs[1])
        most = float(material["emission"].max())
        light = node(tree, "ShaderNodeEmission", Color=rgba(material["emission"] / most))
        scale = node(tree, "ShaderNodeMath")
        scale.operation = "MULTIPLY"
        scale.inputs[0].default_value = most
        tree.links.new(front.outputs[0], scale.inputs[1])
        tree.links.new(scale.outputs[0], light.inputs["Strength"])
        both = node(tree, "ShaderNodeAddShader")
        tree.links.new(last, both.inputs[0])
        tree.links.new(light.outputs[0], both.inputs[1])
        last = both.outputs[0]
        made.cycles.emission_sampling = "FRONT"
    tree.links.new(last, output.inputs["Surface"])
    if material["transmission"]:
        absorption, scattering, _, _ = gltf_scene.coefficients(material["medium"], material["volume"])
        if scattering.max() > 0:
            raise Cannot(f"material {material['name']}: a medium that scatters")
        if absorption.max() > 0:
            most = float(absorption.max())
            volume = node(tree, "ShaderNodeVolumeAbsorption", Color=rgba(1 - absorption / most), Density=most)
            tree.links.new(volume.outputs[0], output.inputs["Volume"])
    return made


def add(reader, mesh, index):
    data = bpy.data.meshes.new(f"mesh{index}")
    data.from_pydata(mesh.positions.tolist(), [], mesh.faces.tolist())
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


def world(environment):
    made = bpy.data.worlds.new("world")
    made.use_nodes = True
    radiance = (environment or {}).get("radiance", [0, 0, 0])
    if "uri" in (environment or {}):
        raise Cannot("an environment map")
    most = max(max(radiance), 1e-30)
    back = made.node_tree.nodes["Background"]
    back.inputs["Color"].default_value = rgba(np.array(radiance) / most)
    back.inputs["Strength"].default_value = float(most) if max(radiance) > 0 else 0.0
    return made


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
        if read.lights:
            raise Cannot("point, spot and directional lights")
        if read.medium:
            raise Cannot("a medium without bounds")
        for index, mesh in enumerate(read.meshes):
            add(read.textures, mesh, index)
        bpy.context.scene.world = world(read.environment)
        bpy.context.scene.camera = camera(read)
        self.overhead = 0.0
        few, many = (min(self.render("sobol", spp, 0)[2] for _ in range(3)) for spp in (1, 17))
        self.overhead = max(few - (many - few) / 16, 0.0)
        return f"Cycles {bpy.app.version_string.split()[0]}", list(SAMPLERS)

    def render(self, sampler, spp, seed):
        scene = bpy.context.scene
        scene.cycles.samples = spp
        scene.cycles.seed = seed
        scene.cycles.sampling_pattern = SAMPLERS[sampler]
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
serve(cycles.load, cycles.render)
