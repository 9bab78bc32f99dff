"""Joint stiffness from moduli of blocks, mortar and masonry, and moduli back from joint stiffness.

Equation numbers are those of Murano et al., section 5, which collects under several names what are springs in series.
"""

from limitmason.errors import InputError


def masonry_modulus(block_modulus: float, normal_stiffness: float, spacing: float) -> float:
    """Return the modulus of masonry loaded across its joints, 1/E_m = 1/E_b + 1/(k_n s) [Pa].

    Parameters
    ----------
    block_modulus : E_b [Pa]; infinite for rigid blocks
    normal_stiffness : k_n [Pa/m]
    spacing : of the joints, the height of a unit, s [m]

    Notes
    -----
    Source: eq (13), Itasca's manual; the inverse of eq (19), Bui et al., and with rigid blocks of eq (21), Gonen et al.
    Murano et al. call s in eq (13) the thickness of the mortar joint and take 1 cm. Their Table 5 (4.00e8 Pa from
    2.0e9 Pa/m) is k_n times 0.2 m, the height of a unit.
    """
    _above_zero(block_modulus=block_modulus, normal_stiffness=normal_stiffness, spacing=spacing)
    return 1.0 / (1.0 / block_modulus + 1.0 / (normal_stiffness * spacing))


def normal_stiffness(block_modulus: float, soft_modulus: float, length: float) -> float:
    """Return the stiffness of joints that makes a softer material of blocks, k_n = E_b E / (l (E_b - E)) [Pa/m].

    Parameters
    ----------
    block_modulus : E_b [Pa]; infinite for rigid blocks
    soft_modulus : of the masonry, or of the mortar, E < E_b [Pa]
    length : l [m], of the masonry the spacing of joints, of the mortar the thickness of a joint

    Notes
    -----
    Source: for masonry eq (14) of Itasca, (19) of Bui et al. and with rigid blocks (21) of Gonen et al.; for mortar
    eq (16), after Sarhosis and Sheng.
    """
    _above_zero(block_modulus=block_modulus, soft_modulus=soft_modulus, length=length)
    # what is left over for the joints must be soft: springs in series are softer than each of them
    if soft_modulus >= block_modulus:
        raise InputError(f"soft_modulus {soft_modulus:g} Pa must be below block_modulus {block_modulus:g} Pa")
    return soft_modulus / (length * (1.0 - soft_modulus / block_modulus))


def shear_stiffness(normal_stiffness: float, poisson: float = 0.2) -> float:
    """Return k_s = k_n / (2 (1 + nu)) [Pa/m].

    Parameters
    ----------
    normal_stiffness : k_n [Pa/m]
    poisson : nu, 0.2 assumed by Murano et al. [-]

    Notes
    -----
    Source: eqs (15), (20) and (22), and (17) with G = E / (2 (1 + nu)) of eq (18). That one prints E_b - E_m below
    G_b G_m, a further factor 2 (1 + nu) less: taken here as a misprint. The calibrated models of Murano et al. use
    k_n = 2 k_s instead.
    """
    _above_zero(normal_stiffness=normal_stiffness)
    if not 0.0 <= poisson <= 0.5:
        raise InputError(f"poisson must lie between 0 and 0.5, got {poisson!r}")
    return normal_stiffness / (2.0 * (1.0 + poisson))


def _above_zero(**values: float) -> None:
    """Refuse numbers that are not positive, by their names."""
    for name, value in values.items():
        if not value > 0.0:
            raise InputError(f"{name} must be above zero, got {value!r}")
