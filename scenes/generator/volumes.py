"""The scenes of glass, water and fog."""

import math

from .gltf import Gltf
from .images import png, srgb
from .shapes import basin, cuboid, icosphere, lathe, rectangle, solid_cuboid
from .vector import axis_angle

NEAREST, REPEAT = 9728, 10497


def view(gltf, eye, target, degrees, aspect=1.6):
    gltf.camera("camera", eye, target, yfov=round(math.radians(degrees), 6), aspectRatio=aspect, znear=0.01)


def checkered(gltf, name, light, dark):
    """A diffuse material of two texels by two."""
    texel = lambda x, y: tuple(srgb(c) for c in (dark if x == y else light))
    sampler = {"magFilter": NEAREST, "minFilter": NEAREST, "wrapS": REPEAT, "wrapT": REPEAT}
    texture = gltf.texture(png(2, 2, texel), **sampler)
    return gltf.lambert(name, (1, 1, 1), pbr={"baseColorTexture": {"index": texture}})


def tiled(shape, columns, rows):
    """Repeats the texture."""
    shape.uvs = [(columns * u, rows * v) for u, v in shape.uvs]
    return shape


def lamp(gltf, center, half_x, half_z, radiance):
    """A rectangle that shines down."""
    shape = rectangle(center, (half_x, 0, 0), (0, 0, half_z))
    gltf.node("lamp", mesh=gltf.mesh("lamp", (shape, gltf.emitter("lamp", radiance))))


def glass():
    gltf = Gltf("Glass: smooth, rough, tinted and thin")
    ground = checkered(gltf, "ground", (0.55, 0.53, 0.5), (0.16, 0.17, 0.2))
    gltf.node("ground", mesh=gltf.mesh("ground", (tiled(rectangle((0, 0, 0), (8, 0, 0), (0, 0, -8)), 16, 16), ground)))
    clear = gltf.solid("clear glass", 1.5)
    frosted = gltf.solid("frosted glass", 1.5, roughness=0.3)
    bottle = gltf.solid("bottle glass", 1.52, attenuation=((0.35, 0.85, 0.55), 0.5))
    crystal = gltf.solid("crystal", 1.9, attenuation=((0.95, 0.35, 0.45), 0.5))
    ball = gltf.mesh("sphere", (icosphere(3), clear))
    gltf.node("sphere", mesh=ball, translation=(0.25, 0.602, 0.7), scale=[0.6] * 3)
    cube = gltf.mesh("cube", (solid_cuboid((-0.42, 0, -0.42), (0.42, 0.84, 0.42)), frosted))
    gltf.node("cube", mesh=cube, translation=(1.75, 0.002, 0.1), rotation=axis_angle((0, 1, 0), 28))
    slab = gltf.mesh("slab", (solid_cuboid((-0.5, 0, -0.15), (0.5, 1.3, 0.15)), bottle))
    gltf.node("slab", mesh=slab, translation=(-1.85, 0.002, -0.3), rotation=axis_angle((0, 1, 0), 35))
    cut = [(0, 0), (0.42, 0.46), (0.42, 0.5), (0.26, 0.66), (0, 0.66)]
    gem = gltf.mesh("gem", (lathe(cut, 8, crease=0).flat(), crystal))
    # On its table, the point up.
    gltf.node("gem", mesh=gem, translation=(-0.95, 0.662, 1.4), rotation=axis_angle((1, 0, 0.2), 180))
    for name, x, material in [
        ("clear pane", -0.5, gltf.sheet("window")),
        ("frosted pane", 0.55, gltf.sheet("frosted window", roughness=0.35)),
    ]:
        pane = rectangle((x, 0.9, -1.1), (0.5, 0, 0), (0, 0.88, 0))
        gltf.node(name, mesh=gltf.mesh(name, (pane, material)))
    sign = rectangle((0.02, 1.0, -1.9), (0.75, 0, 0), (0, 0.3, 0))
    gltf.node("sign", mesh=gltf.mesh("sign", (sign, gltf.emitter("sign", (1.6, 0.8, 0.3)))))
    lamp(gltf, (-1.0, 4.5, 1.5), 0.9, 0.9, (13, 12.5, 11.5))
    gltf.environment(radiance=[0.16, 0.19, 0.24])
    view(gltf, (0.3, 2.1, 6.4), (-0.05, 0.62, 0), 30)
    return gltf


