"""Triangle meshes. Triangles are counter-clockwise seen from outside, as glTF wants them;
texture coordinates start at the upper left."""

import math
from dataclasses import dataclass, field

from .vector import add, cross, dot, mean, mul, normalize, sub


@dataclass
class Shape:
    """Attributes by vertex, metres; an empty list is an attribute that is not written.

    Without normals glTF asks for flat shading."""

    positions: list
    triangles: list
    normals: list = field(default_factory=list)
    uvs: list = field(default_factory=list)
    colors: list = field(default_factory=list)

    def joined(self, other):
        """Both in one mesh."""
        offset = len(self.positions)
        moved = [tuple(i + offset for i in triangle) for triangle in other.triangles]
        return Shape(
            self.positions + other.positions,
            self.triangles + moved,
            self.normals + other.normals,
            self.uvs + other.uvs,
            self.colors + other.colors,
        )

    def flat(self):
        """Without normals."""
        return Shape(self.positions, self.triangles)


def quad(corners, facing):
    """Four coplanar corners in order around the quad; its normal points to the side of `facing`.

    The first corner is the upper left of the texture, the second its lower left."""
    normal = normalize(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])))
    uvs = [(0, 0), (0, 1), (1, 1), (1, 0)]
    if dot(normal, facing) < 0:
        corners, uvs = corners[::-1], uvs[::-1]
        normal = mul(normal, -1)
    return Shape(list(corners), [(0, 1, 2), (0, 2, 3)], [normal] * 4, uvs)


def rectangle(center, half_u, half_v):
    """Spans ±half_u and ±half_v about the centre; faces half_u × half_v; half_v is up in the texture."""
    corners = [
        add(center, add(mul(half_u, su), mul(half_v, sv)))
        for su, sv in ((-1, 1), (-1, -1), (1, -1), (1, 1))
    ]
    return quad(corners, cross(half_u, half_v))


def block(top, bottom_y):
    """An upright prism over four top corners, open below."""
    bottom = [(x, bottom_y, z) for x, _, z in top]
    center = mean(top + bottom)
    shape = quad(top, (0, 1, 0))
    for i in range(4):
        j = (i + 1) % 4
        side = [top[i], bottom[i], bottom[j], top[j]]
        shape = shape.joined(quad(side, sub(mean(side), center)))
    return shape


