"""How far a block of a linear elastic solid leans under its own weight turned sideways, by finite elements.

The truth that `main.rs` measures both engines against. A cube of 24 mm, Poisson's ratio 1/4, its bottom glued, all else
free, a body force along x. Small strain, Young's modulus and force per volume 1, so the answer, the mean movement of the top
along x, is in mm² and is to be multiplied by force per volume over modulus.

Quadratic hexahedra graded towards the edges of the bottom, where the stress is singular, on meshes of rising fineness; then
trilinear hexahedra on the cubes of the two lattices: what a method of that mesh width misses by, whatever its law.

To run: pip install scikit-fem==12.0.2 pyamg==5.4.1; python lean.py
"""

import numpy as np
import pyamg
from scipy.sparse.linalg import cg
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, ElementVector, FacetBasis, LinearForm, MeshHex, asm
from skfem.helpers import ddot, eye, sym_grad, trace

SIDE, RATIO = 24.0, 0.25
LAMBDA, MU = RATIO / ((1 + RATIO) * (1 - 2 * RATIO)), 0.5 / (1 + RATIO)
GRADING = 2.5


@BilinearForm
def stiffness(u, v, _):
    strain = sym_grad(u)
    return ddot(2 * MU * strain + LAMBDA * eye(trace(strain), 3), sym_grad(v))


@LinearForm
def along_x(v, _):
    return v[0]


def rigid_motions(places, component):
    motions = np.zeros((places.shape[1], 6))
    for c in range(3):
        motions[component == c, c] = 1.0
    for k, (a, b) in enumerate([(0, 1), (1, 2), (2, 0)]):
        motions[component == a, 3 + k] = -places[b, component == a]
        motions[component == b, 3 + k] = places[a, component == b]
    return motions


def lean(axes, element, quarter):
    """Mean movement of the top, mm². A quarter of the block has x and y from its middle."""
    mesh = MeshHex.init_tensor(*axes)
    basis = Basis(mesh, ElementVector(element), intorder=4)
    places = basis.doflocs
    component = np.arange(basis.N) % 3
    held = places[2] < 1e-9
    if quarter:
        held |= (places[1] < 1e-9) & (component == 1)
        held |= (places[0] < 1e-9) & (component != 0)
    free = np.flatnonzero(~held)
    matrix = asm(stiffness, basis).tocsr()[free][:, free]
    u = np.zeros(basis.N)
    levels = pyamg.smoothed_aggregation_solver(matrix, B=rigid_motions(places, component)[free], strength="symmetric")
    u[free], failed = cg(matrix, asm(along_x, basis)[free], rtol=1e-8, maxiter=4000, M=levels.aspreconditioner())
    assert failed == 0
    top = FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda x: x[2] > SIDE - 1e-9), intorder=4)
    area = (axes[0][-1] - axes[0][0]) * (axes[1][-1] - axes[1][0])
    return asm(along_x, top) @ u / area


def graded(length, elements):
    """From 0 to `length`, finest at `length`."""
    return length * (1 - (1 - np.linspace(0, 1, elements + 1)) ** GRADING)


for elements in (3, 5, 8, 10):
    across, up = graded(SIDE / 2, elements), SIDE - graded(SIDE, elements)[::-1]
    print(f"{elements} elements along half an edge: {lean((across, across, up), ElementHex2(), True):.4f} mm²", flush=True)
for cells in (9, 21):
    even = np.linspace(0, SIDE, cells + 1)
    print(f"trilinear, {cells} cells a side: {lean((even, even, even), ElementHex1(), False):.4f} mm²", flush=True)
