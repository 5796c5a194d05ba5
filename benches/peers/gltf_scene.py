"""etendue's glTF scenes as plain numbers, for other renderers.

What a peer is not told it must not render: everything that is not understood here raises Cannot with the reason.
Conventions are those of etendue's README: metres, linear Rec. 709, radiance in cd/m².
"""
import base64
import json
import math
import os
from dataclasses import dataclass, field

import numpy as np

KNOWN = {
    "ETENDUE_environment", "ETENDUE_medium", "EXT_mesh_gpu_instancing", "KHR_lights_punctual",
    "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
    "KHR_materials_transmission", "KHR_materials_volume",
}
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# Dominant wavelengths of the Rec. 709 primaries, nm
WAVELENGTHS = np.array([611.4, 549.1, 464.2])


class Cannot(Exception):
    """The scene holds what a peer cannot render as etendue does."""


@dataclass
class Mesh:
    """All triangles of one material, in world space; fronts counter-clockwise."""
    material: dict
    positions: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uvs: np.ndarray | None


@dataclass
class Scene:
    path: str
    meshes: list = field(default_factory=list)
    lights: list = field(default_factory=list)  # (glTF light, world matrix)
    camera: np.ndarray | None = None            # world from camera
    yfov: float = 0.0                           # radians
    environment: dict | None = None
    medium: dict | None = None
    textures: list = field(default_factory=list)


