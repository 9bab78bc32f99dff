"""Total-strain law with rotating cracks: exponential softening in tension, a parabola in compression.

In the principal axes of strain every direction follows one uniaxial curve of its equivalent strain
e_i = eps_i + nu / E (sigma_j + sigma_k), the part of its strain that its own stress makes: before any damage this is
Hooke's law, and a crack has no lateral contraction. Cracks turn with the axes. Unloading runs to the origin; what each
direction has seen is remembered as a symmetric tensor, largest equivalent strain in tension and in compression.

Sources: Rots (1988) for the rotating crack; Selby and Vecchio (1997) for equivalent strains; curves as in the manual of
DIANA (exponential by fracture energy; parabola with its peak at 5 fc / 3 E).
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.continuum.uniaxial_curves import Curves, envelope, uniaxial

_FLOOR = 1e-6
"""Share of the elastic stiffness left in the tangent, never in the stress: keeps the factorisation of open cracks."""
_COUPLING = np.ones((3, 3)) - np.eye(3)  # of a direction to the two others
_PAIRS = ((0, 1), (1, 2), (2, 0))  # directions of the shears xy, yz, zx
_THREE = np.arange(3)
_STEPS, _HALVINGS = 60, 6  # most Newton steps to principal stresses, and halvings of one that comes no nearer
_FITS = 1e-12  # of the largest stress: elastic stresses that near to the curves need no iteration
_SOLVED = 1e-11  # of the largest stress: an iteration ends that near to the curves
_GAIN = 1e-3  # part of the distance that a whole step must take away


class Memory(NamedTuple):
    """What points remember: tensors of largest equivalent strain, shape (n, 3, 3), and energy lost [J/m3], (n,)."""

    tension: Array
    compression: Array
    lost: Array

    def rows(self, rows: Index) -> "Memory":
        """What the points whose numbers are given remember."""
        return Memory(*(m[rows] for m in self))


class PointResponse(NamedTuple):
    """What n points answer to a strain."""

    stress: Array  # (xx, yy, zz, xy, yz, zx), tension positive [Pa], (n, 6)
    memory: Memory
    tangent: Array  # [Pa], (n, 6, 6)
    crack: Array  # crack strain [-], (n,)


def tensor(components: Array) -> Array:
    """Symmetric tensors (..., 3, 3) from (xx, yy, zz, xy, yz, zx), shear not engineering, (..., 6)."""
    return np.asarray(components[..., [[0, 3, 5], [3, 1, 4], [5, 4, 2]]])


def strain_tensor(strain: Array) -> Array:
    """Tensors of strain (..., 3, 3) from (xx, yy, zz, xy, yz, zx), shear engineering, (..., 6)."""
    half = strain.copy()
    half[..., 3:] *= 0.5
    return tensor(half)


def virgin(n: int) -> Memory:
    """Memory of points that were never strained."""
    return Memory(np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros(n))


def respond(c: Curves, strain: Array, before: Memory, *, secant: bool = False) -> PointResponse:
    """Stress at total strains, from the memory of the last accepted state.

    Parameters
    ----------
    c : curves of n points
    strain : (xx, yy, zz, xy, yz, zx), shear engineering [-], shape (n, 6)
    before : memory of the points
    secant : give the secant instead of the consistent tangent: positive definite, slower, steadier

    Notes
    -----
    The tangent leaves out how memory that differs between directions turns with them; it is exact while all directions
    load or none has cracked. Points that have always been elastic, most of a wall, remember nothing and are not turned
    to their principal axes.
    """
    beyond = _beyond(c, strain, before)
    if beyond.all():
        return _cracking(c, strain, before, secant=secant)
    g = 0.5 * c.modulus / (1.0 + c.poisson)  # Hooke's law for all points; those beyond it are written over it
    lame = 2.0 * g * c.poisson / (1.0 - 2.0 * c.poisson)
    tangent = np.zeros((len(strain), 6, 6))
    tangent[:, :3, :3] = lame[:, None, None]
    tangent[:, _THREE, _THREE] += 2.0 * g[:, None]
    tangent[:, _THREE + 3, _THREE + 3] = g[:, None]
    stress = np.einsum("nij,nj->ni", tangent, strain)
    crack, lost = np.zeros(len(strain)), before.lost.copy()
    memory = Memory(before.tension.copy(), before.compression.copy(), lost)
    rows = np.flatnonzero(beyond)
    if len(rows):
        part = _cracking(c.rows(rows), strain[rows], before.rows(rows), secant=secant)
        stress[rows], tangent[rows], crack[rows] = part.stress, part.tangent, part.crack
        for whole, new in zip(memory, part.memory, strict=True):
            whole[rows] = new
    return PointResponse(stress, memory, tangent, crack)


def _beyond(c: Curves, strain: Array, before: Memory) -> Flags:
    """Points that remember something or may leave Hooke's law, shape (n,).

    Parameters
    ----------
    c : their curves
    strain : (xx, yy, zz, xy, yz, zx), shear engineering [-], shape (n, 6)
    before : their memory
    """
    twice_shear = c.modulus / (1.0 + c.poisson)
    mean = strain[:, :3].mean(axis=1)
    off = strain[:, :3] - mean[:, None]
    # no principal value lies further from the mean than sqrt(2/3) of the norm of the deviator
    reach = twice_shear * np.sqrt(2.0 / 3.0 * ((off * off).sum(axis=1) + 0.5 * (strain[:, 3:] ** 2).sum(axis=1)))
    mean_stress = c.modulus / (1.0 - 2.0 * c.poisson) * mean
    remembers = before.tension.any(axis=(1, 2)) | before.compression.any(axis=(1, 2))
    return np.asarray(remembers | (mean_stress + reach > c.tension) | (reach - mean_stress > c.crushing / 3.0))


def _cracking(c: Curves, strain: Array, before: Memory, *, secant: bool) -> PointResponse:
    """The law in principal axes, with the tangent of a crack that turns with them.

    Parameters
    ----------
    c : curves of n points
    strain : (xx, yy, zz, xy, yz, zx), shear engineering [-], shape (n, 6)
    before : largest equivalent strains of the past, as tensors, and the energy lost
    secant : the stiffness to the origin in place of the tangent
    """
    eps, axes = np.linalg.eigh(strain_tensor(strain))
    axes = np.swapaxes(axes, 1, 2)  # rows are directions
    # largest equivalent strains before, in tension and compression, along the axes of now
    kt, kc = (_along(axes, remembered) for remembered in (before.tension, before.compression))
    sigma, equivalent, slope = _principal(c, eps, kt, kc)
    e, nu = c.modulus, c.poisson
    if secant:  # stress over strain; an unstrained direction is as stiff as it was
        small = np.abs(equivalent) < 1e-30
        slope = np.where(small, e[:, None], sigma / np.where(small, 1.0, equivalent))
    # a direction without any stiffness would leave the matrix singular
    slope = np.where(np.abs(slope) < _FLOOR * e[:, None], _FLOOR * e[:, None], slope)
    # from sigma_i = f(e_i) and e_i with Poisson's part: d sigma = (1 - nu / E diag(f') C)^-1 diag(f') d eps
    normal = np.linalg.solve(
        np.eye(3) - (nu / e)[:, None, None] * slope[:, :, None] * _COUPLING, slope[:, :, None] * np.eye(3)
    )
    local = np.zeros((len(eps), 6, 6))
    local[:, :3, :3] = 0.5 * (normal + np.swapaxes(normal, 1, 2))
    for k, (i, j) in enumerate(_PAIRS, start=3):
        gap = eps[:, i] - eps[:, j]
        # of equal strains the quotient below is the rounding of both: its limit stands for it
        close = np.abs(gap) < 1e-12 + 1e-9 * np.abs(eps).max(axis=1)
        # stiffness of shear that keeps stress and strain coaxial while the axes turn
        g = np.where(close, 0.25 * (normal[:, i, i] + normal[:, j, j] - normal[:, i, j] - normal[:, j, i]),
                     (sigma[:, i] - sigma[:, j]) / np.where(close, 1.0, 2.0 * gap))
        if secant:  # cracked as its two directions are: at least the shear modulus of their harmonic mean
            a, b = np.abs(slope[:, i]), np.abs(slope[:, j])
            g = np.maximum(g, a * b / ((a + b) * (1.0 + nu)))
        local[:, k, k] = g
    turn = _strain_turn(axes)
    tangent = np.swapaxes(turn, 1, 2) @ local @ turn
    stress = np.einsum("nk,nkc->nc", sigma, turn[:, :3])  # n_i n_i^T in the order of the strains
    memory = _remember(c, before, axes, equivalent, kt, kc)
    # crack strain: what the stress of a direction does not make of its strain, none where all are shortened
    crack = np.maximum(equivalent - sigma / e[:, None], 0.0).max(axis=1)
    return PointResponse(stress, memory, tangent, np.where(equivalent.max(axis=1) > 0.0, crack, 0.0))


def _along(axes: Array, remembered: Array) -> Array:
    """Largest strains of the past along the axes of now, none below zero [-], shape (n, 3); zero without memory.

    Parameters
    ----------
    axes : directions as rows, shape (n, 3, 3)
    remembered : largest strains as tensors, shape (n, 3, 3)
    """
    out = np.zeros(axes.shape[:2])
    rows = np.flatnonzero(remembered.any(axis=(1, 2)))
    if len(rows):
        own = axes[rows]
        out[rows] = np.maximum(np.einsum("nij,njk,nik->ni", own, remembered[rows], own), 0.0)
    return out


def _principal(c: Curves, eps: Array, kt: Array, kc: Array) -> tuple[Array, Array, Array]:
    """Principal stresses that fit the curves, by Newton's method.

    The equivalent strain of a direction is that of a uniaxial test with its stress: Poisson's part is taken off. So
    sigma_i = f(eps_i + nu / E (sigma_j + sigma_k)), with f the uniaxial curve, is solved for all three at once. Points
    whose elastic stresses fit already, within 1e-12, are left out of the iterations.

    Parameters
    ----------
    c : curves of n points
    eps : principal strains, tension positive [-], shape (n, 3)
    kt, kc : largest equivalent strains before, in tension and compression, both positive [-], shape (n, 3)

    Returns
    -------
    stress : [Pa], shape (n, 3)
    equivalent : equivalent uniaxial strain [-], shape (n, 3)
    slope : of the stress over it [Pa], shape (n, 3)
    """
    nu, e = c.poisson[:, None], c.modulus[:, None]
    lame = nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    sigma = e * (eps / (1.0 + nu) + lame * eps.sum(axis=1, keepdims=True))
    equivalent = eps + nu / e * (sigma @ _COUPLING)
    stress, slope = uniaxial(c, equivalent, kt, kc)
    off = np.abs(stress - sigma).max(axis=1)
    # at least the stress of a strain of 1e-15, which is rounding
    scale = np.maximum(np.abs(sigma).max(axis=1), 1e-9 * c.modulus * 1e-6)
    todo = np.flatnonzero(off > _FITS * scale)
    if len(todo):
        part, strain, over_e, size = c.rows(todo), eps[todo], (nu / e)[todo], scale[todo]
        tension, compression = kt[todo], kc[todo]

        def law(x: Array, at: Index) -> list[Array]:
            """Equivalent strains that stresses x of some points make, stress and slope of the curves, (k, 3) each."""
            equivalent = strain[at] + over_e[at] * (x @ _COUPLING)
            return [equivalent, *uniaxial(part.rows(at), equivalent, tension[at], compression[at])]

        # begun at the elastic stresses, none above the strength; 1e300 stands for infinite strength, to have numbers
        x = np.clip(sigma[todo], -1.0e300, np.minimum(part.tension, 1e300)[:, None])
        left = np.arange(len(x))  # points that are not solved yet: what is solved is not asked again
        found = law(x, left)
        for _ in range(_STEPS):
            r = x[left] - found[1][left]
            worst = np.abs(r).max(axis=1)
            far = worst > _SOLVED * size[left]
            left, r, worst = left[far], r[far], worst[far]
            if not len(left):
                break
            matrix = np.eye(3) - over_e[left][:, :, None] * found[2][left][:, :, None] * _COUPLING
            step = np.linalg.solve(matrix, -r[..., None])[..., 0]
            factor, bad = np.ones(len(left)), np.arange(len(left))
            for halving in range(_HALVINGS + 1):  # halve what does not come nearer; the last is taken as it is
                at = left[bad]
                tried = x[at] + factor[bad, None] * step[bad]
                told = law(tried, at)
                for whole, new in zip(found, told, strict=True):
                    whole[at] = new
                if halving == _HALVINGS:
                    break
                bad = bad[np.abs(tried - told[1]).max(axis=1) > worst[bad] * (1.0 - _GAIN * factor[bad])]
                if not len(bad):
                    break
                factor[bad] *= 0.5
            x[left] = x[left] + factor[:, None] * step
        sigma[todo] = x
        equivalent[todo], stress[todo], slope[todo] = found
    return stress, equivalent, slope


def _remember(c: Curves, before: Memory, axes: Array, equivalent: Array, kt: Array, kc: Array) -> Memory:
    """Memory grown by what directions exceeded, and the energy that this took.

    Parameters
    ----------
    c : curves of n points
    before : their memory
    axes : principal directions as rows, shape (n, 3, 3)
    equivalent : equivalent strains, tension positive [-], shape (n, 3)
    kt, kc : largest ones before, in tension and compression, both positive [-], shape (n, 3)
    """
    more_t = np.maximum(equivalent - np.maximum(kt, 0.0), 0.0)
    more_c = np.maximum(-equivalent - kc, 0.0)
    grown = []
    for old, more in ((before.tension, more_t), (before.compression, more_c)):
        new, rows = old.copy(), np.flatnonzero(more.any(axis=1))
        new[rows] += np.einsum("ni,nij,nik->njk", more[rows], axes[rows], axes[rows])
        grown.append(new)
    # lost: area under the curve to the largest strain, less the triangle that unloading from there gives back
    lost = before.lost.copy()
    for sign, old, more in ((1.0, kt, more_t), (-1.0, kc, more_c)):
        for reached, times in ((old + more, 1.0), (old, -1.0)):  # what is lost by now, less what was before
            stress, _, area = envelope(c, sign * reached)
            lost += times * (area - 0.5 * np.abs(stress) * reached).sum(axis=1)
    return Memory(grown[0], grown[1], lost)


def _strain_turn(axes: Array) -> Array:
    """From strains in global axes to those in given ones, engineering shear, shape (n, 6, 6).

    ``axes`` has the given directions as rows, shape (n, 3, 3).
    """
    out = np.empty((len(axes), 6, 6))
    for k in range(3):
        a = axes[:, k]
        out[:, k, :3] = a * a
        out[:, k, 3], out[:, k, 4], out[:, k, 5] = a[:, 0] * a[:, 1], a[:, 1] * a[:, 2], a[:, 2] * a[:, 0]
    for k, (i, j) in enumerate(_PAIRS, start=3):
        a, b = axes[:, i], axes[:, j]
        out[:, k, :3] = 2.0 * a * b
        for m, (p, q) in enumerate(_PAIRS, start=3):
            out[:, k, m] = a[:, p] * b[:, q] + a[:, q] * b[:, p]
    return out