def cuboid(low, high):
    """An axis-aligned box, open below."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return block([(x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)], y0)


def solid_cuboid(low, high):
    """An axis-aligned box, closed."""
    (x0, y0, z0), (x1, _, z1) = low, high
    bottom = [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)]
    return cuboid(low, high).joined(quad(bottom, (0, -1, 0)))


def lathe(profile, columns, crease=40):
    """A closed body of revolution about +Y. `profile` holds (radius, y) and runs from the axis below to
    the axis above, with the body on its left; where it turns by less than `crease` degrees, normals are smooth."""
    facing = []
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        size = math.hypot(r1 - r0, y1 - y0)
        facing.append(((y1 - y0) / size, (r0 - r1) / size))
    smooth = math.cos(math.radians(crease))
    shape, rings = Shape([], []), {}

    def ring(point, segment, neighbour):
        normal = facing[segment]
        if 0 <= neighbour < len(facing) and dot(normal, facing[neighbour]) > smooth:
            # In this order, so that both segments find the same ring.
            first, second = sorted((segment, neighbour))
            normal = normalize(add(facing[first], facing[second]))
        if (point, normal) not in rings:
            rings[point, normal] = len(shape.positions)
            radius, y = profile[point]
            for column in range(columns):
                phi = 2 * math.pi * column / columns
                s, c = math.sin(phi), math.cos(phi)
                shape.positions.append((radius * s, y, radius * c))
                shape.normals.append((normal[0] * s, normal[1], normal[0] * c))
        return rings[point, normal]

    for i in range(len(facing)):
        low, high = ring(i, i, i - 1), ring(i + 1, i, i + 1)
        for column in range(columns):
            after = (column + 1) % columns
            # On the axis one of the two triangles has no area.
            if profile[i][0] > 0:
                shape.triangles.append((low + column, low + after, high + after))
            if profile[i + 1][0] > 0:
                shape.triangles.append((low + column, high + after, high + column))
    return shape


def basin(half, bottom_y, cells, height, slope):
    """A closed block over the square ±half; its top is the graph of height(x, z), whose derivatives are slope(x, z)."""
    shape = Shape([], [])
    at = lambda i: half * (2 * i / cells - 1)
    for j in range(cells + 1):
        for i in range(cells + 1):
            x, z = at(i), at(j)
            dx, dz = slope(x, z)
            shape.positions.append((x, height(x, z), z))
            shape.normals.append(normalize((-dx, 1, -dz)))
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i
            c = a + cells + 2
            shape.triangles += [(a, c - 1, c), (a, c, a + 1)]
    # Around the rim, counter-clockwise seen from above.
    side, back = range(cells), range(cells, 0, -1)
    rim = [(0, j) for j in side] + [(i, cells) for i in side] + [(cells, j) for j in back] + [(i, 0) for i in back]
    rim = [shape.positions[j * (cells + 1) + i] for i, j in rim]
    for a, b in zip(rim, rim[1:] + rim[:1]):
        under_a, under_b = (a[0], bottom_y, a[2]), (b[0], bottom_y, b[2])
        wall = quad([a, under_a, under_b, b], (a[0] + b[0], 0, a[2] + b[2]))
        floor = Shape([under_b, under_a, (0, bottom_y, 0)], [(0, 1, 2)], [(0, -1, 0)] * 3)
        shape = shape.joined(Shape(wall.positions, wall.triangles, wall.normals)).joined(floor)
    return shape


def icosphere(subdivisions):
    """Unit sphere of 20·4ⁿ nearly equal triangles, without texture coordinates."""
    g = (1 + math.sqrt(5)) / 2
    vertices = [
        normalize(v)
        for a in (-1, 1)
        for b in (-g, g)
        for v in ((0, a, b), (a, b, 0), (b, 0, a))
    ]
    edge = 1.1  # longer than an edge (1.051), shorter than the next distance (1.701)
    near = lambda i, j: dot(sub(vertices[i], vertices[j]), sub(vertices[i], vertices[j])) < edge**2
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if near(i, j) and near(j, k) and near(i, k):
                    a, b, c = vertices[i], vertices[j], vertices[k]
                    outward = dot(cross(sub(b, a), sub(c, a)), a) > 0
                    triangles.append((i, j, k) if outward else (i, k, j))
    for _ in range(subdivisions):
        triangles = _split(vertices, triangles)
    return Shape(vertices, triangles, list(vertices))


def _split(vertices, triangles):
    """Each triangle in four; new vertices are pushed out to the unit sphere."""
    middles = {}

    def middle(i, j):
        key = (min(i, j), max(i, j))
        if key not in middles:
            middles[key] = len(vertices)
            vertices.append(normalize(add(vertices[i], vertices[j])))
        return middles[key]

    result = []
    for i, j, k in triangles:
        ij, jk, ki = middle(i, j), middle(j, k), middle(k, i)
        result += [(i, ij, ki), (ij, j, jk), (ki, jk, k), (ij, jk, ki)]
    return result


def globe(columns, rows):
    """Unit sphere with texture coordinates: u runs east, v from the north pole (+Y) down."""
    shape = Shape([], [])
    for row in range(rows + 1):
        theta = math.pi * row / rows
        for column in range(columns + 1):
            phi = 2 * math.pi * column / columns
            point = (
                math.sin(theta) * math.sin(phi),
                math.cos(theta),
                math.sin(theta) * math.cos(phi),
            )
            shape.positions.append(point)
            shape.normals.append(point)
            shape.uvs.append((column / columns, row / rows))
    for row in range(rows):
        for column in range(columns):
            a = row * (columns + 1) + column
            b = a + columns + 1
            # At a pole one of the two triangles has no area.
            if row > 0:
                shape.triangles.append((a, b, a + 1))
            if row < rows - 1:
                shape.triangles.append((a + 1, b, b + 1))
    return shape


def torus(major, minor, columns, rows):
    """A ring around +Y: `major` is the radius of the circle in its middle, `minor` of the tube, metres."""
    shape = Shape([], [])
    for column in range(columns):
        phi = 2 * math.pi * column / columns
        radial = (math.sin(phi), 0, math.cos(phi))
        for row in range(rows):
            theta = 2 * math.pi * row / rows
            normal = add(mul(radial, math.cos(theta)), (0, math.sin(theta), 0))
            shape.positions.append(add(mul(radial, major), mul(normal, minor)))
            shape.normals.append(normal)
    for column in range(columns):
        for row in range(rows):
            a = column * rows + row
            b = (column + 1) % columns * rows + row
            c = (column + 1) % columns * rows + (row + 1) % rows
            d = column * rows + (row + 1) % rows
            shape.triangles += [(a, b, c), (a, c, d)]
    return shape
