"""Fit files: parameters and a launch fitted to a table of measurements."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from gqm_sym.budgets import outside_budgets
from gqm_sym.derivation import Model
from gqm_sym.emission import emit
from gqm_sym.errors import InputError
from gqm_sym.fitting.data import UNITS, read_measurements
from gqm_sym.fitting.fit import CHOICES, LAUNCH, fit
from gqm_sym.fitting.result import Fit
from gqm_sym.literals.numbers import read_number
from gqm_sym.literals.units import split_unit
from gqm_sym.parameters import in_si
from gqm_sym.specfile import Spec
from gqm_sym.specfile.fields import ABSENT, Line, Number, Section, UnitText, split_value, wrapped
from gqm_sym.specfile.locations import locate, place_of
from gqm_sym.specfile.schema import Quantity, json_schema
from gqm_sym.studies.plan import Array
from gqm_sym.studies.reader import StudyReader, read_study
from gqm_sym.studies.schema import Name, Table

# The names of a column of standard deviations: for the only quantity, or for the one that follows in the name.
SIGMA = "sigma"


def _split_unknown(value: object) -> object:
    """Convert a guess, two limits or all three to the mapping that names them."""
    if value is None:
        return {}
    if isinstance(value, str):
        measured = split_unit(value)
        return {"start": value} if measured is None else {"start": measured[0], "unit": measured[2]}
    if isinstance(value, list):
        names = {2: ("low", "high"), 3: ("low", "start", "high")}.get(len(value))
        if names is None:
            what = f"must be a first guess, [low, high] or [low, guess, high], got {len(value)} values"
            raise PydanticCustomError("gqm", "{what}", {"what": what, "column": 0})
        return {name: number for name, number in zip(names, value, strict=True) if number is not None}
    return value


class Unknown(Section):
    """First guess and limits of a number to be fitted, each of which may be missing, or null if none is given."""

    start: Number = Field(default=ABSENT, description="first guess", examples=["1.2"])
    low: Number = Field(default=ABSENT, description="lower limit", examples=["0"])
    high: Number = Field(default=ABSENT, description="upper limit", examples=["2"])
    unit: UnitText = Field(
        default="", description="unit of these numbers, which are converted to SI", examples=["cm", "deg"]
    )


class FitFile(Section):
    """Parameters and launch of a motion that are fitted to measurements."""

    title: Line = Field(default="", description="one line of text for readers")
    curve: Line = Field(
        description="path of the curve file, in the folder of this file or below it", examples=["pendulum.yaml"]
    )
    data: Annotated[Table, wrapped("file", str)] = Field(
        description="measurements with the columns t and lam, s, x, y, z or v; or period or half_period; or passages; "
        "and their standard deviations in a column sigma, or sigma_x and the like",
        examples=[{"file": "swings.csv", "units": {"lam": "deg"}}],
    )
    free: Annotated[dict[Name, Annotated[Unknown, BeforeValidator(_split_unknown)]], Field(min_length=1)] = Field(
        description="run-time parameters, lam0 and v0 to be fitted, each with a first guess, [low, high], "
        "[low, guess, high], in which null is no limit, or null, which starts from the value in the curve file",
        examples=[{"L": "1.2", "mu": ["0", "0.1", "1"]}],
    )
    sigma: dict[Name, Annotated[Quantity, BeforeValidator(split_value)]] = Field(
        default_factory=dict, description="standard deviations of whole columns", examples=[{"x": "1 mm"}]
    )
    place: Annotated[Quantity, BeforeValidator(split_value)] = Field(
        default=ABSENT, description="place of all passages, a value of the curve parameter", examples=["0"]
    )
    fixed: dict[Name, Annotated[Quantity, BeforeValidator(split_value)]] = Field(
        default_factory=dict,
        description="known launch and parameters that replace those of the curve file",
        examples=[{"v0": "0"}],
    )
    contact: Literal["bilateral", "above", "below"] = Field(
        default=ABSENT, description="side of the track on which the body runs, in place of that in the curve file"
    )


def model_at(path: tuple[str, ...]) -> Any:
    """Return the model of the mapping at a place of the file; None if there is none there."""
    match path:
        case ():
            return FitFile
        case ("data",):
            return Table
        case ("free", _):
            return Unknown
        case ("place",) | ("sigma" | "fixed", _):
            return Quantity
    return None


@dataclass(frozen=True, kw_only=True, eq=False)
class FitPlan:
    """A fit: the measurements, the unknowns, and the module of the motion.

    Attributes
    ----------
    title : str
        One line of text for readers.
    data : dict
        The measurements in SI units, as `gqm_sym.fit` takes them.
    free, fixed : dict
        The unknown and the known numbers, as exact texts in SI units.
    units : mapping
        SI units of names, as far as they are known.
    name, module : str
        The name and the text of the generated module.
    """

    title: str
    data: dict[str, Any]
    free: dict[str, Any]
    fixed: dict[str, Any]
    units: Mapping[str, str]
    name: str
    module: str

    def fit(self, module: ModuleType) -> Fit:
        """Return the fit, with the generated module as it was imported."""
        return fit(module, self.data, self.free, **self.fixed)

    def as_json(self, found: Fit) -> str:
        """Return a fit as JSON: estimates, covariance and quality; null for values that the data do not determine."""
        estimates = {
            name: {"value": value, "std": _finite(found.std[name]), "unit": self.units.get(name, "")}
            for name, value in found.estimates.items()
        }
        rms = {name: float(np.sqrt(np.mean(np.square(values)))) for name, values in found.residuals.items()}
        content = {
            "title": self.title,
            "curve": self.name,
            "estimates": estimates,
            "covariance": [[_finite(value) for value in row] for row in found.covariance.tolist()],
            "chi2": found.chi2,
            "degrees_of_freedom": found.degrees_of_freedom,
            "rank": found.rank,
            "unidentified": [list(names) for names in found.unidentified],
            "at_limits": list(found.at_limits),
            "rms_of_residuals": rms,
            "fixed": self.fixed,
        }
        return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def read_fit(path: Path | str) -> FitPlan:
    """Read a fit file, the curve file and the table that it names.

    Parameters
    ----------
    path
        The path of a YAML file of at most 64 KiB.

    Raises
    ------
    SpecFileError
        If the file has mistakes, with a line ``file:line:column: ...`` for each of them.
    """
    return read_study(path, _FitReader, needed="curve, data and free")


def fit_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 7) of a fit file."""
    return json_schema(FitFile)


