#!/usr/bin/env python3
"""Writes the project's scenes next to itself, always with the same bytes.

    scenes/make.py           writes them
    scenes/make.py --check   says which files differ from what would be written, and fails if any does

Needs nothing but Python 3.9. Units: metres, radiance in cd/m², linear Rec. 709.
What each scene is for stands in README.md."""

import math
import random
import sys
from pathlib import Path

# The folder is a source tree: nothing is cached in it.
sys.dont_write_bytecode = True

from generator import rooms, volumes
from generator.gltf import Gltf
from generator.images import hdr, png, srgb, unit
from generator.shapes import block, cuboid, globe, icosphere, quad, rectangle, torus
from generator.vector import add, axis_angle, cross, mul, normalize, sub

REPEAT, CLAMP = 10497, 33071
NEAREST, LINEAR = 9728, 9729


def cornell():
    """The measured box, its skewed walls made right-angled; given in millimetres."""
    gltf = Gltf("The Cornell box: colour bleeding and soft shadows between purely diffuse walls")
    mm = lambda *corners: [mul(corner, 1e-3) for corner in corners]
    white = gltf.lambert("white", (0.725, 0.71, 0.68))
    red = gltf.lambert("red", (0.63, 0.065, 0.05))
    green = gltf.lambert("green", (0.14, 0.45, 0.091))
    lamp = gltf.emitter("lamp", (17, 12, 4), (0.78, 0.78, 0.78))
    x, y, z = 556, 548.8, 559.2
    walls = [
        ("floor", [(0, 0, 0), (x, 0, 0), (x, 0, z), (0, 0, z)], (0, 1, 0), white),
        ("ceiling", [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)], (0, -1, 0), white),
        ("back wall", [(0, 0, z), (x, 0, z), (x, y, z), (0, y, z)], (0, 0, -1), white),
        ("left wall", [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)], (-1, 0, 0), red),
        ("right wall", [(0, 0, 0), (0, 0, z), (0, y, z), (0, y, 0)], (1, 0, 0), green),
        # Just below the ceiling: two surfaces in one plane would have no order.
        ("lamp", [(213, 548, 227), (343, 548, 227), (343, 548, 332), (213, 548, 332)], (0, -1, 0), lamp),
    ]
    for name, corners, facing, material in walls:
        gltf.node(name, mesh=gltf.mesh(name, (quad(mm(*corners), facing), material)))
    blocks = [
        ("short block", 165, [(130, 65), (82, 225), (240, 272), (290, 114)]),
        ("tall block", 330, [(423, 247), (265, 296), (314, 456), (472, 406)]),
    ]
    for name, height, outline in blocks:
        top = mm(*((px, height, pz) for px, pz in outline))
        gltf.node(name, mesh=gltf.mesh(name, (block(top, 0), white)))
    # A focal length of 35 mm before a film of 25 mm × 25 mm.
    yfov = round(2 * math.atan(12.5 / 35), 6)
    gltf.camera("camera", mul((278, 273, -800), 1e-3), mul((278, 273, 0), 1e-3), yfov=yfov, aspectRatio=1, znear=0.01)
    return gltf


