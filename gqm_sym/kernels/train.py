"""A train: mass spread evenly along the track."""

from numbers import Integral
from typing import Any, SupportsIndex

from gqm_sym.arguments import checked, short
from gqm_sym.errors import DeclarationError
from gqm_sym.kernels.base import Kernel, parameter
from gqm_sym.parameters import Given, read_value

MAX_CARS = 1000


@checked("Train")
def Train(*, length: Given | None = None, cars: Any = 1, mass: Given | None = None) -> Kernel:
    """Make the body a train, whose mass is spread evenly over a length of the track.

    Gravity then acts on the mean height of the train, and λ belongs to its middle. The run-time parameter ``m`` is the
    mass of the whole train.

    Parameters
    ----------
    length
        The length of the train along the track in m, or another name for this parameter.
    cars
        The number of equal cars. The motion does not depend on it; `Motion.cars` has the contact force of each car and
        the force in each coupling.
    mass
        The mass of the whole train in kg; by default that of the parameter ``m``.

    Returns
    -------
    Kernel

    Raises
    ------
    DeclarationError
        If a name or a value is not allowed.
    """
    size, pair = parameter(length, "length", where="train")
    if (
        isinstance(cars, bool)
        or not isinstance(cars, Integral)
        or not isinstance(cars, SupportsIndex)
        or not 1 <= int(cars) <= MAX_CARS
    ):
        raise DeclarationError(f"train: cars: must be a whole number from 1 to {MAX_CARS}, got {short(cars)}")
    pairs = (pair,) if mass is None else (pair, ("m", read_value(mass, where="train: mass")))
    text = f"a train of length {size}, {cars} car{'' if cars == 1 else 's'}"
    return Kernel(
        terms=(("train", text),),
        train_length=size,
        cars=int(cars),
        defaults=pairs,
        positive=(pair[0],),
    )
