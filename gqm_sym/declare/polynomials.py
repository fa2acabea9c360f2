"""Tracks that are known as polynomials, piece by piece; the functions of `gqm_sym.design` find such tracks."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PolynomialPieces:
    """Polynomials for x and z, joined end to start.

    Attributes
    ----------
    pieces : str
        A line for each piece: both ends of its parameter u, then the coefficients of x and as many of z, in powers of
        u, as decimal numbers. Pieces meet exactly.
    origin : int
        The number of pieces before the place where arc length is 0.
    breaks : tuple of int
        The numbers of pieces before joints at which the curvature or a higher derivative jumps.
    """

    pieces: str
    origin: int
    breaks: tuple[int, ...]
