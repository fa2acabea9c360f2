"""The names of the kinds of motion, of the ends of motions and legs, of events, and of the quantities of a motion.

=================== ====================================================================================
word                what it means as the end of a leg or the kind of an event
=================== ====================================================================================
"turn"              V**2 vanishes and the motion goes back
"rest"              the body stays where it is
"contact-sign"      the contact force N changes sign; this ends a leg only with friction
"liftoff"           contact is lost, because the track can push from one side only
"domain-end"        the end of the curve parameter's range
"cusp"              ds/dlam vanishes
"corner"            the tangent of the curve jumps
"singular-point"    the curve or the forces have no value there
"asymptote"         the motion approaches an equilibrium for ever
"horizon"           the horizon t_max, or the end of the first period
"slip"              of events only: static friction no longer holds a rolling body
=================== ====================================================================================
"""

from typing import Literal, TypeAlias

# Kinds of motion (MATHS, section 6).
MotionKind: TypeAlias = Literal["libration", "circulation", "transit", "asymptotic", "rest", "dissipative"]

# The kinds of the places beyond which a motion cannot go in one direction. "closed" is the launch place after a whole
# lap of a closed curve, and "open" is infinity or a pole of the curve or of the potential.
EndKind: TypeAlias = Literal["turn", "equilibrium", "domain-end", "singular-point", "cusp", "closed", "open"]

# Ends of legs, and kinds of events.
LEG_ENDS = (
    *("turn", "rest", "contact-sign", "liftoff", "domain-end", "cusp", "corner", "singular-point"),
    *("asymptote", "horizon"),
)
EVENT_KINDS = (*LEG_ENDS, "slip")

# The quantities of a motion. They are attributes and methods of motions, have gradients and uncertainties, and are used
# in sweeps, fits and designs.
PERIODIC_QUANTITIES = ("half_period", "period", "action")
FINAL_QUANTITIES = ("t_end", "rest_position")
EXTREMES = ("v_min", "v_max", "normal_force_min", "normal_force_max")
QUANTITIES = (*PERIODIC_QUANTITIES, "turning_points", *EXTREMES, "time_at", *FINAL_QUANTITIES)

# The loads on a rider of a banked track, and their extremes, which sweeps compute too, without gradients.
LOADS = ("vertical", "lateral", "longitudinal")
LOAD_EXTREMES = tuple(f"n_{load}_{which}" for load in LOADS for which in ("min", "max"))