class Reader:
    def __init__(self, path):
        if not path.endswith(".gltf"):
            raise Cannot("only .gltf is read")
        self.path = path
        self.gltf = json.load(open(path))
        self.buffers = [self.bytes_of(b["uri"]) for b in self.gltf.get("buffers", [])]

    def bytes_of(self, uri):
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return open(os.path.join(os.path.dirname(self.path), uri), "rb").read()

    def accessor(self, index):
        accessor = self.gltf["accessors"][index]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise Cannot("sparse accessors")
        view = self.gltf["bufferViews"][accessor["bufferView"]]
        kind, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        if view.get("byteStride", kind.itemsize * width) != kind.itemsize * width:
            raise Cannot("interleaved buffers")
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(self.buffers[view["buffer"]], kind, accessor["count"] * width, start)
        return flat.reshape(-1, width)

    def image(self, index):
        """The bytes of the image of a texture."""
        image = self.gltf["images"][self.gltf["textures"][index]["source"]]
        if "uri" in image:
            return self.bytes_of(image["uri"])
        view = self.gltf["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        return self.buffers[view["buffer"]][start:start + view["byteLength"]]

    def sampler(self, index):
        """Whether texels are interpolated, and how the texture goes on: a code of glTF."""
        texture = self.gltf["textures"][index]
        sampler = self.gltf["samplers"][texture["sampler"]] if "sampler" in texture else {}
        wraps = {sampler.get(key, 10497) for key in ("wrapS", "wrapT")}
        if len(wraps) > 1:
            raise Cannot("two kinds of wrapping of one texture")
        return sampler.get("magFilter") != 9728, wraps.pop()


def local_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    return placed(node.get("translation", [0, 0, 0]), node.get("rotation", [0, 0, 0, 1]), node.get("scale", [1, 1, 1]))


def placed(translation, rotation, scale):
    x, y, z, w = np.asarray(rotation, float) / np.linalg.norm(rotation)
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(scale, float)
    matrix[:3, 3] = translation
    return matrix


def extension(item, name):
    return item.get("extensions", {}).get(name)


def material_of(gltf, index):
    """A material with its defaults filled in."""
    material = gltf["materials"][index] if index is not None else {}
    name = material.get("name", "default")
    unknown = set(material.get("extensions", {})) - KNOWN
    if unknown:
        raise Cannot(f"material {name}: {', '.join(sorted(unknown))}")
    for key in ("normalTexture", "emissiveTexture"):
        if key in material:
            raise Cannot(f"material {name}: {key}")
    if material.get("alphaMode", "OPAQUE") != "OPAQUE":
        raise Cannot(f"material {name}: alpha")
    pbr = material.get("pbrMetallicRoughness", {})
    texture, surface = pbr.get("baseColorTexture"), pbr.get("metallicRoughnessTexture")
    if any(t and (t.get("texCoord", 0) or t.get("extensions")) for t in (texture, surface)):
        raise Cannot(f"material {name}: transformed textures")
    specular = extension(material, "KHR_materials_specular") or {}
    if any(key.endswith("Texture") for key in specular):
        raise Cannot(f"material {name}: specular textures")
    strength = (extension(material, "KHR_materials_emissive_strength") or {}).get("emissiveStrength", 1)
    emission = np.array(material.get("emissiveFactor", [0, 0, 0]), float) * strength
    if emission.max() > 0 and material.get("doubleSided"):
        raise Cannot(f"material {name}: light from both sides")
    ior = (extension(material, "KHR_materials_ior") or {}).get("ior", 1.5)
    f0 = ((ior - 1) / (ior + 1)) ** 2 * np.array(specular.get("specularColorFactor", [1, 1, 1]), float)
    transmission = extension(material, "KHR_materials_transmission") or {}
    return {
        "name": name,
        "color": np.array(pbr.get("baseColorFactor", [1, 1, 1, 1])[:3], float),
        "texture": texture["index"] if texture else None,
        "surface": surface["index"] if surface else None,  # roughness in G, metallic in B
        "metallic": pbr.get("metallicFactor", 1),
        "roughness": pbr.get("roughnessFactor", 1),
        "alpha": pbr.get("roughnessFactor", 1) ** 2,
        "ior": ior,
        "specular": specular.get("specularFactor", 1),
        "coat": np.minimum(f0, 1) * specular.get("specularFactor", 1),
        "emission": emission,
        "transmission": transmission.get("transmissionFactor", 0),
        "volume": extension(material, "KHR_materials_volume"),
        "medium": extension(material, "ETENDUE_medium") or {},
    }


def coefficients(medium, volume=None):
    """(absorption, scattering, phase, g) of a medium, 1/m per channel."""
    absorption = np.array(medium.get("absorption", [0, 0, 0]), float)
    if volume and math.isfinite(volume.get("attenuationDistance", math.inf)):
        color = np.array(volume.get("attenuationColor", [1, 1, 1]), float)
        absorption = absorption - np.log(color) / volume["attenuationDistance"]
    scattering = np.array(medium.get("scattering", [0, 0, 0]), float)
    phase = medium.get("phase", "isotropic")
    if "rayleigh550" in medium:
        scattering = medium["rayleigh550"] * (550 / WAVELENGTHS) ** 4
        phase = medium.get("phase", "rayleigh")
    return absorption, scattering, phase, medium.get("g", 0)


def instances(reader, node, world):
    """World matrices of a node's mesh."""
    gpu = extension(node, "EXT_mesh_gpu_instancing")
    if not gpu:
        return [world]
    columns = {name: reader.accessor(index) for name, index in gpu["attributes"].items()}
    count = len(next(iter(columns.values())))
    get = lambda name, default, i: columns[name][i] if name in columns else default
    return [world @ placed(get("TRANSLATION", [0, 0, 0], i), get("ROTATION", [0, 0, 0, 1], i), get("SCALE", [1, 1, 1], i))
            for i in range(count)]


def load(path):
    reader = Reader(path)
    gltf = reader.gltf
    unknown = set(gltf.get("extensionsUsed", [])) - KNOWN
    if unknown:
        raise Cannot(f"extensions: {', '.join(sorted(unknown))}")
    scene = Scene(path)
    root = gltf["scenes"][gltf.get("scene", 0)]
    scene.environment = extension(root, "ETENDUE_environment")
    scene.medium = extension(root, "ETENDUE_medium")
    parts = {}
    pending = [(index, np.eye(4)) for index in reversed(root["nodes"])]
    while pending:
        index, above = pending.pop()
        node = gltf["nodes"][index]
        world = above @ local_matrix(node)
        pending += [(child, world) for child in reversed(node.get("children", []))]
        if "camera" in node and scene.camera is None:
            camera = gltf["cameras"][node["camera"]]
            if camera["type"] != "perspective":
                raise Cannot("an orthographic camera")
            scene.camera, scene.yfov = world, camera["perspective"]["yfov"]
        light = extension(node, "KHR_lights_punctual")
        if light:
            scene.lights.append((gltf["extensions"]["KHR_lights_punctual"]["lights"][light["light"]], world))
        if "mesh" in node:
            matrices = instances(reader, node, world)
            for primitive in gltf["meshes"][node["mesh"]]["primitives"]:
                add(reader, parts, primitive, matrices)
    if scene.camera is None:
        raise Cannot("no camera in the file")
    for (material, _, _), pieces in parts.items():
        positions, faces, normals, uvs = zip(*pieces)
        starts = np.cumsum([0] + [len(p) for p in positions[:-1]])
        scene.meshes.append(Mesh(
            material_of(gltf, material), np.concatenate(positions),
            np.concatenate([f + s for f, s in zip(faces, starts)]),
            None if normals[0] is None else np.concatenate(normals),
            None if uvs[0] is None else np.concatenate(uvs)))
    scene.textures = reader
    return scene


def add(reader, parts, primitive, matrices):
    """Puts a primitive where it stands, to others of its material."""
    attributes = primitive["attributes"]
    if primitive.get("mode", 4) != 4 or "COLOR_0" in attributes:
        raise Cannot("strips, fans or vertex colours")
    positions = reader.accessor(attributes["POSITION"]).astype(float)
    faces = (reader.accessor(primitive["indices"]) if "indices" in primitive else np.arange(len(positions)))
    faces = faces.astype(np.uint32).reshape(-1, 3)
    normals = reader.accessor(attributes["NORMAL"]).astype(float) if "NORMAL" in attributes else None
    uvs = reader.accessor(attributes["TEXCOORD_0"]).astype(float) if "TEXCOORD_0" in attributes else None
    key = (primitive.get("material"), normals is not None, uvs is not None)
    for matrix in matrices:
        linear = matrix[:3, :3]
        turned = None
        if normals is not None:
            turned = normals @ np.linalg.inv(linear)
            turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        mirrored = np.linalg.det(linear) < 0
        parts.setdefault(key, []).append(
            (positions @ linear.T + matrix[:3, 3], faces[:, ::-1] if mirrored else faces, turned, uvs))


def contains(mesh, point):
    """Whether a closed mesh holds a point: by the solid angle that it fills there."""
    a, b, c = (mesh.positions[mesh.faces[:, i]] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = lambda u, v: np.einsum("ij,ij->i", u, v)
    rest = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return abs(2 * np.arctan2(volume, rest).sum()) > 2 * math.pi
