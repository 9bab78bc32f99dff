"""Joint stiffness from moduli of blocks, mortar and masonry, and moduli back from joint stiffness.

Equation numbers are those of Murano et al., section 5, which collects them from the works named in each function.
"""

from limitmason.errors import InputError


def masonry_modulus_itasca(block_modulus: float, normal_stiffness: float, spacing: float) -> float:
    """Return the modulus of masonry loaded across its joints, 1/E_m = 1/E_mu + 1/(k_n s) [Pa].

    Parameters
    ----------
    block_modulus : E_mu [Pa]; may be infinite
    normal_stiffness : k_n [Pa/m]
    spacing : s [m]

    Notes
    -----
    Source: eq (13), Itasca's manual. There s is the *spacing* of joints in rock; Murano et al. call it the thickness of
    the mortar joint and take 1 cm, but their Table 5 (4.00e8 Pa from 2.0e9 Pa/m) is k_n times 0.2 m, the height of a
    unit.
    """
    _above_zero(block_modulus=block_modulus, normal_stiffness=normal_stiffness, spacing=spacing)
    return 1.0 / (1.0 / block_modulus + 1.0 / (normal_stiffness * spacing))


def normal_stiffness_itasca(masonry_modulus: float, block_modulus: float, spacing: float) -> float:
    """Return k_n = E_m E_mu / (s (E_mu - E_m)) [Pa/m].

    Parameters
    ----------
    masonry_modulus, block_modulus : E_m < E_mu [Pa]
    spacing : s [m]

    Notes
    -----
    Source: eq (14), the inverse of eq (13).
    """
    return _series(block_modulus, masonry_modulus, spacing, ("block_modulus", "masonry_modulus", "spacing"))


def shear_stiffness(normal_stiffness: float, poisson: float = 0.2) -> float:
    """Return k_s = k_n / (2 (1 + nu)) [Pa/m].

    Parameters
    ----------
    normal_stiffness : k_n [Pa/m]
    poisson : nu, 0.2 assumed by Murano et al. [-]

    Notes
    -----
    Source: eqs (15), (20) and (22). The calibrated models of Murano et al. use k_n = 2 k_s instead.
    """
    _above_zero(normal_stiffness=normal_stiffness)
    return normal_stiffness / (2.0 * (1.0 + _poisson(poisson)))


def normal_stiffness_sarhosis(block_modulus: float, mortar_modulus: float, joint_thickness: float) -> float:
    """Return k_n = E_b E_m / (h_m (E_b - E_m)) [Pa/m], E_m that of the *mortar*.

    Parameters
    ----------
    block_modulus, mortar_modulus : E_b > E_m [Pa]
    joint_thickness : h_m [m]

    Notes
    -----
    Source: eq (16), after Sarhosis and Sheng.
    """
    names = ("block_modulus", "mortar_modulus", "joint_thickness")
    return _series(block_modulus, mortar_modulus, joint_thickness, names)


def shear_stiffness_sarhosis(
    block_modulus: float,
    mortar_modulus: float,
    joint_thickness: float,
    *,
    poisson: float = 0.2,
    as_printed: bool = False,
) -> float:
    """Return k_s = G_b G_m / (h_m (G_b - G_m)) [Pa/m], with G = E / (2 (1 + nu)).

    Parameters
    ----------
    block_modulus, mortar_modulus, joint_thickness : as in :func:`normal_stiffness_sarhosis`
    poisson : nu of both [-]
    as_printed : with E_b - E_m in the denominator

    Notes
    -----
    Source: eq (17), which prints E_b - E_m below G_b G_m. That makes k_s a further factor 2 (1 + nu) smaller than the
    spring in series that eq (16) is, and than eqs (15), (20) and (22): taken here as a misprint.
    """
    g_b, g_m = shear_modulus(block_modulus, poisson), shear_modulus(mortar_modulus, poisson)
    names = ("block_modulus", "mortar_modulus", "joint_thickness")
    stiffness = _series(g_b, g_m, joint_thickness, names)
    return stiffness / (2.0 * (1.0 + poisson)) if as_printed else stiffness


def shear_modulus(modulus: float, poisson: float = 0.2) -> float:
    """Return G = E / (2 (1 + nu)) [Pa].

    Parameters
    ----------
    modulus : E [Pa]
    poisson : nu [-]

    Notes
    -----
    Source: eq (18).
    """
    _above_zero(modulus=modulus)
    return modulus / (2.0 * (1.0 + _poisson(poisson)))


def normal_stiffness_bui(block_modulus: float, masonry_modulus: float, unit_height: float) -> float:
    """Return k_n = E_b E_m / (h_b (E_b - E_m)) [Pa/m], E_m that of the *masonry*.

    Parameters
    ----------
    block_modulus, masonry_modulus : E_b > E_m [Pa]
    unit_height : h_b [m]

    Notes
    -----
    Source: eq (19), after Bui et al.; eq (14) with the height of a unit as spacing.
    """
    return _series(block_modulus, masonry_modulus, unit_height, ("block_modulus", "masonry_modulus", "unit_height"))


def masonry_modulus_bui(block_modulus: float, normal_stiffness: float, unit_height: float) -> float:
    """Return E_m = k_n h_b E_b / (E_b + k_n h_b) [Pa], the inverse of eq (19).

    Parameters
    ----------
    block_modulus : E_b [Pa]
    normal_stiffness : k_n [Pa/m]
    unit_height : h_b [m]
    """
    return masonry_modulus_itasca(block_modulus, normal_stiffness, unit_height)


def normal_stiffness_gonen(masonry_modulus: float, spacing: float) -> float:
    """Return k_n = E / h for rigid blocks that carry all deformation in their joints [Pa/m].

    Parameters
    ----------
    masonry_modulus : E [Pa]
    spacing : h, one unit and one joint [m]

    Notes
    -----
    Source: eq (21), after Gonen et al.
    """
    _above_zero(masonry_modulus=masonry_modulus, spacing=spacing)
    return masonry_modulus / spacing


def masonry_modulus_gonen(normal_stiffness: float, spacing: float) -> float:
    """Return E = k_n h [Pa], the inverse of eq (21).

    Parameters
    ----------
    normal_stiffness : k_n [Pa/m]
    spacing : h [m]
    """
    _above_zero(normal_stiffness=normal_stiffness, spacing=spacing)
    return normal_stiffness * spacing


def _series(stiff: float, soft: float, length: float, names: tuple[str, str, str]) -> float:
    _above_zero(**dict(zip(names, (stiff, soft, length), strict=True)))
    if soft >= stiff:
        raise InputError(
            f"{names[1]} {soft:g} Pa must be below {names[0]} {stiff:g} Pa: nothing is left for the joints"
        )
    return soft / (length * (1.0 - soft / stiff))


def _above_zero(**values: float) -> None:
    for name, value in values.items():
        if not value > 0.0:
            raise InputError(f"{name} must be above zero, got {value!r}")


def _poisson(value: float) -> float:
    if not 0.0 <= value <= 0.5:
        raise InputError(f"poisson must lie between 0 and 0.5, got {value!r}")
    return value