def veach():
    gltf = Gltf("Veach's plates: neither light sampling nor BSDF sampling alone renders this well")
    dark = gltf.lambert("dark", (0.2, 0.2, 0.2))
    for name, corners, facing in [
        ("floor", [(-10, -4.15, -2), (10, -4.15, -2), (10, -4.15, 10), (-10, -4.15, 10)], (0, 1, 0)),
        ("back wall", [(-10, -4.15, -2), (10, -4.15, -2), (10, 10, -2), (-10, 10, -2)], (0, 0, 1)),
    ]:
        gltf.node(name, mesh=gltf.mesh(name, (quad(corners, facing), dark)))
    eye = (0, 2, 15)
    # Centre (y, z) and microfacet α; glTF's roughness is its square root.
    for y, z, alpha in [(-2.4, -0.1, 0.005), (-3.05, 0.9, 0.02), (-3.55, 2.2, 0.05), (-3.9, 3.6, 0.1)]:
        center = (0, y, z)
        # Tilted so that its middle mirrors the middle of the row of lights into the camera.
        normal = normalize(add(normalize(sub(eye, center)), normalize(mul(center, -1))))
        plate = rectangle(center, (4, 0, 0), mul(cross(normal, (1, 0, 0)), 0.5))
        metal = gltf.material(f"α = {alpha}", (0.5, 0.5, 0.5), 1, round(math.sqrt(alpha), 6))
        gltf.node(f"plate, α = {alpha}", mesh=gltf.mesh(f"plate, α = {alpha}", (plate, metal)))
    ball = gltf.geometry(icosphere(2))
    # The row's radiance goes with 1/radius², so that its spheres have equal power; the fill light has eight times that.
    row = [((x, 0, 0), r, 1 / r**2) for x, r in ((-3.75, 1 / 30), (-1.25, 0.1), (1.25, 0.3), (3.75, 0.9))]
    for i, (center, radius, radiance) in enumerate([*row, ((6, 5, 8), 0.5, 32)]):
        name = "fill light" if i == len(row) else f"light {i + 1}"
        glow = gltf.emitter(name, [round(radiance, 4)] * 3)
        gltf.node(name, mesh=gltf.mesh(name, (ball, glow)), translation=center, scale=[radius] * 3)
    gltf.camera("camera", eye, (0, -2, 2.5), yfov=round(math.radians(28), 6), aspectRatio=1.5, znear=0.1)
    return gltf


