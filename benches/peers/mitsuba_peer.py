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
# (ldsampler repeats itself along long paths: its pictures of scenes/rayleigh.gltf are off by 7 %)
SAMPLERS = ["independent", "multijitter"]
# Below, a microfacet surface counts as a mirror: etendue's GGX_MIN_ALPHA
MIN_ALPHA = 1e-3

mi.set_variant(VARIANT)


class Gltf(mi.BSDF):
    """glTF's opaque surface as etendue has it (shaders/bsdf.glsl): Lambert under a coat, or metal; GGX with
    height-correlated masking, Schlick's Fresnel factor; both sides alike."""

    def __init__(self, props):
        super().__init__(props)
        self.base = props.get_texture("base")
        self.metallic, self.alpha = props["metallic"], props["alpha"]
        self.coat, self.coat_f90 = mi.Color3f(props["coat"]), props["coat_f90"]
        self.smooth = self.alpha < MIN_ALPHA
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        glossy = mi.BSDFFlags.DeltaReflection if self.smooth else mi.BSDFFlags.GlossyReflection
        self.m_components = [mi.BSDFFlags.DiffuseReflection | sides, glossy | sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def parts(self, si):
        """Albedo of the base, F0, F90."""
        color = mi.Color3f(self.base.eval(si))
        f0 = dr.lerp(self.coat, color, self.metallic)
        return color * (1 - self.metallic), f0, dr.lerp(self.coat_f90, 1.0, self.metallic)

    @staticmethod
    def schlick(f0, f90, cosine):
        return f0 + (f90 - f0) * dr.clip(1 - cosine, 0, 1) ** 5

    def through(self, cosine):
        """What the coat lets through to the base, one way."""
        return 1 - self.schlick(dr.max(self.coat), self.coat_f90, cosine)

    def diffuse(self, base, cos_o, cos_i):
        return base * (dr.inv_pi * self.through(cos_o) * self.through(cos_i) / dr.maximum(1 - dr.max(self.coat), 1e-6))

    def share(self, base, f0, f90, cos_o):
        """Probability of sampling the specular lobe."""
        specular = dr.sum(self.schlick(f0, f90, cos_o))
        total = specular + dr.sum(base * self.through(cos_o))
        return dr.select(total > 0, specular / total, 0)

    def microfacets(self):
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, self.alpha, True)

    def value_and_pdf(self, base, f0, f90, wo, wi):
        """f · cosθi and the density of both lobes, without a mirror's; wo and wi above the surface."""
        share = self.share(base, f0, f90, wo.z)
        value = self.diffuse(base, wo.z, wi.z)
        pdf = (1 - share) * dr.inv_pi * wi.z
        if not self.smooth:
            h = dr.normalize(wo + wi)
            d = self.microfacets().eval(h)
            a2 = self.alpha * self.alpha
            root = lambda c: dr.sqrt(a2 + (1 - a2) * c * c)
            visibility = 0.5 / (wi.z * root(wo.z) + wo.z * root(wi.z))
            value += self.schlick(f0, f90, dr.dot(wo, h)) * d * visibility
            pdf += share * d * 0.5 / (wo.z + root(wo.z))
        is_valid = (wo.z > 0) & (wi.z > 0)
        return (value * wi.z) & is_valid, dr.select(is_valid, pdf, 0)

    # Mitsuba's wi is the direction to the viewer, its wo the one that is sampled.
    def sample(self, ctx, si, sample1, sample2, active=True):
        base, f0, f90 = self.parts(si)
        side = dr.sign(si.wi.z)
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        share = self.share(base, f0, f90, view.z)
        is_specular = active & (sample1 < share)
        bs = dr.zeros(mi.BSDFSample3f)
        light = mi.warp.square_to_cosine_hemisphere(sample2)
        if self.smooth:
            bounced = mi.Vector3f(-view.x, -view.y, view.z)
        else:
            h, _ = self.microfacets().sample(view, sample2)
            bounced = mi.reflect(view, h)
        light = dr.select(is_specular, bounced, light)
        value, pdf = self.value_and_pdf(base, f0, f90, view, light)
        weight = dr.select(pdf > 0, value / pdf, 0)
        if self.smooth:
            weight = dr.select(is_specular, self.schlick(f0, f90, view.z) / share, weight)
            pdf = dr.select(is_specular, share, pdf)
        bs.wo = mi.Vector3f(light.x, light.y, light.z * side)
        bs.pdf = pdf
        bs.eta = 1.0
        bs.sampled_component = dr.select(is_specular, mi.UInt32(1), mi.UInt32(0))
        glossy = mi.BSDFFlags.DeltaReflection if self.smooth else mi.BSDFFlags.GlossyReflection
        bs.sampled_type = dr.select(is_specular, mi.UInt32(int(glossy)), mi.UInt32(int(mi.BSDFFlags.DiffuseReflection)))
        active &= (light.z > 0) & (view.z > 0) & (pdf > 0)
        return bs, weight & active

    def both(self, si, wo):
        base, f0, f90 = self.parts(si)
        side = dr.sign(si.wi.z)
        view = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        return self.value_and_pdf(base, f0, f90, view, mi.Vector3f(wo.x, wo.y, wo.z * side))

    def eval(self, ctx, si, wo, active=True):
        return self.both(si, wo)[0] & active

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.both(si, wo)[1], 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        value, pdf = self.both(si, wo)
        return value & active, dr.select(active, pdf, 0)

    def to_string(self):
        return "Gltf[]"


