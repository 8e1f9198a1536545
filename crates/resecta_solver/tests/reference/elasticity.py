"""Blocks of a linear elastic solid under four loadings, by finite elements: what tests/materials.rs compares with.

Small strain, Young's modulus 1, so every stiffness (force over displacement) is in mm and is to be multiplied by the
modulus. Quadratic hexahedra, graded towards the edges where the stress is singular, on meshes of rising fineness. What is
written is the finest mesh's answer; `change_percent` is by how much the last refinement changed it.

The blocks stand on z = 0 in x, y within plus or minus half their width. Loadings:
  stretch  the ends moved apart without friction, sides free (exact: width² / height)
  shear    the top plate moved along x, both plates glued
  squeeze  the plates moved together, both glued
  indent   a square of the top, glued to a rigid punch, moved down; the bottom glued, all else free

`coarse_stiffness_over_modulus_mm` has the answers of trilinear hexahedra on the cells of the test's lattices: what a method
of that mesh width misses by, whatever its material law.

To make elasticity.json again: pip install scikit-fem==12.0.2 pyamg==5.4.1; python elasticity.py
"""

import functools
import json
import pathlib

import numpy as np
import pyamg
from scipy import sparse
from scipy.sparse.linalg import cg, spsolve
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, MeshHex, asm
from skfem.helpers import grad

HEX1, HEX2 = ElementHex1(), ElementHex2()

RATIOS = [0.0, 0.25, 0.3, 0.4, 0.45, 0.49]
CUBE, SLENDER = (24.0, 24.0), (12.0, 48.0)  # width, height in mm
PUNCH = 6.0  # half the punch's width in mm
MESHES = [3, 5, 8]  # elements along half an edge
GRADING = 2.5
CELLS = [(2, 2, 2), (2, 2, 4), (2, 6, 2), (6, 2, 6), (2, 3, 2)]


def graded(length, elements):
    """From 0 to `length`, finest at `length`."""
    return length * (1.0 - (1.0 - np.linspace(0.0, 1.0, elements + 1)) ** GRADING)


def both_sides(middle, length, elements):
    """From 0 to `length`, finest at `middle` on both sides."""
    inner = graded(middle, elements)
    outer = length - graded(length - middle, elements)[::-1]
    return np.concatenate([inner, outer[1:]])


@functools.cache
def gradients(axes, element):
    """Places of the unknowns of a scalar, the mesh, and the integrals of d_a v d_b u over it for all a, b."""
    mesh = MeshHex.init_tensor(*axes)
    basis = Basis(mesh, element, intorder=4)
    product = lambda a, b: BilinearForm(lambda u, v, w: grad(v)[a] * grad(u)[b])
    parts = {(a, b): asm(product(a, b), basis).tocsr() for a in range(3) for b in range(a, 3)}
    parts.update({(b, a): parts[a, b].T.tocsr() for a in range(3) for b in range(a + 1, 3)})
    return mesh, basis, parts


def stiffness_matrix(parts, ratio):
    """The three displacements of each place stand together."""
    lam, mu = ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), 0.5 / (1.0 + ratio)
    laplacian = parts[0, 0] + parts[1, 1] + parts[2, 2]
    total = 0
    for a in range(3):
        for b in range(3):
            block = lam * parts[a, b] + mu * parts[b, a] + (mu * laplacian if a == b else 0 * laplacian)
            unit = np.zeros((3, 3))
            unit[a, b] = 1.0
            total = total + sparse.kron(block, unit)
    return total.tocsr()


def rigid_motions(x):
    motions = np.zeros((x.shape[1] * 3, 6))
    for c in range(3):
        motions[c::3, c] = 1.0
    for k, (a, b) in enumerate([(0, 1), (1, 2), (2, 0)]):
        motions[a::3, 3 + k] = -x[b]
        motions[b::3, 3 + k] = x[a]
    return motions


def solve(axes, element, ratio, held, samples):
    """A box of hexahedra, solved for given displacements.

    `held` lists (predicate over places, component, displacement); later entries win. Gives twice the energy and the
    displacements at `samples` (places that are corners of the mesh).
    """
    mesh, basis, parts = gradients(tuple(map(tuple, axes)), element)
    stiffness = stiffness_matrix(parts, ratio)
    places = basis.doflocs
    u = np.zeros(3 * basis.N)
    fixed = np.zeros(3 * basis.N, dtype=bool)
    for predicate, c, value in held:
        which = 3 * np.flatnonzero(predicate(places)) + c
        u[which] = value
        fixed[which] = True
    free = np.flatnonzero(~fixed)
    matrix = stiffness[free][:, free].tocsr()
    load = -(stiffness @ u)[free]
    if free.size < 3000:
        u[free] = spsolve(matrix.tocsc(), load)
    else:
        levels = pyamg.smoothed_aggregation_solver(matrix, B=rigid_motions(places)[free], strength="symmetric")
        u[free], failed = cg(matrix, load, rtol=1e-7, maxiter=4000, M=levels.aspreconditioner())
        assert failed == 0
    answers = []
    for place in samples:
        corner = np.argmin(np.sum((mesh.p.T - place) ** 2, axis=1))
        assert np.allclose(mesh.p[:, corner], place), place
        answers.append(u[3 * basis.nodal_dofs[0, corner] :][:3])
    return float(u @ (stiffness @ u)), answers


