"""The scene of a room."""

import math

from .gltf import Gltf
from .shapes import cuboid, icosphere, quad, rectangle, torus
from .vector import axis_angle

# Half of the room's width and depth, its height, and the window's frame in the left wall: from, to along z and y; metres.
WIDTH, DEPTH, HEIGHT = 2.0, 2.5, 2.6
NEAR, FAR, SILL, LINTEL = 0.4, -1.0, 0.9, 2.2
THICKNESS = 0.25


def window():
    gltf = Gltf("A room with one window: all light comes through a small part of what a point sees")
    plaster = gltf.lambert("plaster", (0.75, 0.72, 0.67))
    boards = gltf.lambert("boards", (0.42, 0.27, 0.16))
    ground = gltf.lambert("ground", (0.22, 0.25, 0.12))
    w, d, h = WIDTH, DEPTH, HEIGHT
    # Walls are boxes: no light passes where they meet.
    outer = w + THICKNESS
    boxes = [
        ("right wall", (w, -0.1, -d), (outer, h, d), plaster),
        ("back wall", (-outer, -0.1, -d - THICKNESS), (outer, h, -d), plaster),
        ("front wall", (-outer, -0.1, d), (outer, h, d + THICKNESS), plaster),
        ("floor", (-outer, -0.2, -d - THICKNESS), (outer, 0, d + THICKNESS), boards),
        ("ceiling", (-outer, h, -d - THICKNESS), (outer, h + 0.2, d + THICKNESS), plaster),
        ("below the window", (-outer, -0.1, -d), (-w, SILL, d), plaster),
        ("above the window", (-outer, LINTEL, -d), (-w, h, d), plaster),
        ("beside the window", (-outer, SILL, NEAR), (-w, LINTEL, d), plaster),
        ("behind the window", (-outer, SILL, -d), (-w, LINTEL, FAR), plaster),
    ]
    for name, low, high, material in boxes:
        gltf.node(name, mesh=gltf.mesh(name, (cuboid(low, high), material)))
    plane = quad([(-60, -0.3, -60), (60, -0.3, -60), (60, -0.3, 60), (-60, -0.3, 60)], (0, 1, 0))
    gltf.node("ground", mesh=gltf.mesh("ground", (plane, ground)))
    add_furniture(gltf)
    gltf.light("sun", "directional", [1, 0.93, 0.8], 40, direction=(0.72, -0.6, -0.35))
    gltf.environment(radiance=[2.6, 3.2, 4.2])
    gltf.camera("camera", (1.1, 1.45, 2.3), (-0.35, 0.95, -1.2), yfov=round(math.radians(56), 6), aspectRatio=1.5, znear=0.05)
    return gltf


def add_furniture(gltf):
    oak = gltf.lambert("oak", (0.55, 0.36, 0.2))
    wool = gltf.lambert("wool", (0.5, 0.08, 0.07))
    glaze = gltf.lambert("glaze", (0.15, 0.3, 0.5))
    steel = gltf.material("brushed steel", (0.72, 0.72, 0.72), 1, 0.45)
    top = gltf.mesh("table top", (cuboid((-0.7, 0.7, -0.45), (0.7, 0.75, 0.45)), oak))
    leg = gltf.mesh("leg", (cuboid((-0.03, 0, -0.03), (0.03, 0.7, 0.03)), oak))
    place = (0.1, 0, -0.9)
    gltf.node("table top", mesh=top, translation=place)
    for x in (-0.62, 0.62):
        for z in (-0.37, 0.37):
            gltf.node("leg", mesh=leg, translation=(place[0] + x, 0, place[2] + z))
    rug = rectangle((0.1, 0.004, 0.4), (0.9, 0, 0), (0, 0, -0.6))
    gltf.node("rug", mesh=gltf.mesh("rug", (rug, wool)))
    ball = gltf.geometry(icosphere(3))
    gltf.node("bowl", mesh=gltf.mesh("bowl", (ball, steel)), translation=(-0.2, 0.912, -0.95), scale=[0.16] * 3)
    gltf.node("vase", mesh=gltf.mesh("vase", (ball, glaze)), translation=(0.4, 0.932, -1.0), scale=(0.11, 0.18, 0.11))
    ring = gltf.mesh("ring", (torus(0.16, 0.05, 32, 16), glaze))
    gltf.node("ring", mesh=ring, translation=(0.12, 0.802, -0.65), rotation=axis_angle((1, 0, 0), 0))


SCENES = (window,)
