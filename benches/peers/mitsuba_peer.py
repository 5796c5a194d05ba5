#!/usr/bin/env python3
"""Mitsuba 3 as a peer of etendue bench: pip install mitsuba numpy.

DRJIT_LIBLLVM_PATH names libLLVM.so where Dr.Jit does not find it; MITSUBA_VARIANT chooses another variant
(default: llvm_ad_rgb; cuda_ad_rgb on a GPU). Kernels are compiled anew in each process: the cache on the disk
goes into a folder that is thrown away, so that `compile` in the bench file includes everything.
"""
import os
import tempfile
import time

HOME = tempfile.TemporaryDirectory()
os.environ["HOME"] = HOME.name

import drjit as dr
import mitsuba as mi
import numpy as np

import gltf_scene
from gltf_scene import Cannot
from protocol import serve

VARIANT = os.environ.get("MITSUBA_VARIANT", "llvm_ad_rgb")
# (ldsampler is left out: it repeats itself along long paths, so that means are wrong by percents and paths in fog do not end)
SAMPLERS = os.environ.get("MITSUBA_SAMPLERS", "independent,orthogonal,multijitter").split(",")

mi.set_variant(VARIANT)

from mitsuba_models import MIN_ALPHA  # defines classes of the variant


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


def texture_of(reader, index, factors, is_color):
    """A texture times its factors, decoded to linear before it is filtered."""
    wraps = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
    is_linear, wrap = reader.sampler(index)
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(reader.image(index))
        file.flush()
        stored = mi.Bitmap(file.name)
    stored.set_srgb_gamma(is_color)
    texels = np.array(stored.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    return {"type": "bitmap", "bitmap": mi.Bitmap((texels * factors).astype(np.float32)), "raw": True,
            "wrap_mode": wraps[wrap], "filter_type": "bilinear" if is_linear else "nearest"}


def base_color(reader, material):
    if material["texture"] is None:
        return rgb(material["color"])
    return texture_of(reader, material["texture"], material["color"], True)


def gltf_surface(reader, material):
    """Metallic factor in x, roughness in y."""
    if material["surface"] is None:
        surface = {"type": "rgb", "value": [float(material["metallic"]), float(material["roughness"]), 0.0]}
    else:
        surface = texture_of(reader, material["surface"], [1, material["roughness"], material["metallic"]], False)
        texels = np.array(surface["bitmap"])
        surface["bitmap"] = mi.Bitmap(np.ascontiguousarray(texels[..., [2, 1, 0]]))
        if texels[..., 1].min() ** 2 < MIN_ALPHA:
            raise Cannot(f"material {material['name']}: mirrors and rough places in one texture")
    return {"type": "gltf", "base": base_color(reader, material), "surface": surface,
            "smooth": material["surface"] is None and material["alpha"] < MIN_ALPHA,
            "coat": mi.ScalarColor3f(material["coat"]), "coat_f90": float(material["specular"])}


def medium_of(absorption, scattering, phase, g):
    extinction = absorption + scattering
    phases = {"isotropic": {"type": "isotropic"}, "rayleigh": {"type": "rayleigh"},
              "henyey-greenstein": {"type": "hg", "g": float(g)}}
    albedo = np.divide(scattering, extinction, out=np.zeros(3), where=extinction > 0)
    most = extinction.max()  # colours are held to 1
    return {"type": "homogeneous", "sigma_t": rgb(extinction / most), "scale": float(most), "albedo": rgb(albedo),
            "phase": phases[phase]}


def bsdf_of(reader, material):
    """The surface, and the medium behind it if it bounds one."""
    name = material["name"]
    if material["transmission"] == 0:
        if material["volume"]:
            raise Cannot(f"material {name}: an opaque solid")
        if material["metallic"] == 0 and material["specular"] == 0:
            diffuse = {"type": "diffuse", "reflectance": base_color(reader, material)}
            return {"type": "twosided", "bsdf": diffuse}, None
        return gltf_surface(reader, material), None
    if material["transmission"] != 1 or material["metallic"] != 0 or np.any(material["color"] != 1):
        raise Cannot(f"material {name}: glass that is also something else")
    if material["specular"] != 1 or material["medium"].get("priority", 0):
        raise Cannot(f"material {name}: priorities or weakened reflection")
    rough = material["alpha"] >= MIN_ALPHA
    if not (material["volume"] or {}).get("thicknessFactor", 0) > 0:
        if rough:
            return {"type": "sheet", "ior": float(material["ior"]), "alpha": float(material["alpha"])}, None
        return {"type": "thindielectric", "int_ior": float(material["ior"]), "ext_ior": 1.0}, None
    absorption, scattering, phase, g = gltf_scene.coefficients(material["medium"], material["volume"])
    medium = None
    if (absorption + scattering).max() > 0:
        medium = medium_of(absorption, scattering, phase, g)
    if material["ior"] == 1:
        return {"type": "null"}, medium
    bsdf = {"type": "roughdielectric" if rough else "dielectric", "int_ior": float(material["ior"]), "ext_ior": 1.0}
    if rough:
        bsdf |= {"distribution": "ggx", "alpha": float(material["alpha"])}
    return bsdf, medium


def light_of(light, world):
    color = np.array(light.get("color", [1, 1, 1])) * light.get("intensity", 1)
    if light["type"] == "point":
        return {"type": "point", "position": [float(v) for v in world[:3, 3]], "intensity": rgb(color)}
    if light["type"] == "directional":
        return {"type": "directional", "direction": [float(-v) for v in world[:3, 2]], "irradiance": rgb(color)}
    cone = light["spot"]
    inner, outer = cone.get("innerConeAngle", 0), cone.get("outerConeAngle", np.pi / 4)
    direction = -world[:3, 2] / np.linalg.norm(world[:3, 2])
    return {"type": "gltfspot", "position": mi.ScalarPoint3f(world[:3, 3]), "axis": mi.ScalarVector3f(direction),
            "color": mi.ScalarColor3f(color), "inner": float(np.cos(inner)), "outer": float(np.cos(outer))}


def environment_of(scene):
    environment = scene.environment
    if "radiance" in environment:
        return {"type": "constant", "radiance": rgb(environment["radiance"])}
    turn = mi.ScalarTransform4f().rotate([0, 1, 0], 180 + float(np.degrees(environment.get("rotation", 0))))
    file = os.path.join(os.path.dirname(scene.path), environment["uri"])
    bitmap = mi.Bitmap(file).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return {"type": "envmap", "bitmap": rows_at_edges(bitmap), "scale": float(environment.get("intensity", 1)),
            "to_world": turn}


def rows_at_edges(bitmap):
    """Mitsuba's first and last rows stand at the poles, etendue's half a row beside them. Twice as many rows, each
    second one between its neighbours, stand for the same piecewise linear function."""
    ours = np.array(bitmap)
    rows = np.empty((2 * len(ours) + 1,) + ours.shape[1:], np.float32)
    rows[1::2] = ours
    rows[2:-1:2] = 0.5 * (ours[1:] + ours[:-1])
    rows[0], rows[-1] = ours[0], ours[-1]
    return mi.Bitmap(rows)


def mesh_of(mesh, bsdf, medium):
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    if medium:
        properties["interior"] = medium
    if mesh.material["emission"].max() > 0:
        properties["light"] = mi.load_dict({"type": "area", "radiance": rgb(mesh.material["emission"])})
    shape = mi.Mesh("mesh", len(mesh.positions), len(mesh.faces), props=properties,
                    has_vertex_normals=mesh.normals is not None, has_vertex_texcoords=mesh.uvs is not None)
    parameters = mi.traverse(shape)
    parameters["vertex_positions"] = mesh.positions.astype(np.float32).ravel()
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    if mesh.normals is not None:
        parameters["vertex_normals"] = mesh.normals.astype(np.float32).ravel()
    if mesh.uvs is not None:
        parameters["vertex_texcoords"] = mesh.uvs.astype(np.float32).ravel()
    parameters.update()
    return shape


def convert(path, width, height, max_depth):
    """The scene and the sensor as dictionaries, without sampler and integrator, and whether there are media."""
    scene = gltf_scene.load(path)
    parts, around, media = {}, [], False
    for index, mesh in enumerate(scene.meshes):
        bsdf, medium = bsdf_of(scene.textures, mesh.material)
        if medium:
            medium = mi.load_dict(medium)
            media = True
            if gltf_scene.contains(mesh, scene.camera[:3, 3]):
                around.append(medium)
        parts[f"mesh{index}"] = mesh_of(mesh, bsdf, medium)
    if scene.medium:
        if any(mesh.material["transmission"] for mesh in scene.meshes):
            raise Cannot("solids in a medium without bounds")
        around.append(mi.load_dict(medium_of(*gltf_scene.coefficients(scene.medium))))
        media = True
    if len(around) > 1:
        raise Cannot("a camera in two media")
    for index, (light, world) in enumerate(scene.lights):
        parts[f"light{index}"] = light_of(light, world)
    if scene.environment:
        if scene.medium:
            raise Cannot("an environment behind a medium without bounds")
        parts["environment"] = environment_of(scene)
    columns = scene.camera[:3, :3] / np.linalg.norm(scene.camera[:3, :3], axis=0)
    pose = np.eye(4)
    # Mitsuba's cameras look along +z with +x to the left
    pose[:3, :3] = columns * [-1, 1, -1]
    pose[:3, 3] = scene.camera[:3, 3]
    sensor = {
        "type": "perspective", "fov": float(np.degrees(scene.yfov)), "fov_axis": "y",
        "near_clip": 1e-4, "far_clip": 1e6, "to_world": mi.ScalarTransform4f(pose),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
    }
    if around:
        sensor["medium"] = around[0]
    return {"type": "scene"} | parts, sensor, media


class Mitsuba:
    def load(self, scene, width, height, max_depth):
        parts, sensor, media = convert(scene, width, height, max_depth)
        self.scene = mi.load_dict(parts)
        depth = max_depth + 1 if max_depth else -1
        integrators = ["volpath", "volpathmis"] if media else ["path"]
        self.integrators = {name: mi.load_dict({"type": name, "max_depth": depth}) for name in integrators}
        self.sensors = {name: mi.load_dict(sensor | {"sampler": {"type": name}}) for name in SAMPLERS}
        # the second integrator with one sampler
        ways = [(integrators[0], sampler) for sampler in SAMPLERS] + [(name, SAMPLERS[-1]) for name in integrators[1:]]
        self.ways = {" ".join(way if way[0] == "volpathmis" else way[1:]): way for way in ways}
        return list(self.ways)

    def render(self, way, spp, seed):
        integrator, sampler = self.ways[way]
        sensor = self.sensors[sampler]
        start = time.perf_counter()
        picture = mi.render(self.scene, sensor=sensor, integrator=self.integrators[integrator], spp=spp, seed=seed)
        dr.eval(picture)
        dr.sync_thread()
        seconds = time.perf_counter() - start
        # samplers round what they cannot stratify
        return np.array(picture)[..., :3], sensor.sampler().sample_count(), seconds


mitsuba = Mitsuba()
serve(f"Mitsuba {mi.__version__} {VARIANT}", mitsuba.load, mitsuba.render)