def nested():
    gltf = Gltf("Nested dielectrics: ice in a drink in a glass, whose meshes overlap")
    ground = checkered(gltf, "table", (0.6, 0.56, 0.5), (0.32, 0.27, 0.22))
    table = tiled(rectangle((0, 0, 0), (0.6, 0, 0), (0, 0, -0.6)), 15, 15)
    gltf.node("table", mesh=gltf.mesh("table", (table, ground)))
    # Outside up, over the rim, inside down; metres.
    outside = [(0, 0), (0.027, 0), (0.0287, 0.0004), (0.0297, 0.0014), (0.0301, 0.0031)]
    turns = [math.radians(36 * i) for i in range(6)]
    rim = [(0.0368 + 0.0012 * math.cos(a), 0.0975 + 0.0012 * math.sin(a)) for a in turns]
    inside = [(0.0282, 0.014), (0.027, 0.0115), (0.0245, 0.01), (0, 0.0095)]
    tumbler = gltf.solid("glass", 1.5, medium={"priority": 2})
    gltf.node("glass", mesh=gltf.mesh("glass", (lathe(outside + rim + inside, 48, crease=45), tumbler)), translation=(0, 0.0002, 0))
    # Reaches to the middle of the wall and of the bottom: the glass, of higher priority, cuts it off.
    surface = [(0.0344, 0.07), (0.0332, 0.0696), (0.0318, 0.0692), (0.029, 0.069), (0, 0.069)]
    tea = gltf.solid("tea", 1.33, attenuation=((0.9, 0.5, 0.13), 0.04), medium={"priority": 1})
    body = lathe([(0, 0.005), (0.0285, 0.005), *surface], 48)
    gltf.node("tea", mesh=gltf.mesh("tea", (body, tea)), translation=(0, 0.0002, 0))
    # As high in priority as the tea and smaller, so that it displaces the tea.
    ice = gltf.solid("ice", 1.31, medium={"priority": 1})
    cube = gltf.mesh("ice", (solid_cuboid([-0.011] * 3, [0.011] * 3), ice))
    for name, place, size, turn in [
        ("ice", (-0.009, 0.0635, 0.007), 1, axis_angle((0.2, 1, 0.15), 25)),
        ("more ice", (0.0125, 0.0635, -0.011), 0.8, axis_angle((0.4, 1, -0.3), 50)),
    ]:
        gltf.node(name, mesh=cube, translation=place, scale=[size] * 3, rotation=turn)
    lamp(gltf, (-0.25, 0.45, -0.2), 0.16, 0.16, (9, 8.5, 8))
    gltf.environment(radiance=[0.35, 0.4, 0.48])
    view(gltf, (0.05, 0.19, 0.33), (0, 0.043, 0), 24, aspect=1.2)
    return gltf


def fog():
    gltf = Gltf("Fog: a lamp's halo, a spot light's beam, and shadows in the air")
    gltf.medium(scattering=[0.05, 0.05, 0.05], absorption=[0.004, 0.003, 0.002], phase="henyey-greenstein", g=0.4)
    ground = gltf.lambert("ground", (0.3, 0.29, 0.27))
    stone = gltf.lambert("stone", (0.6, 0.57, 0.52))
    plane = rectangle((0, 0, 0), (30, 0, 0), (0, 0, -30))
    gltf.node("ground", mesh=gltf.mesh("ground", (plane, ground)))
    column = gltf.mesh("column", (cuboid((-0.4, 0, -0.4), (0.4, 4.5, 0.4)), stone))
    for i, (x, z) in enumerate([(-2.6, 1.4), (-1.2, -2.8), (1.6, 1.8), (2.9, -1.6), (-5.4, -3.0), (5.8, 0.6)]):
        turn = axis_angle((0, 1, 0), 17 * i)
        gltf.node(f"column {i + 1}", mesh=column, translation=(x, 0, z), rotation=turn)
    block = gltf.mesh("block", (cuboid((-0.7, 0, -0.5), (0.7, 0.8, 0.5)), stone))
    gltf.node("block", mesh=block, translation=(0.2, 0, 3.2), rotation=axis_angle((0, 1, 0), 20))
    bulb = gltf.mesh("lamp", (icosphere(1).flat(), gltf.emitter("lamp", (60, 43, 22))))
    gltf.node("lamp", mesh=bulb, translation=(0.3, 2.3, -0.4), scale=[0.45] * 3)
    cone = {"innerConeAngle": 0.1, "outerConeAngle": 0.15}
    gltf.light("spot", "spot", [0.75, 0.88, 1], 2500, position=(-13, 9, -2), direction=(16, -8.8, 2.6), spot=cone)
    view(gltf, (0.6, 2.6, 13), (0, 1.9, 0), 36)
    return gltf


