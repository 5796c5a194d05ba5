#!/usr/bin/env python3
"""Path rate on scenes/cornell.gltf: etendue (both traversals) and Mitsuba 3 (llvm_ad_rgb).

    pip install mitsuba numpy
    DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so benches/cornell.py target/release/etendue [ROUNDS]

Alternates the renderers in one run on the same cores, at the same size, depth
and samples, after a warm-up, and prints the median milliseconds per sample of
the picture, the ratio to Mitsuba with its range over the rounds, and the means
of the pictures, which must agree. Mitsuba's roulette starts at its default
depth of five.
"""
import base64
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import drjit as dr
import mitsuba as mi
import numpy as np

SIDE, SAMPLES, DEPTH = 512, 16, 6
SCENE = os.path.join(os.path.dirname(__file__), "..", "scenes", "cornell.gltf")


def mitsuba_scene():
    """The glTF scene as a Mitsuba dictionary; translations only, Lambert only."""
    gltf = json.load(open(SCENE))
    data = base64.b64decode(gltf["buffers"][0]["uri"].split(",", 1)[1])
    types = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5121: np.uint8}
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}

    def read(index):
        accessor = gltf["accessors"][index]
        view = gltf["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        width = widths[accessor["type"]]
        flat = np.frombuffer(data, types[accessor["componentType"]], accessor["count"] * width, start)
        return flat.reshape(-1, width)

    integrator = {"type": "path", "max_depth": DEPTH + 1}
    scene = {"type": "scene", "integrator": integrator}
    for index, node in enumerate(gltf["nodes"]):
        place = np.array(node.get("translation", [0, 0, 0]), np.float32)
        if "camera" in node:
            camera = gltf["cameras"][node["camera"]]["perspective"]
            forward = [0, 0, 1] if node["rotation"] == [0, 1, 0, 0] else [0, 0, -1]
            look = mi.ScalarTransform4f().look_at(origin=place, target=place + forward, up=[0, 1, 0])
            film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}}
            scene["sensor"] = {
                "type": "perspective", "fov": float(np.degrees(camera["yfov"])), "fov_axis": "y",
                "near_clip": 1e-3, "far_clip": 1e4, "to_world": look, "film": film,
                "sampler": {"type": "independent"},
            }
        for part, primitive in enumerate(gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []):
            positions = read(primitive["attributes"]["POSITION"]) + place
            faces = read(primitive["indices"]).astype(np.uint32)
            material = gltf["materials"][primitive["material"]]
            colour = material["pbrMetallicRoughness"].get("baseColorFactor", [1, 1, 1, 1])[:3]
            strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {})
            radiance = np.array(material.get("emissiveFactor", [0, 0, 0])) * strength.get("emissiveStrength", 1)
            properties = mi.Properties()
            properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}})
            if radiance.max() > 0:
                value = [float(v) for v in radiance]
                properties["light"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": value}})
            mesh = mi.Mesh("mesh", len(positions), faces.size // 3, props=properties)
            parameters = mi.traverse(mesh)
            parameters["vertex_positions"] = positions.ravel()
            parameters["faces"] = faces.ravel()
            parameters.update()
            scene[f"mesh{index}_{part}"] = mesh
    return mi.load_dict(scene)


def run_etendue(program, backend, seed):
    """Milliseconds per sample (from --stats: rendering alone) and the picture's mean."""
    with tempfile.TemporaryDirectory() as folder:
        out, stats = os.path.join(folder, "out.exr"), os.path.join(folder, "stats.json")
        subprocess.run([program, "render", SCENE, "-o", out, "--spp", str(SAMPLES), "--width", str(SIDE),
                        "--height", str(SIDE), "--max-depth", str(DEPTH), "--backend", backend,
                        "--seed", str(seed), "--stats", stats, "-q"], check=True)
        picture = np.array(mi.Bitmap(out))[..., :3]
        return json.load(open(stats))["times"]["render"] * 1e3 / SAMPLES, picture.mean((0, 1))


def run_mitsuba(scene, seed):
    start = time.perf_counter()
    picture = np.array(mi.render(scene, spp=SAMPLES, seed=seed))
    dr.sync_thread()
    return (time.perf_counter() - start) * 1e3 / SAMPLES, picture.mean((0, 1))


def main():
    program, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5
    mi.set_variant("llvm_ad_rgb")
    scene = mitsuba_scene()
    runs = {
        "mitsuba llvm_ad_rgb": lambda seed: run_mitsuba(scene, seed),
        "etendue bvh": lambda seed: run_etendue(program, "bvh", seed),
        "etendue ray-query": lambda seed: run_etendue(program, "ray-query", seed),
    }
    times = {name: [] for name in runs}
    means = {name: [] for name in runs}
    for seed in range(rounds + 1):
        for name, run in runs.items():
            milliseconds, mean = run(seed)
            if seed > 0:
                times[name].append(milliseconds)
                means[name].append(mean)
    base = times["mitsuba llvm_ad_rgb"]
    print(f"{SIDE} x {SIDE}, {SAMPLES} samples, depth {DEPTH}, {rounds} rounds")
    for name, values in times.items():
        ratios = sorted(b / v for b, v in zip(base, values))
        print(f"{name:20s} {statistics.median(values):8.1f} ms per sample, rate against Mitsuba "
              f"{statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f}), "
              f"mean {np.mean(means[name], 0).round(5)}")


main()
