"""The banking of a track in space, given by an angle or by the condition that there is no lateral force on riders."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy as sp

from gqm_sym.arguments import short
from gqm_sym.errors import DeclarationError
from gqm_sym.expressions import read_expression
from gqm_sym.sympy_charts import SpaceFunction

Source: TypeAlias = str | int | sp.Expr
Roll: TypeAlias = Source | tuple[Source, Source]

COORDINATED = "coordinated"
OF_PIECES = "pieces"


@dataclass(frozen=True, slots=True, kw_only=True)
class Banking:
    """The banking of a track, and the line that its riders follow.

    Attributes
    ----------
    angle
        The roll angle in radians, as an expression in the curve's parameter and run-time parameters; None if the track
        is banked so that the lateral force vanishes.
    speed
        The speed at which it vanishes; None if that is the speed of the motion.
    heartline
        The height of the declared curve, which the riders follow, over the track.
    up
        The upward direction, of a curve that was derived from another one with an angle; otherwise empty.
    """

    angle: sp.Expr | None
    speed: sp.Expr | None
    heartline: sp.Expr
    up: tuple[sp.Expr, ...] = ()

    @property
    def forms(self) -> tuple[sp.Expr, ...]:
        """The expressions in it."""
        return tuple(form for form in (self.angle, self.speed, self.heartline, *self.up) if form is not None)


def _is_coordinated(given: Any) -> bool:
    return isinstance(given, str) and given == COORDINATED


def is_formula(roll: Any) -> bool:
    """Return whether a roll is given by a formula or a word, and not by angles at points."""
    return isinstance(roll, str | int | sp.Expr) or (isinstance(roll, tuple | list) and len(roll) <= 2)


def read_banking(roll: Roll | None, heartline: Source, where: str = "space") -> Banking | None:
    """Read the arguments ``roll`` and ``heartline`` of a space curve; return None if no roll is declared.

    Parameters
    ----------
    roll, heartline
        As `Curve.space` has them; the roll may also be the chart of angles at points.
    where
        The name of the function that declares the curve, for messages.

    Raises
    ------
    DeclarationError
        If they are not valid, or there is a heartline without a roll.
    """
    height = read_expression(heartline, where=f"{where}: heartline", unit="m")
    if roll is None:
        if height != 0:
            raise DeclarationError(
                f"{where}: heartline: {height} is measured across the banked track; declare roll too, an angle or "
                f"{COORDINATED!r}"
            )
        return None
    if isinstance(roll, tuple | list):
        if len(roll) != 2 or not _is_coordinated(roll[0]):
            raise DeclarationError(
                f"{where}: roll: must be an angle, {COORDINATED!r} or ({COORDINATED!r}, speed), got {short(roll)}"
            )
        speed = read_expression(roll[1], where=f"{where}: roll: speed", unit="m/s")
        return Banking(angle=None, speed=speed, heartline=height)
    if _is_coordinated(roll):
        return Banking(angle=None, speed=None, heartline=height)
    if isinstance(roll, str) and roll == OF_PIECES:  # `Curve.piecewise` replaces it by the chart of the roll
        raise DeclarationError(
            f"{where}: roll: {OF_PIECES!r} is the roll of the pieces of a rail (Curve.piecewise), of which this curve "
            f"has none; declare an angle or {COORDINATED!r}"
        )
    of_points = isinstance(roll, SpaceFunction)
    angle = roll if of_points else read_expression(roll, where=f"{where}: roll", unit="rad")
    return Banking(angle=angle, speed=None, heartline=height)
