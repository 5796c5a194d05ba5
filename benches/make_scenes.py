#!/usr/bin/env python3
"""Scenes for etendue bench that are too large to keep, or simpler than those of scenes/ so that more renderers can
render them. Needs numpy.

    benches/make_scenes.py FOLDER [--helmet FlightHelmet.gltf]

`terrain`: hills of 768 800 triangles. `lamps`: 1024 small lamps over blocks. `sun-matt`, `glass-solid`: scenes of
scenes/ without painted surfaces, without the rough pane. `helmet`, `helmet-matt`: Khronos' sample asset FlightHelmet
without normal maps and lenses, under the sky of scenes/sun.hdr; the second with Lambert's surfaces.
"""
import argparse
import json
import math
import shutil
from pathlib import Path

import numpy as np

SCENES = Path(__file__).resolve().parent.parent / "scenes"
FLOAT, UNSIGNED_INT = 5126, 5125
SKY = {"ETENDUE_environment": {"uri": "sun.hdr", "intensity": 1, "rotation": 0}}


class File:
    """A glTF file and its buffer."""

    def __init__(self, extensions):
        self.data = b""
        self.gltf = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [], "extensions": extensions}],
            "extensionsUsed": ["ETENDUE_environment", "KHR_materials_specular", "KHR_materials_emissive_strength"],
            "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "cameras": [],
        }

    def add(self, kind, part):
        self.gltf[kind].append(part)
        return len(self.gltf[kind]) - 1

    def accessor(self, array, component):
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes})
        self.data += array.tobytes()
        scalar = array.ndim == 1
        bounds = {} if scalar else {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        return self.add("accessors", {"bufferView": view, "componentType": component, "count": len(array),
                                      "type": "SCALAR" if scalar else "VEC3"} | bounds)

    def mesh(self, positions, triangles, color, emission=0.0):
        material = {"pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0},
                    "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}
        if emission:
            material["emissiveFactor"] = [1, 1, 1]
            material["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": emission}
        primitive = {
            "attributes": {"POSITION": self.accessor(positions.astype("<f4"), FLOAT)},
            "indices": self.accessor(triangles.astype("<u4").ravel(), UNSIGNED_INT),
            "material": self.add("materials", material),
        }
        self.node(mesh=self.add("meshes", {"primitives": [primitive]}))

    def node(self, **node):
        self.gltf["scenes"][0]["nodes"].append(self.add("nodes", node))

    def camera(self, eye, degrees_down, yfov, aspect):
        """Looks along −Z, turned down."""
        half = math.radians(degrees_down) / 2
        perspective = {"yfov": math.radians(yfov), "aspectRatio": aspect, "znear": 0.05}
        camera = self.add("cameras", {"type": "perspective", "perspective": perspective})
        self.node(camera=camera, translation=eye, rotation=[-math.sin(half), 0, 0, math.cos(half)])

    def write(self, path):
        self.gltf["buffers"] = [{"byteLength": len(self.data), "uri": path.with_suffix(".bin").name}]
        path.with_suffix(".bin").write_bytes(self.data)
        path.write_text(json.dumps(self.gltf))


def terrain(path, side=620):
    file = File({"ETENDUE_environment": {"radiance": [1, 1, 1]}})
    place = 16.0 * (np.arange(side + 1) / side - 0.5)
    x, z = np.meshgrid(place, place)
    height = (0.6 * np.sin(0.9 * x) * np.cos(0.7 * z) + 0.2 * np.sin(2.9 * x + 1) * np.sin(3.1 * z)
              + 0.05 * np.sin(9 * x) * np.cos(8 * z + 2))
    row, column = np.mgrid[:side, :side]
    a = row * (side + 1) + column
    b, c, d = a + 1, a + side + 1, a + side + 2
    triangles = np.stack([np.stack([a, c, b], -1), np.stack([b, c, d], -1)], 2).reshape(-1, 3)
    file.mesh(np.stack([x, height, z], -1).reshape(-1, 3), triangles, [0.7] * 3)
    file.camera([0, 5, 9], 29, 45, 1.6)
    file.write(path)


def many(corners, triangles, places):
    """One body at many places."""
    starts = len(corners) * np.arange(len(places))
    return (places[:, None] + corners).reshape(-1, 3), (starts[:, None, None] + triangles).reshape(-1, 3)


def grid(count, width, height):
    side = round(math.sqrt(count))
    at = width * ((np.arange(side) + 0.5) / side - 0.5)
    x, z = np.meshgrid(at, at)
    return np.stack([x.ravel(), np.full(side * side, height), z.ravel()], -1)


def lamps(path, count=1024):
    file = File({"ETENDUE_environment": {"radiance": [0, 0, 0]}})
    square = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
    up, down = np.array([[0, 2, 1], [0, 3, 2]]), np.array([[0, 1, 2], [0, 2, 3]])
    file.mesh(8 * square, up, [0.6, 0.58, 0.55])
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    sides = np.array([t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])])
    file.mesh(*many(0.4 * cube, sides, grid(25, 8, 0.4)), [0.7, 0.35, 0.2])
    half = 0.05
    places = grid(count, 8, 0.0)
    # at many heights, so that near lamps matter far more than distant ones
    places[:, 1] = 1.2 + 1.4 * np.sin(12.9898 * np.arange(count)) ** 2
    file.mesh(*many(half * square, down, places), [0, 0, 0], 20 / (4 * half * half * count))
    file.camera([0, 4, 9], 24, 45, 1.6)
    file.write(path)