def rayleigh():
    gltf = Gltf("Rayleigh sky: air that scatters blue light out of a low sun's")
    # An ellipsoid of 50 m × 8 m × 50 m about the camera: τ = 0.2 upwards and 1.25 towards the horizon, at 550 nm.
    air = gltf.solid("air", 1, medium={"rayleigh550": 0.025})
    dome = gltf.mesh("air", (icosphere(3).flat(), air))
    gltf.node("air", mesh=dome, scale=(50, 8, 50))
    ground = gltf.lambert("ground", (0.06, 0.06, 0.055))
    plane = rectangle((0, 0, 0), (80, 0, 0), (0, 0, -80))
    gltf.node("ground", mesh=gltf.mesh("ground", (plane, ground)))
    chalk = gltf.lambert("chalk", (0.3, 0.3, 0.3))
    for i, (x, z, size, height) in enumerate([(-3.5, -2, 0.8, 2.6), (0.5, -5, 1.2, 1.2), (3.6, -3, 0.6, 3.4)]):
        stone = cuboid((-size / 2, 0, -size / 2), (size / 2, height, size / 2))
        turn = axis_angle((0, 1, 0), 50 - 12 * i)
        name = f"stone {i + 1}"
        gltf.node(name, mesh=gltf.mesh(name, (stone, chalk)), translation=(x, 0, z), rotation=turn)
    # 9° high, to the left and behind.
    gltf.light("sun", "directional", [1, 1, 1], 16, direction=(0.85, -0.16, -0.53))
    view(gltf, (0, 1.6, 6), (0, 2.3, 0), 48)
    return gltf


# Ripples on the pool: amplitude, wave numbers along x and z, 1/m, and phase.
RIPPLES = [(0.035, 7.5, 0.9, 0.3), (0.02, -10.5, 1.6, 1.7), (0.012, 4.1, -2.2, 4.1), (0.006, 15, 2, 2.6)]


def ripple(x, z):
    return 0.8 + sum(a * math.sin(kx * x + kz * z + phase) for a, kx, kz, phase in RIPPLES)


def ripple_slope(x, z):
    slopes = [(a * math.cos(kx * x + kz * z + phase), kx, kz) for a, kx, kz, phase in RIPPLES]
    return sum(s * kx for s, kx, _ in slopes), sum(s * kz for s, _, kz in slopes)


def caustic():
    gltf = Gltf("Caustics: a narrow lamp through rippled water onto the floor of a pool")
    # The water reaches into walls and floor, which end it: no two surfaces share a plane.
    water = gltf.solid("water", 1.33, attenuation=((0.62, 0.88, 0.94), 1))
    body = basin(1.55, -0.1, 36, ripple, ripple_slope)
    gltf.node("water", mesh=gltf.mesh("water", (body, water)))
    tile = checkered(gltf, "tiles", (0.75, 0.75, 0.72), (0.55, 0.62, 0.66))
    floor = tiled(rectangle((0, 0, 0), (1.5, 0, 0), (0, 0, -1.5)), 5, 5)
    gltf.node("floor", mesh=gltf.mesh("floor", (floor, tile)))
    plaster = gltf.lambert("plaster", (0.7, 0.68, 0.64))
    for name, low, high in [
        ("back wall", (-1.8, -0.2, -1.8), (1.8, 1.1, -1.5)),
        ("left wall", (-1.8, -0.2, -1.5), (-1.5, 1.1, 1.8)),
        ("right wall", (1.5, -0.2, -1.5), (1.8, 1.1, 1.8)),
        ("front wall", (-1.5, -0.2, 1.5), (1.5, 1.1, 1.8)),
    ]:
        gltf.node(name, mesh=gltf.mesh(name, (cuboid(low, high), plaster)))
    lamp(gltf, (0.2, 2.7, -0.4), 0.25, 1.6, (13, 12.3, 11))
    gltf.environment(radiance=[0.1, 0.13, 0.17])
    view(gltf, (0.2, 3.6, 3.6), (0, 0.25, -0.1), 36)
    return gltf


SCENES = (glass, nested, fog, rayleigh, caustic)