def at(axis, value):
    return lambda x: np.abs(x[axis] - value) < 1e-9


def loading(name, block, ratio, element, axes_of):
    """Stiffness in mm and samples of displacement for the punch or plate moved by 1 mm."""
    width, height = block
    half, mid = width / 2, height / 2
    top = lambda x: at(2, height)(x)
    if name == "indent":
        # A quarter of the block.
        axes = axes_of(half, half, height, True)
        under = lambda x: top(x) & (x[0] < PUNCH + 1e-9) & (x[1] < PUNCH + 1e-9)
        held = [(at(0, 0.0), 0, 0.0), (at(1, 0.0), 1, 0.0)]
        held += [(at(2, 0.0), c, 0.0) for c in range(3)]
        held += [(under, 0, 0.0), (under, 1, 0.0), (under, 2, -1.0)]
        energy, (middle, rim) = solve(axes, element, ratio, held, [(0.0, 0.0, mid), (half, 0.0, height)])
        return 4.0 * energy, {"uz_at_half_depth": middle[2], "uz_at_rim": rim[2]}
    # An eighth: x, y from 0, z from the middle, with the upper plate moved by half a millimetre.
    axes = axes_of(half, half, mid, False)
    plate = at(2, mid)
    side = [(half, 0.0, 0.0)]
    if name == "stretch":
        held = [(at(c, 0.0), c, 0.0) for c in range(3)] + [(plate, 2, 0.5)]
        energy, (bulge,) = solve(axes, element, ratio, held, side)
        return 8.0 * energy, {"ux_at_side": bulge[0]}
    if name == "squeeze":
        held = [(at(c, 0.0), c, 0.0) for c in range(3)]
        held += [(plate, 0, 0.0), (plate, 1, 0.0), (plate, 2, -0.5)]
        energy, (bulge,) = solve(axes, element, ratio, held, side)
        return 8.0 * energy, {"ux_at_side": bulge[0]}
    held = [(at(1, 0.0), 1, 0.0)]
    held += [(at(0, 0.0), c, 0.0) for c in (1, 2)] + [(at(2, 0.0), c, 0.0) for c in (0, 1)]
    held += [(plate, 0, 0.5), (plate, 1, 0.0), (plate, 2, 0.0)]
    energy, (end,) = solve(axes, element, ratio, held, side)
    return 8.0 * energy, {"uz_at_side": end[2]}


def fine(elements):
    def axes_of(x, y, z, punch):
        if punch:
            return both_sides(PUNCH, x, elements), both_sides(PUNCH, y, elements), graded(z, 2 * elements)
        # Slender blocks get more elements along their length.
        more = max(1, round(z / x / 1.5))
        return graded(x, elements), graded(y, elements), graded(z, more * elements)

    return axes_of


def even(cell):
    def axes_of(x, y, z, punch):
        return [np.linspace(0.0, length, round(length / edge) + 1) for length, edge in zip((x, y, z), cell)]

    return axes_of


def with_middle(axes_of, mid):
    """Adds the middle height, where a sample is taken."""

    def inner(x, y, z, punch):
        ax, ay, az = axes_of(x, y, z, punch)
        if punch and not np.any(np.isclose(az, mid)):
            az = np.sort(np.append(az, mid))
        return ax, ay, az

    return inner


def main():
    cases = []
    for block in (CUBE, SLENDER):
        for name in ("stretch", "shear", "squeeze", "indent"):
            if name == "indent" and block != CUBE:
                continue
            for ratio in RATIOS:
                rows = []
                for elements in MESHES:
                    axes_of = with_middle(fine(elements), block[1] / 2)
                    rows.append(loading(name, block, ratio, HEX2, axes_of))
                (before, _), (stiffness, samples) = rows[-2:]
                coarse = {}
                if ratio == 0.25:
                    for cell in CELLS:
                        value, _ = loading(name, block, ratio, HEX1, even(cell))
                        coarse["x".join(map(str, cell))] = round(value, 5)
                case = {
                    "loading": name,
                    "width_mm": block[0],
                    "height_mm": block[1],
                    "poisson_ratio": ratio,
                    "stiffness_over_modulus_mm": round(stiffness, 5),
                    "change_percent": round(100.0 * abs(stiffness / before - 1.0), 4),
                    "displacements_per_mm": {key: round(float(value), 5) for key, value in samples.items()},
                }
                if coarse:
                    case["coarse_stiffness_over_modulus_mm"] = coarse
                print(case, flush=True)
                cases.append(case)
    where = pathlib.Path(__file__).with_suffix(".json")
    where.write_text("[\n" + ",\n".join("  " + json.dumps(case) for case in cases) + "\n]\n")


main()
