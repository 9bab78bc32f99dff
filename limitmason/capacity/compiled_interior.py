"""Compiled sums over the contact points of an interior path; see :mod:`limitmason.capacity.interior`.

Forces are in mean block weights, displacements in elastic lengths. A point has c components, normal first. Rows are
those of its spare strength, bound + sign N, of a point ``row[r]``: ``sign[r]`` is 1 against opening, -1 against
crushing. ``axes`` is any tuple of c numbers: its length is known to the compiler, which writes out the loops over
components. Vectors of a point are pairs as in :class:`.interior.Inner`: (a, T), the limit of the shear and the shear,
and (p, d), size and components of the slip.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_BISECTIONS = 50
"""Steps towards a root at most: 50 halvings alone come to rounding."""


@njit(cache=True, error_model="numpy")
def sheared(
    tried: Array, strength: Array, ks: Array, product: float, cone: Array, slid: Array
) -> None:
    """Write shear and slip of the smoothed Coulomb law, from the trial shear.

    With a the limit of the shear T the slip has the size p = mu a / (a^2 - T^2), against the shear: d = -p T / a. The
    springs give T = T_trial - ks p T / a. As mu goes to zero, T < a means p = 0.

    Parameters
    ----------
    tried : trial shear T_trial, components from 1 on, shape (m, c)
    strength, ks : limit a and shear stiffness of every point, shape (m,)
    product : mu, the value of a p + T . d
    cone, slid : written: (a, T) and (p, d), shape (m, c)
    """
    # at T = 0 the slip is mu / a: it would be infinite at no limit, while at a kink both are of the size sqrt(mu)
    least = 1e-3 * np.sqrt(product)
    for m in range(len(strength)):
        most = max(strength[m], least)
        size = 0.0
        for j in range(1, tried.shape[1]):
            size += tried[m, j] * tried[m, j]
        size = np.sqrt(size)
        # |T| = held solves held (1 + ks mu / (a^2 - held^2)) = |T_trial|, which has one root between these
        low, high = 0.0, min(most, size)
        held, soft = 0.5 * high, ks[m] * product
        for _ in range(_BISECTIONS):
            spare = max((most - held) * (most + held), 1e-300)
            over = held * (1.0 + soft / spare) - size
            if over < 0.0:
                low = held
            else:
                high = held
            # Newton's method, halved in where it leaves the bracket
            on = held - over / (1.0 + soft / spare + 2.0 * soft * (held / spare) * (held / spare))
            on = on if low < on < high else 0.5 * (low + high)
            if abs(on - held) <= 1e-15 * most:  # the last digit
                break
            held = on
        slip = product * most / max((most - held) * (most + held), 1e-300)
        cone[m, 0], slid[m, 0] = most, slip
        for j in range(1, tried.shape[1]):
            cone[m, j] = tried[m, j] * (held / max(size, 1e-300))
            slid[m, j] = -cone[m, j] * (slip / most)


@njit(cache=True, error_model="numpy")
def linearised(
    axes: tuple[int, ...], laws: tuple[Array, Array, Array], stiff: Array, rows: tuple[Index, Array, Array],
    state: tuple[Array, ...], elastic: Array,
    linear: tuple[Array, ...],
) -> bool:
    """Write the linear equations of the points about a state, or return False where one is singular.

    Parameters
    ----------
    axes : any tuple of c numbers
    laws : tan(phi), tan(psi) and shear strength at no pressure of every point, shapes (m,)
    stiff : normal and shear stiffness of every point, shape (m, c)
    rows : point, sign and bound of every row of spare strength, shapes (r,)
    state : fields of ``interior.Inner`` in their order: normal force, (m,); (a, T), (m, c); (p, d), (m, c); spare
        strength, (r,); and the opening or crushing that goes with it, (r,)
    elastic : forces without limits, shape (m, c)
    linear : written, fields of ``interior._Linear`` in their order: inverse of the arrow matrix of (a, T), its product
        with that of the slip, stiffness of the points, (m, c, c) each; what springs lack, (m, c), what limits of shear
        lack, (m,), and what spare strengths lack, (r,)
    """
    tan_phi, tan_psi, strength = laws
    row, sign, bound = rows
    normal, cone, slid, spare, given = state
    inverse, across, tangent, off, cone_off, lacks = linear
    m, c = len(cone), len(axes)
    # of every point: opening less crushing, and the compliance that its rows of spare strength add
    lifted, soft = np.zeros(m), np.zeros(m)
    for r in range(len(row)):
        k = row[r]
        lifted[k] += sign[r] * given[r]
        soft[k] += given[r] / spare[r]
        lacks[r] = spare[r] - bound[r] - sign[r] * normal[k]
    comp, unit = np.empty((c, c)), np.empty((c, c))
    for k in range(m):
        first = cone[k, 0]
        size = 0.0
        for j in range(1, c):
            size += cone[k, j] * cone[k, j]
        size = np.sqrt(size)
        # the arrow matrix of x takes y to (x . y, x0 y' + y0 x'); its inverse is that of a second-order cone's pair
        inside = (first - size) * (first + size)
        inverse[k, 0, 0] = first / inside
        for i in range(1, c):
            inverse[k, 0, i] = inverse[k, i, 0] = -cone[k, i] / inside
            for j in range(1, c):
                inverse[k, i, j] = cone[k, i] * cone[k, j] / (first * inside) + (1.0 / first if i == j else 0.0)
        for i in range(c):  # times the arrow of the slip
            total = 0.0
            for j in range(c):
                total += inverse[k, i, j] * slid[k, j]
            across[k, i, 0] = total
            for j in range(1, c):
                across[k, i, j] = inverse[k, i, 0] * slid[k, j] + inverse[k, i, j] * slid[k, 0]
        # compliance of the point, of slip that lifts by tan(psi) and is limited by tan(phi) N, springs and rows
        for i in range(c):
            for j in range(c):
                comp[i, j] = (1.0 if i else tan_psi[k]) * across[k, i, j] * (1.0 if j else tan_phi[k])
                unit[i, j] = 1.0 if i == j else 0.0
            comp[i, i] += 1.0 / stiff[k, i]
        comp[0, 0] += soft[k]
        # its inverse, by elimination with the largest pivot of a column
        for i in range(c):
            p = i
            for h in range(i + 1, c):
                if abs(comp[h, i]) > abs(comp[p, i]):
                    p = h
            if comp[p, i] == 0.0:
                return False
            for j in range(c):
                comp[i, j], comp[p, j] = comp[p, j], comp[i, j]
                unit[i, j], unit[p, j] = unit[p, j], unit[i, j]
            for h in range(i + 1, c):
                f = comp[h, i] / comp[i, i]
                for j in range(i, c):
                    comp[h, j] -= f * comp[i, j]
                for j in range(c):
                    unit[h, j] -= f * unit[i, j]
        for i in range(c - 1, -1, -1):
            for j in range(c):
                x = unit[i, j]
                for h in range(i + 1, c):
                    x -= comp[i, h] * tangent[k, h, j]
                tangent[k, i, j] = x / comp[i, i]
        off[k, 0] = (normal[k] - elastic[k, 0]) / stiff[k, 0] - (tan_psi[k] * slid[k, 0] + lifted[k])
        for j in range(1, c):
            off[k, j] = (cone[k, j] - elastic[k, j]) / stiff[k, j] - slid[k, j]
        cone_off[k] = first - strength[k]
    return True


@njit(cache=True, error_model="numpy")
def freed(
    axes: tuple[int, ...], tan_psi: Array, row: Index, sign: Array, state: tuple[Array, ...],
    linear: tuple[Array, ...], aim: float, second: bool,
    first: tuple[Array, ...], steps: tuple[Array, Array, Array],
) -> None:
    """Write steps of forces, slips and gaps in a pose that is held.

    Both products are linearised and aimed at ``aim``: spare d(given) + given d(spare) = aim - spare given, and cone o
    d(slid) + slid o d(cone) = (aim, 0) - cone o slid. Here x o y = (x . y, x0 y' + y0 x'), cone is (a, T) and slid is
    (p, d). With forces held d(spare) = -lacks and d(cone) = (-cone_off, 0): hence the plus before both below. Forces
    follow from the displacements that the springs then lack.

    Parameters
    ----------
    axes : any tuple of c numbers
    tan_psi : dilatancy of every point, shape (m,)
    row, sign : point and sign of every row of spare strength, shapes (r,)
    state, linear : as in :func:`linearised`
    aim : product that is aimed at, of spare strength and opening, and of the cone of friction and the slip
    second : whether the products of a first step are taken off: Mehrotra's corrector
    first : that first step, laid out as ``state``: from 1 on cone, slid, spare and given; not read unless ``second``
    steps : written: forces, (m, c), (p, d), (m, c), and openings or crushings as ``given``, (r,)
    """
    force, slip, gap = steps
    _, cone, slid, spare, given = state
    inverse, _, tangent, off, cone_off, lacks = linear
    m, c = len(cone), len(axes)
    opened, right, lack = np.zeros(m), np.empty(c), np.empty(c)
    # what each pair of spare strength and opening lacks of the product, with both unknowns moved
    for r in range(len(row)):
        pair = aim - spare[r] * given[r]
        if second:
            pair -= first[3][r] * first[4][r]
        gap[r] = (pair + given[r] * lacks[r]) / spare[r]
        opened[row[r]] += sign[r] * gap[r]
    # the same of the cone of friction and the slip; then the forces that the displacements left over ask for
    for k in range(m):
        x = 0.0
        for j in range(c):
            x += cone[k, j] * slid[k, j]
        right[0] = aim - x
        for j in range(1, c):
            right[j] = -(cone[k, 0] * slid[k, j] + slid[k, 0] * cone[k, j])
        if second:
            x = 0.0
            for j in range(c):
                x += first[1][k, j] * first[2][k, j]
            right[0] -= x
            for j in range(1, c):
                right[j] -= first[1][k, 0] * first[2][k, j] + first[2][k, 0] * first[1][k, j]
        for j in range(c):
            right[j] += slid[k, j] * cone_off[k]
        for i in range(c):
            x = 0.0
            for j in range(c):
                x += inverse[k, i, j] * right[j]
            slip[k, i] = x
            lack[i] = (x if i else tan_psi[k] * x + opened[k]) - off[k, i]
        for i in range(c):
            x = 0.0
            for j in range(c):
                x += tangent[k, i, j] * lack[j]
            force[k, i] = x


@njit(cache=True, error_model="numpy")
def stepped(
    axes: tuple[int, ...], tan_phi: Array, row: Index, sign: Array, state: tuple[Array, ...],
    linear: tuple[Array, ...], free: tuple[Array, Array, Array], moved: Array,
    step: tuple[Array, ...],
) -> float:
    """Write the step that goes with displacements of the points, and return its share to the edge of the law.

    At that share the first point comes to its cone or the first row to nothing; infinite where none does. To the steps
    in a pose that is held the displacements add their part, by the tangent and by d(slid) / d(cone).

    Parameters
    ----------
    axes : any tuple of c numbers
    tan_phi : friction of every point, shape (m,)
    row, sign : point and sign of every row of spare strength, shapes (r,)
    state, linear : as in :func:`linearised`
    free : steps in a pose that is held, ``steps`` of :func:`freed`: forces, slips and openings or crushings
    moved : displacements of the points by the step, shape (m, c)
    step : written, laid out as ``state``
    """
    _, cone, slid, spare, given = state
    _, across, tangent, _, cone_off, lacks = linear
    normal, cone_step, slid_step, spare_step, given_step = step
    m, c = len(cone), len(axes)
    share = np.inf
    for k in range(m):
        for i in range(c):
            x = 0.0
            for j in range(c):
                x += tangent[k, i, j] * moved[k, j]
            cone_step[k, i] = free[0][k, i] - x
        normal[k] = cone_step[k, 0]
        cone_step[k, 0] *= tan_phi[k]
        for i in range(c):
            x = 0.0
            for j in range(c):
                x += across[k, i, j] * cone_step[k, j]
            slid_step[k, i] = free[1][k, i] - x
        cone_step[k, 0] -= cone_off[k]
        share = min(share, _leaves(axes, cone[k], cone_step[k]), _leaves(axes, slid[k], slid_step[k]))
    for r in range(len(row)):
        pressed = sign[r] * normal[row[r]]
        spare_step[r] = pressed - lacks[r]
        given_step[r] = free[2][r] - given[r] / spare[r] * pressed
        if spare_step[r] < 0.0:
            share = min(share, -spare[r] / spare_step[r])
        if given_step[r] < 0.0:
            share = min(share, -given[r] / given_step[r])
    return share


@njit(cache=True, error_model="numpy", inline="always")
def _leaves(axes: tuple[int, ...], x: Array, step: Array) -> float:
    """Share of a step at which a vector leaves the cone x0 > |(x1, x2)|, infinite where it does not.

    With d the step, it is the first root s >= 0 of a s^2 + 2 b s + c = 0, a = d . d, b = x . d, c = x . x, where
    x . y = x0 y0 - x1 y1 - x2 y2.
    """
    size = went = along = 0.0
    for j in range(1, len(axes)):
        size += x[j] * x[j]
        went += step[j] * step[j]
        along += x[j] * step[j]
    size, went = np.sqrt(size), np.sqrt(went)
    a = (step[0] - went) * (step[0] + went)
    b = x[0] * step[0] - along
    c = max((x[0] - size) * (x[0] + size), 0.0)
    first = -x[0] / step[0] if step[0] < 0.0 else np.inf
    if b * b >= a * c:
        root = np.sqrt(max(b * b - a * c, 0.0))
        share = c / (root - b) if b < 0.0 else (-b - root) / a if a < 0.0 else np.inf
        if share >= 0.0:
            first = min(first, share)
    return first