mi.register_bsdf("gltf", lambda props: Gltf(props))


def rgb(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


def base_color(reader, material):
    if material["texture"] is None:
        return rgb(material["color"])
    if np.any(material["color"] != 1):
        raise Cannot(f"material {material['name']}: a texture times a colour")
    sampler = reader.sampler(material["texture"])
    wraps = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
    wrap = {wraps[sampler.get(key, 10497)] for key in ("wrapS", "wrapT")}
    if len(wrap) > 1:
        raise Cannot(f"material {material['name']}: two kinds of wrapping")
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(reader.image(material["texture"]))
        file.flush()
        bitmap = mi.Bitmap(file.name)
    return {"type": "bitmap", "bitmap": bitmap, "wrap_mode": wrap.pop(),
            "filter_type": "nearest" if sampler.get("magFilter") == 9728 else "bilinear"}


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
        return {"type": "gltf", "base": base_color(reader, material), "metallic": float(material["metallic"]),
                "alpha": float(material["alpha"]), "coat": mi.ScalarColor3f(material["coat"]),
                "coat_f90": float(material["specular"])}, None
    if material["transmission"] != 1 or material["metallic"] != 0 or np.any(material["color"] != 1):
        raise Cannot(f"material {name}: glass that is also something else")
    if material["specular"] != 1 or material["medium"].get("priority", 0):
        raise Cannot(f"material {name}: priorities or weakened reflection")
    rough = material["alpha"] >= MIN_ALPHA
    if not (material["volume"] or {}).get("thicknessFactor", 0) > 0:
        if rough:
            raise Cannot(f"material {name}: a rough sheet")
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
    raise Cannot("spot lights: their edges differ")


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
    """The scene as a dictionary, without the sampler."""
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
    parts["sensor"] = {
        "type": "perspective", "fov": float(np.degrees(scene.yfov)), "fov_axis": "y",
        "near_clip": 1e-4, "far_clip": 1e6, "to_world": mi.ScalarTransform4f(pose),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
    }
    if around:
        parts["sensor"]["medium"] = around[0]
    depth = max_depth + 1 if max_depth else -1
    parts["integrator"] = {"type": "volpath" if media else "path", "max_depth": depth}
    return {"type": "scene"} | parts


class Mitsuba:
    def load(self, scene, width, height, max_depth):
        self.scenes = {}
        parts = convert(scene, width, height, max_depth)
        for sampler in SAMPLERS:
            parts["sensor"]["sampler"] = {"type": sampler}
            self.scenes[sampler] = mi.load_dict(parts)
        return f"Mitsuba {mi.__version__} {VARIANT}", SAMPLERS

    def render(self, sampler, spp, seed):
        scene = self.scenes[sampler]
        start = time.perf_counter()
        picture = mi.render(scene, spp=spp, seed=seed)
        dr.eval(picture)
        dr.sync_thread()
        seconds = time.perf_counter() - start
        # samplers round what they cannot stratify
        return np.array(picture)[..., :3], scene.sensors()[0].sampler().sample_count(), seconds


mitsuba = Mitsuba()
serve(mitsuba.load, mitsuba.render)
