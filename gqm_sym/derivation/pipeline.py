"""The derivation of a model: from a declared curve and a force law to closed forms, stage by stage."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import sympy as sp

from gqm_sym.arguments import checked, instance, one_line, short
from gqm_sym.budgets import budget
from gqm_sym.declare import Curve
from gqm_sym.declare.closing import check_period
from gqm_sym.declare.ends import check_order
from gqm_sym.derivation.algebra.rewrite import check_real, without_poles
from gqm_sym.derivation.algebra.signs import Signs
from gqm_sym.derivation.corners import check_corners, check_powers, without_known_absolute_values
from gqm_sym.derivation.defaults import join
from gqm_sym.derivation.forces.dissipation import (
    CORIOLIS,
    LOAD,
    LOADS,
    PUSH,
    SIGMA,
    TILT,
    TURN,
    TURNS,
    UPRIGHT,
    Dissipation,
    dissipation,
)
from gqm_sym.derivation.forces.forces import Forces, Place, forces, is_planar
from gqm_sym.derivation.forces.rider import rider, upright_force
from gqm_sym.derivation.forces.speed import LAM0, V0, SpeedField, conservative_speed, dissipative_speed
from gqm_sym.derivation.forces.train import load_of_cars, notes_of_train, of_train
from gqm_sym.derivation.geometry.centre_in_space import centre_in_space
from gqm_sym.derivation.geometry.geometry import AHEAD, Geometry, geometry, vertical_plane
from gqm_sym.derivation.geometry.level_set import level_set
from gqm_sym.derivation.geometry.offset_curve import offset_curve
from gqm_sym.derivation.model import Model, units_of
from gqm_sym.derivation.origin import measured_from, measured_from_zero, origin_of
from gqm_sym.derivation.reality import check_somewhere_real
from gqm_sym.derivation.wells.symmetric_orbits import SymmetricOrbits, symmetric_orbits
from gqm_sym.derivation.wells.symmetry import Symmetry, symmetry
from gqm_sym.errors import ArgumentError, DeclarationError, DerivationError
from gqm_sym.kernels.base import DIRECTION, KAPPA, MASS, Kernel, X, Y, Z
from gqm_sym.parameters import Given, Value, check_measured, is_positive, tried_values

LAM1 = sp.Symbol("lam1", real=True)
LAM2 = sp.Symbol("lam2", real=True)


@contextmanager
def _within_doubles() -> Iterator[None]:
    """Refuse a number that SymPy takes as a double and that is none.

    SymPy does so where it computes with the integers of gmpy2, which it uses if that package is installed.
    """
    try:
        yield
    except OverflowError:
        raise DerivationError(
            "derive: a number is beyond the range of doubles, 10**308; declare the curve and the forces in other units"
        ) from None


@checked("derive")
@_within_doubles()
@budget("derivation", 60.0, "declare the curve and the forces by shorter expressions")
def derive(
    curve: Curve,
    kernel: Kernel,
    *,
    parameters: Mapping[str, Given | None] | None = None,
    title: str | None = None,
) -> Model:
    """Derive every closed form of a motion along a curve under a force law.

    Parameters
    ----------
    curve : Curve
        The curve.
    kernel : Kernel
        The force law, a sum of forces.
    parameters
        Defaults in SI units that replace those of the declarations; None for a value that is given at run time.
    title
        One line of text for readers; by default that of the curve.

    Returns
    -------
    Model
        The closed forms as SymPy expressions (MATHS, sections 1 to 4).

    Raises
    ------
    DeclarationError
        If a name has two meanings, a default belongs to no parameter, or an expression is nowhere real.
    DerivationError
        If a closed form is not real and finite.
    BudgetError
        If it takes more than a minute of processor time, or is nested too deeply.
    """
    instance(curve, Curve, where="derive: curve", what="a curve, as Curve.graph or a family makes one")
    instance(kernel, Kernel, where="derive: kernel", what="a force law, as Gravity() + CoulombFriction()")
    given = {} if parameters is None else parameters
    if not isinstance(given, Mapping):
        raise ArgumentError(f"derive: parameters: must be names with values, as in {{'mu': 0.1}}, got {short(given)}")
    called = curve.title if title is None else one_line(title, where="derive: title")
    lam = curve.parameter
    kernel = kernel.along(lam, in_space=curve.in_space)
    if curve.in_space:
        _refuse_planar_forces(kernel)
    if kernel.cars:
        _refuse_of_train(kernel)
        curve = curve.in_arc_length()
        lam = curve.parameter
    defaults = join(curve, kernel, given)
    may_be_positive = tuple(name for name, value in defaults if is_positive(value))
    if curve.in_space and kernel.radius:
        curve = centre_in_space(curve, kernel.radius, dict(defaults)[str(kernel.radius)], may_be_positive)
        kernel = replace(kernel, radius=sp.S.Zero)
    check_measured(dict(defaults), units_of(curve, kernel), where="derive", final=True)
    check_order(curve.kind, curve.domain, curve.period, dict(defaults))
    values = dict(defaults)
    if not curve.charted:
        if curve.period is not None:
            check_period(curve.kind, curve.point, lam, curve.period, values)
        check_powers(curve.coordinates, curve, values)
        check_corners(curve, values, with_radius=bool(kernel.radius))
        signs = Signs(parameter=lam, domain=curve.domain, positive=curve.positive, may_be_positive=())
        curve = replace(curve, **{name: without_known_absolute_values(form, signs) for name, form in curve.coordinates})
    origin = origin_of(curve, kernel)
    about = measured_from(curve, origin)
    model = _closed_forms(about, kernel, title=called, defaults=defaults, may_be_positive=may_be_positive)
    model = measured_from_zero(model, curve, origin, (lam, LAM0, LAM1, LAM2))
    for label, form in model.closed_forms():
        check_real(form, where=label)
    if not curve.charted:
        forms = (*curve.named(model.x, model.y, model.z), (f"ds/d{lam.name}", model.ds), ("potential", model.potential))
        check_somewhere_real(forms, lam, curve.domain, values)
    return model


def _closed_forms(
    curve: Curve,
    kernel: Kernel,
    *,
    title: str,
    defaults: tuple[tuple[str, Value | None], ...],
    may_be_positive: tuple[str, ...],
) -> Model:
    """Return the closed forms of a motion along a curve whose declaration is checked."""
    lam, values = curve.parameter, dict(defaults)
    # A rotating frame pushes a body out of every vertical plane.
    heading = (None if kernel.spin else vertical_plane(curve)) if curve.in_space else AHEAD
    if heading is not None and not is_planar(heading, (curve.x, curve.y, curve.z), kernel):
        if not curve.in_space:
            raise DeclarationError(
                "derive: a force acts across the curve's plane, as of a centre with y != 0; declare the curve by "
                "Curve.space, whose contact force is a vector"
            )
        heading = None
    track = geometry(curve, may_be_positive=may_be_positive, heading=heading)
    x, z, shape = offset_curve(without_poles(curve.x), without_poles(curve.z), track, kernel.radius)
    y = without_poles(curve.y)
    body = forces((x, y, z), kernel, shape, lam)
    law = of_train(body, kernel, lam) if kernel.cars else body
    if not curve.charted:
        check_powers((("potential", law.potential),), curve, values)
    upright = upright_force(curve.banking, shape, body, lam) if curve.banking else ()
    loss, speed, level = None, conservative_speed(law, lam), level_set(curve)
    if not kernel.conservative:
        loss = _losses(curve, kernel, (x, y, z), law, shape, upright)
        speed = dissipative_speed(kernel, law, shape, loss, curve)
    pressure = shape.kappa * speed.in_other_forms + law.static_normal_load
    dxds, dyds, dzds = shape.tangent
    acceleration = law.push / kernel.inertia if loss is None else loss.along(loss.acceleration)
    potential, slope = law.effective_potential, law.effective_potential_slope
    # A rolling body is small beside its track; with a greater radius than the track's, hills and wells change places.
    tried = tried_values(values, small=kernel.radius.free_symbols)
    axes, orbits = (None, None) if loss or curve.charted else _symmetry(curve, kernel, law, shape, tried)
    start = {lam: LAM0}
    model = Model(
        curve=curve,
        force=kernel,
        title=title,
        parameter=lam,
        lam0=LAM0,
        v0=V0,
        mass=MASS,
        x=x,
        y=y,
        z=z,
        ds=shape.ds,
        dxds=dxds,
        dyds=dyds,
        dzds=dzds,
        kappa=shape.kappa,
        turning_rate=shape.turning_rate,
        turning_angle=None if shape.angle is None else shape.angle - shape.angle.xreplace(start),
        cusp=shape.cusp,
        potential=law.potential,
        inertia=kernel.inertia,
        effective_potential=potential,
        effective_potential_slope=slope,
        symmetry=axes,
        symmetric_orbits=orbits,
        static_normal_load=law.static_normal_load,
        normal=shape.normal,
        curvature_binormal=shape.curvature_binormal,
        loads=law.loads,
        coriolis=law.coriolis,
        dissipation=loss,
        speed_squared=speed.squared,
        speed_squared_form=speed.form,
        normal_force=MASS * pressure,
        side_force=sp.S.Zero
        if law.loads
        else 2 * MASS * kernel.spin * DIRECTION * sp.sqrt(speed.in_other_forms) * shape.dxds,
        tangential_acceleration=acceleration,
        time_integrand=shape.ds / sp.sqrt(speed.in_other_forms),
        regularised_integrand=shape.ds * sp.sqrt((lam - LAM1) * (LAM2 - lam) / speed.in_other_forms),
        turning_point_equation=sp.Eq(speed.squared, 0, evaluate=False),
        liftoff_equation=None if law.loads else sp.Eq(pressure, 0, evaluate=False),
        liftoff_speed_squared=None if law.loads else _liftoff_speed(speed, shape.kappa, law.static_normal_load),
        defaults=defaults,
        positive=tuple(dict.fromkeys((*shape.positive, *kernel.positive))),
        at_least=kernel.at_least,
        notes=(
            *(() if level is None else (level.note,)),
            *shape.notes,
            *(notes_of_train(kernel) if kernel.cars else ()),
            *(() if loss is None else (speed.note,)),
        ),
        level_set=level,
        sided=not law.loads or bool(upright),
        upright=upright,
        rider=rider(curve.banking, shape, body, acceleration, lam) if curve.banking else None,
        common_factor=shape.size,
    )
    if law.loads:
        model = replace(model, normal_force=model.normal_force_at(speed.in_other_forms))
    return model


def _refuse_planar_forces(kernel: Kernel) -> None:
    """Refuse forces that are defined for planar curves only."""
    if kernel.resistance and not kernel.resistance.has(sp.Abs):
        raise DeclarationError(
            "derive: surface_tension: form: the printed form's sign is so far known for planar curves only; leave it "
            "out"
        )


def _refuse_of_train(kernel: Kernel) -> None:
    """Refuse forces and curves for which trains are not supported."""
    refused = (
        ("surface_tension", kernel.resistance, "a droplet's resistance"),
        ("rolling: radius", kernel.radius, "the path of the centre of a rolling body"),
        ("rolling: mu_static", kernel.static_friction_limit, "the friction that its wheels need"),
        ("law", kernel.tangential_law, "a law of acceleration, as that of linear drag,"),
    )
    for name, given, what in refused:
        if given:
            raise DeclarationError(f"derive: {name}: {what} is not known of a train; leave it out")


def _symmetry(
    curve: Curve, kernel: Kernel, law: Forces, shape: Geometry, values: Mapping[sp.Symbol, sp.Expr]
) -> tuple[Symmetry | None, SymmetricOrbits | None]:
    """Return the axes of symmetry and the time of orbits about them."""
    lam, potential = curve.parameter, law.effective_potential
    axes = symmetry(potential, law.effective_potential_slope, shape.ds, lam, curve.domain, shape.cusp, values)
    orbits = symmetric_orbits(2 * potential, shape.ds, lam, axes)
    if axes and kernel.radius:  # for the path of a body's centre, the sign of σ is known only numerically
        axes = replace(axes, monotone=False)
        if orbits and shape.ds.has(lam):
            orbits = replace(orbits, turning_point=None)
    return axes, orbits


def _losses(
    curve: Curve, kernel: Kernel, place: Place, law: Forces, shape: Geometry, upright: tuple[sp.Expr, ...]
) -> Dissipation:
    lam = curve.parameter
    signs = Signs(parameter=lam, domain=curve.domain, positive=shape.positive, may_be_positive=())
    if law.loads and shape.cusp is not None and signs.sign(shape.cusp) is None:
        raise DeclarationError(
            f"derive: {shape.cusp} may vanish, which is a cusp; losses of energy on space curves with cusps are not "
            "supported yet, so give a domain without one"
        )
    # A curve's own parameter may be called x, and x then means the parameter in a law.
    coordinates = {symbol: form for symbol, form in zip((X, Y, Z), place, strict=True) if symbol != lam}
    pieces = {
        **{SIGMA: shape.ds, KAPPA: shape.kappa, TURN: shape.turning_rate, TILT: shape.dxds},
        **{PUSH: law.push, LOAD: law.static_normal_load},
        **dict(zip(TURNS, shape.turning, strict=False)),
        **dict(zip(LOADS, law.loads, strict=False)),
        **dict(zip(CORIOLIS, law.coriolis, strict=False)),
        **dict(zip(UPRIGHT, upright, strict=False)),
    }
    mean_car_load = load_of_cars(kernel, lam, in_space=curve.in_space) if kernel.cars else None
    loss = dissipation(kernel, pieces, coordinates, signs, mean_car_load)
    for direction, form in zip(("forwards", "backwards"), loss.holds, strict=True):
        check_real(form, where=f"the law of a body at rest that is about to move {direction}")
    return loss


def _liftoff_speed(speed: SpeedField, kappa: sp.Expr, load: sp.Expr) -> sp.Expr | None:
    """Solve kappa*W + n0 = 0 for v0**2."""
    if speed.gain is None or not kappa:
        return None
    return -(load / kappa + speed.squared.xreplace({V0: sp.S.Zero})) / speed.gain
