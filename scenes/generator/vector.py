"""Vectors as tuples of three floats, and rotations as glTF's quaternions (x, y, z, w)."""

import math


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def mul(a, s):
    return tuple(x * s for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def length(a):
    return math.sqrt(dot(a, a))


def normalize(a):
    return mul(a, 1 / length(a))


def mean(points):
    return mul(tuple(map(sum, zip(*points))), 1 / len(points))


def axis_angle(axis, degrees):
    """Right-handed rotation about an axis."""
    half = math.radians(degrees) / 2
    return (*mul(normalize(axis), math.sin(half)), math.cos(half))


def look_along(direction, up=(0, 1, 0)):
    """Turns −Z, where glTF's cameras and lights look, to `direction`, and +Y towards `up`."""
    z = mul(normalize(direction), -1)
    if length(cross(up, z)) < 1e-6:
        up = (0, 0, -1)
    x = normalize(cross(up, z))
    y = cross(z, x)
    # The rotation matrix has columns x, y, z; its largest quaternion entry is found first
    # so that nothing is divided by a small number.
    squares = (
        1 + x[0] - y[1] - z[2],
        1 - x[0] + y[1] - z[2],
        1 - x[0] - y[1] + z[2],
        1 + x[0] + y[1] + z[2],
    )
    largest = max(range(4), key=lambda i: squares[i])
    s = 0.5 / math.sqrt(squares[largest])
    products = {
        0: (squares[0] * s, (x[1] + y[0]) * s, (z[0] + x[2]) * s, (y[2] - z[1]) * s),
        1: ((x[1] + y[0]) * s, squares[1] * s, (y[2] + z[1]) * s, (z[0] - x[2]) * s),
        2: ((z[0] + x[2]) * s, (y[2] + z[1]) * s, squares[2] * s, (x[1] - y[0]) * s),
        3: ((y[2] - z[1]) * s, (z[0] - x[2]) * s, (x[1] - y[0]) * s, squares[3] * s),
    }
    return products[largest]