def variant(name, path, change):
    gltf = json.loads((SCENES / name).read_text())
    change(gltf)
    path.write_text(json.dumps(gltf))


def without_paint(gltf):
    for material in gltf["materials"]:
        if material["pbrMetallicRoughness"]["metallicFactor"] == 0:
            material.setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0}
    gltf["extensionsUsed"] = sorted({*gltf["extensionsUsed"], "KHR_materials_specular"})


def without_rough_pane(gltf):
    pane = next(i for i, node in enumerate(gltf["nodes"]) if node.get("name") == "frosted pane")
    gltf["scenes"][0]["nodes"].remove(pane)


def helmet(source, path, is_matt):
    gltf = json.loads(source.read_text())
    used = {"ETENDUE_environment"}
    for material in gltf["materials"]:
        for key in ("normalTexture", "occlusionTexture", "alphaMode"):
            material.pop(key, None)
        if is_matt:
            material["pbrMetallicRoughness"].pop("metallicRoughnessTexture", None)
            material["pbrMetallicRoughness"]["metallicFactor"] = 0
            material["extensions"] = {"KHR_materials_specular": {"specularFactor": 0}}
            used.add("KHR_materials_specular")
    scene = gltf["scenes"][gltf.get("scene", 0)]
    lenses = [i for i, node in enumerate(gltf["nodes"]) if "Lenses" in node.get("name", "")]
    for nodes in [scene["nodes"], *(node["children"] for node in gltf["nodes"] if "children" in node)]:
        nodes[:] = [i for i in nodes if i not in lenses]
    for item in [*gltf["buffers"], *gltf["images"]]:
        shutil.copyfile(source.parent / item["uri"], path.parent / item["uri"])
    scene["extensions"] = SKY
    gltf["extensionsUsed"] = sorted(used)
    gltf["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.6, "aspectRatio": 0.8, "znear": 0.01}}]
    scene["nodes"].append(len(gltf["nodes"]))
    gltf["nodes"].append({"camera": 0, "translation": [0, 0.35, 1.3]})
    path.write_text(json.dumps(gltf))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--helmet", type=Path)
    arguments = parser.parse_args()
    folder = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(SCENES / "sun.hdr", folder / "sun.hdr")
    terrain(folder / "terrain.gltf")
    lamps(folder / "lamps.gltf")
    variant("sun.gltf", folder / "sun-matt.gltf", without_paint)
    variant("glass.gltf", folder / "glass-solid.gltf", without_rough_pane)
    if arguments.helmet:
        helmet(arguments.helmet, folder / "helmet.gltf", False)
        helmet(arguments.helmet, folder / "helmet-matt.gltf", True)


main()