def furnace():
    gltf = Gltf("White furnace: a surface that loses no light cannot be seen")
    # Flat facets: on a convex body every reflection then leaves for the environment.
    ball = gltf.geometry(icosphere(4).flat())
    materials = [("Lambert", gltf.lambert("Lambert", (1, 1, 1)))]
    for roughness in (0, 0.25, 0.5, 0.75, 1):
        name = f"metal, roughness {roughness}"
        materials.append((name, gltf.material(name, (1, 1, 1), 1, roughness)))
    for i, (name, material) in enumerate(materials):
        place = (2.6 * (i % 3 - 1), 1.3 - 2.6 * (i // 3), 0)
        gltf.node(name, mesh=gltf.mesh(name, (ball, material)), translation=place)
    gltf.environment(radiance=[1, 1, 1])
    gltf.camera("camera", (0, 0, 14), (0, 0, 0), yfov=round(math.radians(28), 6), aspectRatio=1.5, znear=0.1)
    return gltf


SKY_WIDTH, SKY_HEIGHT = 256, 128
# The texel of the sun: 35° high, 110° to the right of the map's centre.
SUN_COLUMN, SUN_ROW = 206, 39
# Illuminance of a surface that faces the sun, lx.
SUN_ILLUMINANCE = (3.2, 2.9, 2.4)


def sky_direction(column, row):
    """Where the centre of a texel stands: u grows from behind over −X, −Z and +X."""
    phi = 2 * math.pi * ((column + 0.5) / SKY_WIDTH - 0.5)
    theta = math.pi * (row + 0.5) / SKY_HEIGHT
    return (math.sin(theta) * math.sin(phi), math.cos(theta), -math.sin(theta) * math.cos(phi))


def sky_map():
    sun = sky_direction(SUN_COLUMN, SUN_ROW)
    theta = math.pi * (SUN_ROW + 0.5) / SKY_HEIGHT
    sun_angle = 2 * math.pi / SKY_WIDTH * math.pi / SKY_HEIGHT * math.sin(theta)

    def texel(column, row):
        direction = sky_direction(column, row)
        if (column, row) == (SUN_COLUMN, SUN_ROW):
            return mul(SUN_ILLUMINANCE, 1 / sun_angle)
        height = direction[1]
        if height < 0:
            return (0.10, 0.09, 0.08)
        blue = math.sqrt(height)
        sky = add(mul((0.62, 0.66, 0.70), 1 - blue), mul((0.10, 0.20, 0.46), blue))
        nearness = sum(a * b for a, b in zip(direction, sun))
        return add(sky, mul((0.8, 0.6, 0.35), math.exp(30 * (nearness - 1))))

    return hdr(SKY_WIDTH, SKY_HEIGHT, texel)


def sun():
    gltf = Gltf("Sky with a small bright sun: the environment must be sampled where it is bright")
    ground = gltf.lambert("ground", (0.4, 0.38, 0.34))
    chalk = gltf.lambert("chalk", (0.8, 0.8, 0.8))
    paint = gltf.material("red paint", (0.55, 0.03, 0.03), 0, 0.15)
    gold = gltf.material("rough gold", (1.0, 0.77, 0.34), 1, 0.35)
    mirror = gltf.material("mirror", (0.95, 0.95, 0.95), 1, 0)
    plane = quad([(-600, 0, -600), (600, 0, -600), (600, 0, 600), (-600, 0, 600)], (0, 1, 0))
    gltf.node("ground", mesh=gltf.mesh("ground", (plane, ground)))
    ball = gltf.geometry(globe(64, 32))
    for name, material, place, radius in [
        ("painted sphere", paint, (-1.7, 0.8, 0.2), 0.8),
        ("chalk sphere", chalk, (0.35, 0.6, 0.9), 0.6),
        ("mirror sphere", mirror, (2.2, 1.0, -0.6), 1.0),
    ]:
        gltf.node(name, mesh=gltf.mesh(name, (ball, material)), translation=place, scale=[radius] * 3)
    ring = gltf.mesh("gold ring", (torus(0.7, 0.22, 64, 24), gold))
    tilt = axis_angle((1, 0, 0), 70)
    gltf.node("gold ring", mesh=ring, translation=(0.1, 0.9475, -1.2), rotation=tilt)
    pole = gltf.mesh("gnomon", (cuboid((-0.03, 0, -0.03), (0.03, 2.4, 0.03)), chalk))
    gltf.node("gnomon", mesh=pole, translation=(-0.6, 0, -2.2))
    gltf.environment(uri="sun.hdr", intensity=1, rotation=0)
    gltf.camera("camera", (0.3, 1.9, 7.5), (0.1, 0.75, 0), yfov=round(math.radians(36), 6), aspectRatio=1.6, znear=0.1)
    return gltf


def instances():
    gltf = Gltf("2048 instances of one ring: turned, stretched and mirrored, but stored once")
    ground = gltf.lambert("ground", (0.35, 0.35, 0.35))
    plane = quad([(-80, 0, -80), (80, 0, -80), (80, 0, 80), (-80, 0, 80)], (0, 1, 0))
    gltf.node("ground", mesh=gltf.mesh("ground", (plane, ground)))
    lacquer = gltf.material("lacquer", (0.72, 0.2, 0.06), 0, 0.3)
    ring = gltf.mesh("ring", (torus(0.5, 0.17, 24, 12), lacquer))
    numbers = random.Random(1)
    golden_angle = math.pi * (3 - math.sqrt(5))
    for i in range(2048):
        # A sunflower's pattern over a dome: even in density, without rows.
        radius = 0.36 * math.sqrt(i + 0.5)
        angle = i * golden_angle
        height = 0.7 + 4.5 * math.exp(-((radius / 7) ** 2))
        place = (radius * math.cos(angle), height, radius * math.sin(angle))
        z = 2 * numbers.random() - 1
        phi = 2 * math.pi * numbers.random()
        axis = (math.sqrt(1 - z * z) * math.cos(phi), math.sqrt(1 - z * z) * math.sin(phi), z)
        turn = axis_angle(axis, 360 * numbers.random())
        scale = [0.35 + 0.35 * numbers.random() for _ in range(3)]
        # Every third has an odd number of negative factors, which turns its triangles inside out.
        if i % 3 == 0:
            scale[i // 3 % 3] *= -1
        gltf.node(
            mesh=ring,
            translation=[round(c, 2) for c in place],
            rotation=[round(c, 4) for c in turn],
            scale=[round(c, 2) for c in scale],
        )
    gltf.light("lamp", "point", [1, 0.85, 0.65], 150, position=(5, 10, 6))
    gltf.light("sun", "directional", [1, 0.95, 0.85], 1.5, direction=(0.6, -1, -0.5))
    gltf.environment(radiance=[0.22, 0.28, 0.38])
    gltf.camera("camera", (0, 15, 31), (0, 1.2, -1), yfov=round(math.radians(38), 6), aspectRatio=1.6, znear=0.1)
    return gltf


def checker(x, y):
    dark = (x // 16 + y // 16) % 2 == 1
    return tuple(srgb(c) for c in ((0.12, 0.13, 0.15) if dark else (0.6, 0.58, 0.52)))


def hills(x, y):
    """A normal map of smooth hills, two by two: h = s/(2π) · cos 2πu · cos 2πv, +Y up."""
    u, v, steep = 2 * math.pi * (x + 0.5) / 32, 2 * math.pi * (y + 0.5) / 32, 0.6
    slope_u = -steep * math.sin(u) * math.cos(v)
    slope_v = -steep * math.cos(u) * math.sin(v)
    # v runs down the image, the map's Y up.
    normal = normalize((-slope_u, slope_v, 1))
    return tuple(unit((c + 1) / 2) for c in normal)


def leaf(x, y):
    """Alpha falls from the middle to the rim, so that the cutoff decides the outline."""
    u, v = (x + 0.5) / 64 * 2 - 1, (y + 0.5) / 64
    half_width = 0.75 * math.sin(math.pi * v) ** 0.8 * (1 - 0.4 * (1 - v))
    alpha = min(max(1 - 0.5 * abs(u) / max(half_width, 1e-3), 0), 1)
    vein = abs(u) < 0.05 or abs((abs(u) * 0.6 + v) * 8 % 1 - 0.5) < 0.06
    return (*(srgb(c) for c in ((0.35, 0.5, 0.12) if vein else (0.08, 0.32, 0.05))), unit(alpha))


def worn(x, y):
    """Roughness in G, metallic in B: polished metal bands in matt paint."""
    band = y // 8 % 2 == 0
    return (0, unit(0.15 if band else 0.8), unit(1 if band else 0))


def windows(x, y):
    lit = x % 16 in range(4, 12) and y % 16 in range(4, 12)
    return tuple(srgb(c) for c in ((1, 0.7, 0.3) if lit else (0, 0, 0)))


def lights():
    gltf = Gltf("A room corner that shows each supported feature of glTF once")
    add_room(gltf)
    add_exhibits(gltf)
    # The lamp hangs on its cord: a light below two nested transforms.
    cord = gltf.node("cord", translation=(-1.2, 2.4, -1.2))
    arm = gltf.node("arm", cord, rotation=axis_angle((0, 1, 0), 30), translation=(0, -0.5, 0))
    gltf.light("lamp", "point", [1, 0.75, 0.5], 1.6, parent=arm, position=(0.2, 0, 0))
    cone = {"innerConeAngle": 0.25, "outerConeAngle": 0.4}
    gltf.light("spot", "spot", [1, 1, 1], 16, position=(1.9, 2.6, 1.6), direction=(-1.4, -1.9, -1.5), spot=cone)
    gltf.light("daylight", "directional", [0.7, 0.85, 1], 0.5, direction=(-0.4, -1, -0.9))
    gltf.environment(radiance=[0.06, 0.06, 0.07])
    yfov = round(math.radians(36), 6)
    gltf.camera("camera", (2.9, 1.8, 3.9), (-0.35, 0.75, -0.45), yfov=yfov, aspectRatio=1.5, znear=0.1)
    gltf.camera("plan", (0, 4, 0), (0, 0, 0), type="orthographic", xmag=2.4, ymag=2.4, znear=0.1, zfar=10)
    return gltf


def add_room(gltf):
    tiles = gltf.texture(png(32, 32, checker), magFilter=NEAREST, minFilter=NEAREST, wrapS=REPEAT, wrapT=REPEAT)
    transform = {"KHR_texture_transform": {"scale": [4, 4], "offset": [0.125, 0]}}
    gltf.extensions.add("KHR_texture_transform")
    floor = gltf.material(
        "tiles", roughness=0.4, pbr={"baseColorTexture": {"index": tiles, "extensions": transform}}
    )
    bumps = gltf.texture(png(64, 64, hills), magFilter=LINEAR, minFilter=LINEAR, wrapS=REPEAT, wrapT=REPEAT)
    plaster = gltf.material(
        "plaster", (0.6, 0.6, 0.6), roughness=0.6, normalTexture={"index": bumps, "scale": 0.8}
    )
    painted = gltf.lambert("vertex colours", (1, 1, 1))
    gltf.node("floor", mesh=gltf.mesh("floor", (rectangle((0, 0, 0), (2, 0, 0), (0, 0, -2)), floor)))
    back = rectangle((0, 1.25, -2), (2, 0, 0), (0, 1.25, 0))
    back.uvs = [(4 * u, 2.5 * v) for u, v in back.uvs]
    gltf.node("back wall", mesh=gltf.mesh("back wall", (back, plaster)))
    side = rectangle((-2, 1.25, 0), (0, 0, -2), (0, 1.25, 0))
    side.colors = [(0.7, 0.25, 0.2), (0.25, 0.6, 0.3), (0.2, 0.3, 0.7), (0.7, 0.65, 0.3)]
    gltf.node("side wall", mesh=gltf.mesh("side wall", (side, painted)))


def add_exhibits(gltf):
    clamped = {"magFilter": LINEAR, "minFilter": LINEAR, "wrapS": REPEAT, "wrapT": CLAMP}
    wear = gltf.texture(png(32, 32, worn), **clamped)
    glow = gltf.texture(png(32, 32, windows), **clamped)
    foliage = gltf.texture(png(64, 64, leaf), **clamped)
    worn_paint = gltf.material(
        "worn paint", (0.75, 0.5, 0.35), 1, 1, pbr={"metallicRoughnessTexture": {"index": wear}}
    )
    lacquer = gltf.material(
        "lacquer",
        (0.05, 0.08, 0.25),
        roughness=0.1,
        extensions={
            "KHR_materials_ior": {"ior": 1.8},
            "KHR_materials_specular": {"specularFactor": 0.9, "specularColorFactor": [1, 0.8, 0.6]},
        },
    )
    lantern = gltf.emitter("lantern", (3, 3, 3), (0.05, 0.05, 0.05), emissiveTexture={"index": glow})
    ball = gltf.geometry(globe(48, 24), textured=True)
    for name, material, place, radius in [
        ("worn sphere", worn_paint, (-1.0, 0.45, -0.9), 0.45),
        ("lacquered sphere", lacquer, (0.75, 0.35, 0.25), 0.35),
        ("lantern", lantern, (1.35, 0.3, -1.3), 0.3),
    ]:
        gltf.node(name, mesh=gltf.mesh(name, (ball, material)), translation=place, scale=[radius] * 3)
    green = gltf.material(
        "leaf",
        roughness=0.7,
        pbr={"baseColorTexture": {"index": foliage}},
        alphaMode="MASK",
        alphaCutoff=0.5,
        doubleSided=True,
    )
    card = gltf.geometry(rectangle((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0)), textured=True)
    turn = axis_angle((0, 1, 0), 25)
    gltf.node("leaf", mesh=gltf.mesh("leaf", (card, green)), translation=(0.45, 0.52, -0.75), rotation=turn)
    film = gltf.material("film", (0.1, 0.35, 0.6, 0.45), roughness=0.5, alphaMode="BLEND", doubleSided=True)
    place = {"translation": (-0.95, 0.5, 0.3), "rotation": axis_angle((0, 1, 0), 40), "scale": (0.8, 1, 1)}
    gltf.node("film", mesh=gltf.mesh("film", (card, film)), **place)
    sign = gltf.material("sign", (0.8, 0.25, 0.02), roughness=0.9, extensions={"KHR_materials_unlit": {}})
    place = {"translation": (0.9, 1.6, -1.98), "scale": (0.5, 0.25, 1)}
    gltf.node("sign", mesh=gltf.mesh("sign", (card, sign)), **place)
    bead = gltf.mesh("bead", (icosphere(2), gltf.material("chrome", (0.9, 0.9, 0.9), 1, 0.05)))
    places = [(-1.5 + 0.3 * i, 0.09, 1.2) for i in range(8)]
    gltf.instances("beads", bead, places, [(0.09, 0.06 + 0.01 * i, 0.09) for i in range(8)])


SCENES = (cornell, veach, furnace, sun, instances, lights, *volumes.SCENES, *rooms.SCENES)


def files():
    """Name and content of everything that this program writes."""
    for scene in SCENES:
        yield f"{scene.__name__}.gltf", scene().text().encode()
    yield "sun.hdr", sky_map()


def main(arguments):
    if arguments not in ([], ["--check"]):
        sys.exit("usage: make.py [--check]")
    folder = Path(__file__).resolve().parent
    differing = []
    for name, content in files():
        path = folder / name
        if not arguments:
            path.write_bytes(content)
            print(f"{name}: {len(content)} bytes")
        elif not path.is_file() or path.read_bytes() != content:
            differing.append(name)
    if differing:
        sys.exit(f"not what make.py writes: {', '.join(differing)}")


if __name__ == "__main__":
    main(sys.argv[1:])
