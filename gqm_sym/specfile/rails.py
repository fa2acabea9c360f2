"""The schema of a rail of pieces: standard pieces, and curves with formulas and a domain."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import ConfigDict, Field, create_model

from gqm_sym.declare import Curve, arc, clothoid, line, transition
from gqm_sym.declare.piecewise import Piece
from gqm_sym.errors import DeclarationError, InputError
from gqm_sym.specfile.fields import ABSENT, Centre, Expression, Flag, Headings, Section, SpaceCentre, wrapped


class Line(Section):
    """A straight piece."""

    length: Expression = Field(description="its length", examples=[2])


class Arc(Section):
    """A piece of a circle."""

    radius: Expression = Field(description="its radius", examples=["R"])
    angle: Expression = Field(description="by how much it turns; positive is left", examples=["pi/2"])


class Clothoid(Section):
    """A piece whose signed curvature is linear in arc length."""

    length: Expression = Field(description="its length", examples=[1])
    kappa_start: Expression = Field(description="signed curvature at its start", examples=[0])
    kappa_end: Expression = Field(description="signed curvature at its end", examples=["1/R"])


class Transition(Section):
    """A piece in space whose yaw, pitch and roll rates are polynomials in s, the distance from its start."""

    length: Expression = Field(description="its length", examples=[10])
    yaw: Expression = Field(default="0", description="rate of turning left", examples=["s/(10*R)"])
    pitch: Expression = Field(default="0", description="rate of turning upwards", examples=[0])
    roll: Expression = Field(default="0", description="rate of leaning to the left", examples=["0.05"])


class PieceRow(NamedTuple):
    """The schema of a piece, and its declaration from a file."""

    model: Any
    declare: Callable[..., Piece | Curve]
    summary: str


STANDARD = {
    "line": PieceRow(Line, lambda given: line(**given), "a straight piece"),
    "arc": PieceRow(Arc, lambda given: arc(**given), "a piece of a circle"),
    "clothoid": PieceRow(Clothoid, lambda given: clothoid(**given), "a piece whose curvature is linear in arc length"),
    "transition": PieceRow(Transition, lambda given: transition(**given), "a piece in space that turns and rolls"),
}


class RailSchema(NamedTuple):
    """The models of the mapping of a rail, of one of its pieces, and of the contents of the pieces."""

    rail: Any
    piece: type[Section]
    rows: dict[str, PieceRow]

    @classmethod
    def over(cls, explicit: Mapping[str, tuple[Any, Callable[..., Curve], str]]) -> "RailSchema":
        """Make the schema of rails from the standard pieces and from curves with formulas."""
        rows = STANDARD | {key: PieceRow(*row) for key, row in explicit.items()}
        sections: dict[str, Any] = {
            key: (row.model, Field(default=ABSENT, description=row.summary)) for key, row in rows.items()
        }
        piece: type[Section] = create_model(
            "Piece",
            __base__=Section,
            __doc__="One piece, in exactly one of these ways.",
            __config__=ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1}),
            **sections,
        )
        example = [{"line": {"length": 2}}, {"arc": {"radius": "R", "angle": "pi/2"}}]
        fields: dict[str, Any] = {
            "pieces": (list[piece], Field(description="the pieces in order", examples=[example])),
            "start": (
                SpaceCentre,
                Field(default=ABSENT, description="x and z of the start, in space x, y and z; by default the origin"),
            ),
            "heading": (
                Expression | Headings,
                Field(
                    default=ABSENT,
                    description="angle of the tangent at the start, in space [heading, climb, roll]; by default 0",
                ),
            ),
            "roll": (
                Expression | Centre,
                Field(
                    default=ABSENT,
                    description="in space: 'pieces' (the roll of the rail's frame), or as for space curves",
                    examples=["pieces"],
                ),
            ),
            "heartline": (Expression, Field(default=ABSENT, description="height of the riders' line above the track")),
            "closed": (Flag, Field(default=False, description="whether the end is joined to the start")),
        }
        doc = "A rail of pieces, each joined to the end of the one before. The list of pieces alone is enough."
        rail = create_model("Rail", __base__=Section, __doc__=doc, **fields)
        return cls(Annotated[rail, wrapped("pieces", list)], piece, rows)

    def declare(self, given: dict[str, Any]) -> Curve:
        """Declare the rail that was written."""
        pieces = given.pop("pieces")
        return Curve.piecewise([self._declare(piece, count) for count, piece in enumerate(pieces, start=1)], **given)

    def _declare(self, given: dict[str, Any], count: int) -> Piece | Curve:
        if len(given) != 1:
            what = f"is {' and '.join(given)}" if given else "is empty"
            raise DeclarationError(f"piece {count}, which {what}: give exactly one of {', '.join(self.rows)}")
        ((kind, arguments),) = given.items()
        try:
            return self.rows[kind].declare(arguments)
        except InputError as error:
            raise DeclarationError(f"piece {count}, {error}") from None

    def model_at(self, steps: Sequence[str]) -> Any:
        """Return the model of the mapping at a place inside; None if there is none there."""
        match steps:
            case []:
                return self.rail.__origin__
            case ["pieces", _]:
                return self.piece
            case ["pieces", _, kind] if kind in self.rows:
                return self.rows[kind].model
        return None
