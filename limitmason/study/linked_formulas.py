"""Quantities tied to others by a formula in text, such as "normal_stiffness / 2.32"."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from limitmason.errors import InputError

_BINARY: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_SIGNS: Mapping[type, Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}

FUNCTIONS: Mapping[str, Callable[[Any], Any]] = {
    "tan": np.tan, "sin": np.sin, "cos": np.cos, "arctan": np.arctan, "sqrt": np.sqrt, "exp": np.exp, "log": np.log,
    "radians": np.radians, "degrees": np.degrees,
}
"""Functions that a formula may call; angles in radians, as in numpy."""


class LinkedFormulas:
    """Formulas of quantities by name, worked out one after the other as each needs it.

    Parameters
    ----------
    formulas : text by the name of what it gives: numbers, names, + - * / **, parentheses and ``FUNCTIONS``

    Attributes
    ----------
    needs : names that the formulas need and none of them gives
    order : names of the formulas, each behind those that it needs

    Raises
    ------
    InputError
        For text that is no such formula, and for ties in a circle.
    """

    def __init__(self, formulas: Mapping[str, str]) -> None:
        """Parse the formulas, and find an order in which each needs only those before it."""
        if not isinstance(formulas, Mapping):
            raise InputError(f"ties must read {{'shear_stiffness': 'normal_stiffness / 2'}}, got {formulas!r}")
        self.formulas = dict(formulas)
        self._trees = {name: _parsed(name, text) for name, text in self.formulas.items()}
        needs = {name: self.direct(name) for name in self._trees}
        self.needs = frozenset(set().union(*needs.values()) - set(needs))
        # in each round the formulas whose needs are all worked out before them, or given
        self.order: list[str] = []
        while len(self.order) < len(needs):
            ready = [n for n in needs if n not in self.order and not (needs[n] & set(needs)) - set(self.order)]
            if not ready:
                raise InputError(f"the ties of {', '.join(n for n in needs if n not in self.order)} run in a circle")
            self.order += ready

    def direct(self, name: str) -> set[str]:
        """Names of quantities that the formula of a quantity holds."""
        return {n.id for n in ast.walk(self._trees[name]) if isinstance(n, ast.Name)} - set(FUNCTIONS)

    def check(self, known: Iterable[str]) -> None:
        """Refuse a formula that needs what nobody gives, and a tie of what is given.

        Parameters
        ----------
        known : names of what is given

        Raises
        ------
        InputError
            Naming it.
        """
        known = tuple(known)
        if missing := sorted(self.needs - set(known)):
            raise InputError(f"a tie needs {missing[0]!r}, which is not among {', '.join(known)}")
        if twice := [n for n in known if n in self.formulas]:
            raise InputError(f"{twice[0]!r} is tied and given: leave one of them out")

    def __call__(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The values with those linked to them.

        Parameters
        ----------
        values : numbers or arrays by name; formulas go through arrays element by element

        Raises
        ------
        InputError
            Where a formula gives no finite number.
        """
        found = dict(values)
        for name in self.order:
            # numbers of fixed size: a power of powers overflows at once where whole numbers would grow without end
            with np.errstate(all="ignore"):
                found[name] = _value(self._trees[name].body, found)
            if not np.isfinite(found[name]).all():
                at = ", ".join(f"{n} = {found[n]}" for n in sorted(self.direct(name)))
                raise InputError(f"the tie of {name!r}, {self.formulas[name]!r}, gives no finite number"
                                 + (f" at {at}" if at else ""))
        return found

    def __bool__(self) -> bool:
        return bool(self.formulas)


LONGEST = 1000
"""Characters of a formula: deeper nesting than these allow would exhaust the parser."""

LARGEST = 1e300
"""Numbers of a formula are smaller: one that is infinite as a double is no number."""


def _parsed(name: str, text: str) -> ast.Expression:
    """Syntax tree of a formula of numbers, names, signs and known functions alone.

    ``name`` is that of the quantity, for messages. A ``text`` is refused that Python could run but that is no formula.
    """
    if isinstance(text, str) and len(text) > LONGEST:
        raise InputError(f"the tie of {name!r} is a formula of {len(text)} characters, the most are {LONGEST}")
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
        raise InputError(f"the tie of {name!r} is no formula: {text!r}") from None
    # every node of the tree must be of a kind that :func:`_value` can work out
    for node in ast.walk(tree):
        fine = (
            isinstance(node, ast.Expression | ast.Name | ast.Load)
            or (isinstance(node, ast.Constant) and isinstance(node.value, int | float) and abs(node.value) < LARGEST)
            or (isinstance(node, ast.BinOp) and type(node.op) in _BINARY)
            or (isinstance(node, ast.UnaryOp) and type(node.op) in _SIGNS)
            or type(node) in _BINARY
            or type(node) in _SIGNS
            or (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS
                and len(node.args) == 1 and not node.keywords)
        )
        if not fine:
            raise InputError(
                f"the tie of {name!r}, {text!r}, may hold numbers, names, + - * / ** and {', '.join(FUNCTIONS)}"
            )
    return tree


def _value(node: ast.AST, values: Mapping[str, Any]) -> Any:
    """Value of a formula that :func:`_parsed` has let through, from its ``node`` down.

    ``values`` are numbers or arrays by name.
    """
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    if isinstance(node, ast.UnaryOp):
        return _SIGNS[type(node.op)](_value(node.operand, values))
    if isinstance(node, ast.Call):
        assert isinstance(node.func, ast.Name)
        return FUNCTIONS[node.func.id](_value(node.args[0], values))
    if isinstance(node, ast.Name):
        if node.id not in values:  # most often a function without its argument
            call = f", call it as {node.id}(...)" if node.id in FUNCTIONS else ""
            raise InputError(f"a tie needs a value of {node.id!r}{call}")
        return np.asarray(values[node.id], dtype=float)[()]
    assert isinstance(node, ast.Constant)
    assert isinstance(node.value, int | float)
    return np.float64(node.value)
