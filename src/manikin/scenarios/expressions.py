"""Arithmetic expressions of scenario files, and the heights that they bound.

An expression such as ``"0.91 - 0.08*atan(10*(x-0.2))/pi"`` is parsed once and never run as code: every node
of its syntax tree must be on a short list (numbers, ``x y z pi e``, ``+ - * / **`` and the functions below).
It becomes a callable for floats, numpy arrays and CasADi symbols alike.

Heights are given for a body of the reference stature. For a body ``s`` times as tall every height above the
supports is ``s`` times as large: ``z' = base + s (z - base)``, with the supports' level ``base`` blended
smoothly from the start to the goal. This is our own rule; the theses plan for one stature only.
"""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from manikin.errors import ScenarioError
from manikin.numerics.spatial import IDENTITY, FloatArray, PlanarTransform

MAX_LENGTH = 1000
"""Longest expression that is parsed [characters]."""
MAX_DEPTH = 100
"""Deepest nesting of operations; evaluation recurses that deep."""
CONSTANTS: Mapping[str, float] = {"pi": math.pi, "e": math.e}

_NUMPY_NAMES: Mapping[str, str] = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "arcsin", "acos": "arccos", "atan": "arctan",
    "arcsin": "arcsin", "arccos": "arccos", "arctan": "arctan", "atan2": "arctan2", "arctan2": "arctan2",
    "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "sqrt": "sqrt", "exp": "exp", "log": "log",
    "abs": "fabs", "min": "fmin", "max": "fmax",
}  # fmt: skip
"""Functions of the language and what numpy calls them; CasADi has every one of these names."""

_TWO_ARGUMENTS = frozenset({"atan2", "arctan2", "min", "max"})

FUNCTIONS: tuple[str, ...] = tuple(_NUMPY_NAMES)

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.UAdd: operator.pos, ast.USub: operator.neg,
}  # fmt: skip

_VARIABLES = ("x", "y", "z")
_VALID = "valid: numbers, x, y, z, pi, e, + - * / ** and functions such as sin, atan, sqrt"

_Evaluator = Callable[[Mapping[str, Any], ModuleType], Any]