def _unknown(given: tuple[Any, Any, Any], default: Any) -> Any:
    """Return an unknown as `gqm_sym.fit` takes it; without a guess it begins between two limits or with a default."""
    low, start, high = given
    if low is not None and start is None and high is not None:
        return low, high
    start = default if start is None else start
    return start if low is None and high is None else (low, start, high)


class _FitReader(StudyReader[FitPlan]):
    """A reader of a fit file."""

    def read(self) -> FitPlan | None:
        """Return the plan of the fit."""
        file = self.validated(FitFile, model_at)
        if file is None:
            return None
        with outside_budgets():  # curve files, derivations, emissions and tables have budgets of their own
            found = self.curve(file.curve)
            if found is None:
                return None
            spec, model = found
            own = self.units.get("lam0")
            measured = {**UNITS, "lam": own, "place": own, "t": "s"}
            self.units |= {name: unit for name, unit in measured.items() if unit is not None}
            self.units |= {f"{SIGMA}_{name}": self.units[name] for name in UNITS if name in self.units}
            columns = dict(self.table(file.data, "data"))
        if not columns:
            return None
        data = self._data(file, columns)
        known = self._known(file, spec, model)
        free = {name: _unknown(given, known.get(name)) for name, given in self._free(file, spec, model)}
        fixed = {name: value for name, value in known.items() if name not in free}
        if not self.mistakes:
            self._check(data, model)
        if self.mistakes:
            return None
        with outside_budgets():
            module = emit(model, name=spec.name)
        return FitPlan(
            title=file.title, data=data, free=free, fixed=fixed, units=self.units, name=spec.name, module=module
        )

    def _data(self, file: FitFile, columns: Mapping[str, Array]) -> dict[str, Any]:
        """Return the measurements in the form that a fit takes."""
        data: dict[str, Any] = {name: column for name, column in columns.items() if not name.startswith(SIGMA)}
        quantities = [name for name in UNITS if name in columns]
        sigma: dict[str, Any] = {
            name[len(SIGMA) + 1 :]: column for name, column in columns.items() if name.startswith(f"{SIGMA}_")
        }
        if SIGMA in columns:
            sigma |= dict.fromkeys(quantities, columns[SIGMA])
            if len(quantities) == 1:
                unit = file.data.units.get(SIGMA, "")
                self.units[SIGMA] = self.units.get(quantities[0], "1")
                self.check_unit(SIGMA, unit, "data", "units", SIGMA)
        for name, entry in file.sigma.items():
            self.check_unit(name, entry.unit, "sigma", name, "unit")
            if name in sigma or name not in quantities:
                what = "has a column of standard deviations" if name in sigma else "was not measured"
                remedy = "remove one of both" if name in sigma else f"there are {', '.join(quantities)}"
                self.mistakes.add(place_of(self.tree, ("sigma", name)), f"sigma: {name!r} {what}", remedy)
            sigma[name] = read_number(in_si(entry.value, entry.unit), where=name).value
            if not sigma[name] > 0.0:
                self.mistakes.add(place_of(self.tree, ("sigma", name)), f"sigma: {name!r} must be positive")
        if "place" in file.model_fields_set:
            self.check_unit("place", file.place.unit, "place", "unit")
            data["place"] = read_number(in_si(file.place.value, file.place.unit), where="place").value
        return data | ({SIGMA: sigma} if sigma else {})

    def _free(self, file: FitFile, spec: Spec, model: Model) -> Iterator[tuple[str, tuple[Any, Any, Any]]]:
        """Return the unknowns, each with its lower limit, first guess and upper limit; None for what is not given."""
        known = (*LAUNCH, *(name for name, _ in model.defaults))
        for name, entry in file.free.items():
            if not self.check_known(("free", name), spec, known):
                continue
            self.check_unit(name, entry.unit, "free", name, "unit")
            low, start, high = (
                None if value is None else in_si(value, entry.unit) for value in (entry.low, entry.start, entry.high)
            )
            yield name, (low, start, high)

    def _known(self, file: FitFile, spec: Spec, model: Model) -> dict[str, Any]:
        """Return the known launch and parameters."""
        names = (*LAUNCH, *CHOICES, *(name for name, _ in model.defaults))
        for name in file.fixed:
            if self.check_known(("fixed", name), spec, names) and name in file.free:
                what = f"fixed: {name!r} is to be found"
                self.mistakes.add(place_of(self.tree, ("fixed", name)), what, "give it as its first guess, under free")
        known: dict[str, Any] = {name: value for name, value in self.fixed(file, spec).items() if name in names}
        if "direction" in known:
            if known["direction"] not in ("1", "-1"):
                place = place_of(self.tree, ("fixed", "direction"))
                self.mistakes.add(place, "fixed: direction must be 1 or -1 (the sign of ds/dt at launch)")
            known["direction"] = -1 if known["direction"] == "-1" else 1
        return known

    def _check(self, data: dict[str, Any], model: Model) -> None:
        """Record data that a fit would refuse."""
        parameters = {name: None for name, _ in model.defaults}
        try:
            read_measurements(data, {**dict.fromkeys(LAUNCH), **parameters}, None)
        except InputError as error:
            self.mistakes.add(*locate(self.tree, str(error), ("data",)))
