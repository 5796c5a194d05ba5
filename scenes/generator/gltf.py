"""Writes one glTF 2.0 file with everything embedded, and refuses meshes that are wrong."""

import base64
import json
import struct
from collections import Counter

from .vector import cross, dot, length, look_along, sub

FLOAT, UNSIGNED_SHORT = 5126, 5123
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
TYPES = {2: "VEC2", 3: "VEC3", 4: "VEC4"}


def tidy(values, digits=5):
    """Short numbers: rounded, whole ones without a point."""
    rounded = [round(v, digits) for v in values]
    return [int(v) if v == int(v) else v for v in rounded]


class Gltf:
    """Collects the parts of a file; every method that adds a part returns its index."""

    def __init__(self, description):
        self.description = description
        self.data = bytearray()
        self.parts = {}
        self.roots = []
        self.scene_extensions = {}
        self.lights = []
        self.closed = set()
        self.extensions = set()

    def _add(self, kind, part):
        self.parts.setdefault(kind, []).append(part)
        return len(self.parts[kind]) - 1

    def _view(self, data, target=None):
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        if target:
            view["target"] = target
        self.data += data
        return self._add("bufferViews", view)

    def _vectors(self, vectors, bounds=False):
        """An accessor of floats; None for no vectors."""
        if not vectors:
            return None
        width = len(vectors[0])
        data = struct.pack(f"<{width * len(vectors)}f", *(c for v in vectors for c in v))
        accessor = {
            "bufferView": self._view(data, ARRAY_BUFFER),
            "componentType": FLOAT,
            "count": len(vectors),
            "type": TYPES[width],
        }
        if bounds:
            # Of the stored 32-bit values, which the specification asks for.
            stored = list(struct.iter_unpack(f"<{width}f", data))
            accessor["min"] = [min(c) for c in zip(*stored)]
            accessor["max"] = [max(c) for c in zip(*stored)]
        return self._add("accessors", accessor)

    def geometry(self, shape, textured=False):
        """The part of a primitive that meshes may share; texture coordinates only where they are used."""
        check(shape)
        attributes = {
            "POSITION": self._vectors(shape.positions, bounds=True),
            "NORMAL": self._vectors(shape.normals),
            "TEXCOORD_0": self._vectors(shape.uvs if textured else []),
            "COLOR_0": self._vectors(shape.colors),
        }
        indices = [i for triangle in shape.triangles for i in triangle]
        view = self._view(struct.pack(f"<{len(indices)}H", *indices), ELEMENT_ARRAY_BUFFER)
        accessor = {
            "bufferView": view,
            "componentType": UNSIGNED_SHORT,
            "count": len(indices),
            "type": "SCALAR",
        }
        geometry = {
            "attributes": {k: v for k, v in attributes.items() if v is not None},
            "indices": self._add("accessors", accessor),
        }
        if is_closed(shape):
            self.closed.add(geometry["indices"])
        return geometry

    def mesh(self, name, *primitives):
        """Each primitive is (shape or geometry, material)."""
        built = []
        for geometry, material in primitives:
            text = compact(self.parts["materials"][material])
            if not isinstance(geometry, dict):
                geometry = self.geometry(geometry, textured="Texture" in text)
            if "KHR_materials_volume" in text:
                assert geometry["indices"] in self.closed, "a solid is not closed"
            built.append({**geometry, "material": material})
        return self._add("meshes", {"name": name, "primitives": built})

    def texture(self, image, **sampler):
        """A PNG with its sampler: magFilter, minFilter, wrapS, wrapT as glTF numbers them."""
        source = self._add("images", {"bufferView": self._view(image), "mimeType": "image/png"})
        return self._add("textures", {"source": source, "sampler": self._add("samplers", sampler)})

    def material(self, name, color=(1, 1, 1, 1), metallic=0, roughness=1, pbr=(), extensions=None, **rest):
        """`pbr` adds textures to pbrMetallicRoughness; `rest` are the material's other properties."""
        material = {
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": list(color) + [1] * (4 - len(color)),
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
                **dict(pbr),
            },
            **rest,
        }
        if extensions:
            material["extensions"] = extensions
            self.extensions.update(extensions)
        return self._add("materials", material)

    def lambert(self, name, color, **rest):
        """Purely diffuse: glTF's dielectric coat is switched off."""
        return self.material(
            name, color, extensions={"KHR_materials_specular": {"specularFactor": 0}}, **rest
        )

    def emitter(self, name, radiance, color=(0, 0, 0), **rest):
        """Emits `radiance`, cd/m² per channel, and reflects like Lambert."""
        strength = max(radiance)
        extensions = {"KHR_materials_specular": {"specularFactor": 0}}
        if strength > 1:
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            radiance = [r / strength for r in radiance]
        return self.material(
            name, color, emissiveFactor=tidy(radiance, 7), extensions=extensions, **rest
        )

    def solid(self, name, ior, roughness=0, attenuation=None, medium=None, color=(1, 1, 1)):
        """The boundary of a closed mesh. `attenuation`: a colour and the distance, metres, after which
        white light has it; `medium`: ETENDUE_medium."""
        volume = {"thicknessFactor": 1}
        if attenuation:
            volume |= {"attenuationColor": list(attenuation[0]), "attenuationDistance": attenuation[1]}
        extensions = {
            "KHR_materials_ior": {"ior": ior},
            "KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_volume": volume,
        }
        if medium:
            extensions["ETENDUE_medium"] = medium
        return self.material(name, color, 0, roughness, extensions=extensions)

    def sheet(self, name, roughness=0, color=(1, 1, 1)):
        """An infinitely thin sheet of glass."""
        extensions = {"KHR_materials_transmission": {"transmissionFactor": 1}}
        return self.material(name, color, 0, roughness, extensions=extensions)

    def node(self, name=None, parent=None, **properties):
        """A node of the scene, or a child of the node `parent`."""
        node = {"name": name} if name else {}
        for key, value in properties.items():
            node[key] = tidy(value) if isinstance(value, (tuple, list)) else value
        index = self._add("nodes", node)
        if parent is None:
            self.roots.append(index)
        else:
            self.parts["nodes"][parent].setdefault("children", []).append(index)
        return index

    def instances(self, name, mesh, translations, scales):
        """One node that places a mesh many times (EXT_mesh_gpu_instancing)."""
        self.extensions.add("EXT_mesh_gpu_instancing")
        attributes = {
            "TRANSLATION": self._vectors(translations),
            "SCALE": self._vectors(scales),
        }
        self.node(name, mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})

    def camera(self, name, eye, target, **projection):
        """`projection`: type and the properties of that type; perspective angles in radians."""
        kind = projection.pop("type", "perspective")
        camera = self._add("cameras", {"name": name, "type": kind, kind: projection})
        self.node(name, camera=camera, translation=eye, rotation=look_along(sub(target, eye)))

    def light(self, name, kind, color, intensity, parent=None, position=None, direction=None, **rest):
        """KHR_lights_punctual: intensity in cd (point, spot) or lx (directional)."""
        self.extensions.add("KHR_lights_punctual")
        self.lights.append(
            {"name": name, "type": kind, "color": color, "intensity": intensity, **rest}
        )
        properties = {}
        if position:
            properties["translation"] = position
        if direction:
            properties["rotation"] = look_along(direction)
        reference = {"KHR_lights_punctual": {"light": len(self.lights) - 1}}
        self.node(name, parent, extensions=reference, **properties)

    def environment(self, **environment):
        """The scene's ETENDUE_environment."""
        self.extensions.add("ETENDUE_environment")
        self.scene_extensions["ETENDUE_environment"] = environment

    def medium(self, **medium):
        """The scene's ETENDUE_medium."""
        self.extensions.add("ETENDUE_medium")
        self.scene_extensions["ETENDUE_medium"] = medium

    def text(self):
        """The file: one part a line, so that differences can be read."""
        scene = {"nodes": self.roots}
        if self.scene_extensions:
            scene["extensions"] = self.scene_extensions
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        file = {"asset": {"version": "2.0", "generator": "scenes/make.py", "extras": {"title": self.description}}}
        if self.extensions:
            file["extensionsUsed"] = sorted(self.extensions)
        if self.lights:
            file["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        file |= {"scene": 0, "scenes": [scene], **self.parts}
        file["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        lines = []
        for key, value in file.items():
            if isinstance(value, list) and isinstance(value[0], dict):
                items = ",\n".join(compact(item) for item in value)
                lines.append(f"{compact(key)}:[\n{items}\n]")
            else:
                lines.append(f"{compact(key)}:{compact(value)}")
        return "{\n" + ",\n".join(lines) + "\n}\n"


def compact(value):
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def check(shape):
    """Indices in range, all attributes for all vertices, triangles with area, normals of unit
    length on the side that the triangle faces."""
    count = len(shape.positions)
    assert 0 < count < 65535, "16-bit indices; 65535 is the restart mark"
    for attribute in (shape.normals, shape.uvs, shape.colors):
        assert len(attribute) in (0, count), "an attribute lacks vertices"
    for normal in shape.normals:
        assert abs(length(normal) - 1) < 1e-6, "a normal is not of unit length"
    for triangle in shape.triangles:
        assert all(0 <= i < count for i in triangle), "an index is out of range"
        a, b, c = (shape.positions[i] for i in triangle)
        normal = cross(sub(b, a), sub(c, a))
        assert length(normal) > 0, "a triangle has no area"
        for i in triangle:
            assert not shape.normals or dot(normal, shape.normals[i]) > 0, "a normal points inward"


def is_closed(shape):
    """Whether each edge is run through once in each direction, and the outside is outside.

    Vertices count as one where their stored positions are the same."""
    stored = [struct.pack("<3f", *(c + 0.0 for c in p)) for p in shape.positions]
    edges = Counter()
    volume = 0
    for triangle in shape.triangles:
        a, b, c = (shape.positions[i] for i in triangle)
        volume += dot(a, cross(b, c))
        for i, j in zip(triangle, triangle[1:] + triangle[:1]):
            edges[stored[i], stored[j]] += 1
    paired = all(count == 1 and edges[j, i] == 1 for (i, j), count in list(edges.items()))
    return paired and volume > 0