class Expression:
    """A parsed arithmetic expression in x, y and z; ScenarioError if ``text``, its source, is none."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._evaluate = _parse(text)

    def __call__(self, x: Any, y: Any, z: Any) -> Any:
        """Evaluate at floats, arrays or CasADi expressions."""
        return self._evaluate({"x": x, "y": y, "z": z}, functions_for(x, y, z))

    def __reduce__(self) -> "tuple[type[Expression], tuple[str]]":
        """Copies and other processes parse the text again."""
        return Expression, (self.text,)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"


def functions_for(*values: Any) -> ModuleType:
    """Return the module whose functions take ``values``: CasADi when one is symbolic, else numpy."""
    if any(type(value).__module__.partition(".")[0] == "casadi" for value in values):
        import casadi

        return casadi
    return np


def _parse(text: str) -> _Evaluator:
    if len(text) > MAX_LENGTH:
        raise ScenarioError(f"expression has {len(text)} characters; valid: at most {MAX_LENGTH}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
        if _depth(tree.body) > MAX_DEPTH:
            raise ScenarioError(f"expression is nested too deeply; valid: at most {MAX_DEPTH} levels")
        return _build(tree.body, text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ScenarioError(f"expression {text!r} cannot be read; {_VALID}") from None


def _depth(node: ast.AST) -> int:
    return 1 + max((_depth(child) for child in ast.iter_child_nodes(node)), default=0)


def _build(node: ast.AST, text: str) -> _Evaluator:
    number = CONSTANTS.get(node.id) if isinstance(node, ast.Name) else None
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        number = str(node.value)
    if number is not None:
        # A numpy float: overflow and division by zero give inf, which the caller can refuse with a place.
        constant = np.float64(number)
        return lambda _values, _functions: constant
    if isinstance(node, ast.Name) and node.id in _VARIABLES:
        name = node.id
        return lambda values, _functions: values[name]
    if isinstance(node, ast.BinOp | ast.UnaryOp) and type(node.op) in _OPERATORS:
        apply = _OPERATORS[type(node.op)]
        sides = (node.left, node.right) if isinstance(node, ast.BinOp) else (node.operand,)
        operands = [_build(side, text) for side in sides]
        return lambda values, functions: apply(*(operand(values, functions) for operand in operands))
    if isinstance(node, ast.Call):
        return _build_call(node, text)
    shown = ast.get_source_segment(text.strip(), node) if isinstance(node, ast.expr) else None
    raise ScenarioError(f"expression {text!r} uses {shown or type(node).__name__!r}; {_VALID}")


def _build_call(node: ast.Call, text: str) -> _Evaluator:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name not in _NUMPY_NAMES:
        shown = ast.get_source_segment(text.strip(), node.func)
        raise ScenarioError(f"expression {text!r} calls {shown!r}; valid functions: {', '.join(FUNCTIONS)}")
    wanted = 2 if name in _TWO_ARGUMENTS else 1
    if len(node.args) != wanted or node.keywords:
        raise ScenarioError(f"expression {text!r} gives {name} {len(node.args)} arguments; valid: {wanted}")
    numpy_name = _NUMPY_NAMES[name]
    arguments = [_build(argument, text) for argument in node.args]
    return lambda values, functions: getattr(functions, numpy_name)(
        *(argument(values, functions) for argument in arguments)
    )


@dataclass(frozen=True, eq=False)
class SupportLevel:
    """Height of the supports below the CoM [m], from that at its ``start`` (2,) to that at its ``goal``."""

    start: FloatArray
    goal: FloatArray
    start_level: float
    goal_level: float

    def __call__(self, x: Any, y: Any) -> Any:
        """Level at a horizontal CoM position, floats, arrays or CasADi expressions [m].

        The blend is twice continuously differentiable: the smootherstep ``6 u^5 - 15 u^4 + 10 u^3`` of the
        position ``u`` in [0, 1] along the straight line from start to goal.
        """
        line = self.goal - self.start
        length_squared = float(line @ line)
        if length_squared < 1e-12 or self.start_level == self.goal_level:
            return self.start_level + 0.0 * x
        functions = functions_for(x, y)
        along = ((x - self.start[0]) * line[0] + (y - self.start[1]) * line[1]) / length_squared
        u = functions.fmin(functions.fmax(along, 0.0), 1.0)
        return self.start_level + (self.goal_level - self.start_level) * u**3 * (u * (6.0 * u - 15.0) + 10.0)


@dataclass(frozen=True, eq=False)
class HeightBand:
    """Lower and upper bound of the CoM's height, scaled to the body.

    Its expressions are heights for the reference stature, of which the body's is ``scale`` times as much;
    they have x and y in a frame of their own. ``level`` is the height of the supports.
    """

    lower_expression: Expression
    upper_expression: Expression
    level: SupportLevel
    scale: float = 1.0
    transform_expressions_to_world: PlanarTransform = IDENTITY

    def lower(self, x: Any, y: Any, z: Any) -> Any:
        """Lowest height of a CoM at (x, y, z) [m]; floats, arrays or CasADi expressions."""
        return self._scaled(self.lower_expression, x, y, z)

    def upper(self, x: Any, y: Any, z: Any) -> Any:
        """Greatest height of a CoM at (x, y, z) [m]; floats, arrays or CasADi expressions."""
        return self._scaled(self.upper_expression, x, y, z)

    def violation(self, com: FloatArray) -> FloatArray:
        """(...) distance of each CoM (..., 3) outside the band; negative inside [m]."""
        x, y, z = com[..., 0], com[..., 1], com[..., 2]
        return np.maximum(self.lower(x, y, z) - z, z - self.upper(x, y, z))

    def _scaled(self, expression: Expression, x: Any, y: Any, z: Any) -> Any:
        frame, own_x, own_y = self.transform_expressions_to_world, x, y
        if not frame.is_identity:
            cosine, sine, _ = frame.rotation[:, 0].tolist()
            along, aside = x - frame.x, y - frame.y
            own_x, own_y = cosine * along + sine * aside, cosine * aside - sine * along
        if self.scale == 1.0:
            return expression(own_x, own_y, z)
        base = self.level(x, y)
        return base + self.scale * (expression(own_x, own_y, base + (z - base) / self.scale) - base)
