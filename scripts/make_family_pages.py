"""Write a page of documentation for every family of curves: its conventions and closed forms, as derived here and now.

``python scripts/make_family_pages.py`` writes ``docs/families``; with ``--check`` it writes nothing and exits 1 if a
page is not what it would write.
"""

import sys
from pathlib import Path

import sympy as sp

import gqm_sym as gqm
from gqm_sym.building import difference, write_text
from gqm_sym.declare import Curve
from gqm_sym.derivation import Model

FOLDER = Path(__file__).parent.parent / "docs" / "families"

# What to know beyond the formulas: conventions, where the paper's Table 3 errs (ERRATA), what is known in closed form.
REMARKS = {
    "cartesian_graph": (
        "The parameter is x, so a curve with a vertical tangent needs another form: parametric, polar or implicit.",
        "sqrt(1 + phi'**2) stays in ds and in the time of flight: it is not only in the curvature.",
    ),
    "circle": (
        "The angle is measured from the lowest point and increases counter-clockwise.",
        "kappa > 0 means that the curve is traversed counter-clockwise.",
        "The period of the pendulum is 4*sqrt(L/g)*K(sin(theta_max/2)), with the complete elliptic integral K(k).",
    ),
    "ellipse": ("theta is the eccentric angle, not the polar one; theta = -pi/2 is the lowest point.",),
    "parabola": ("The half period is an elliptic integral of the second kind.",),
    "log_spiral": (
        "The pole r = 0 lies at theta = -oo where b > 0, though at a finite arc length.",
        "ds/dtheta is proportional to r, and the turning angle increases with theta.",
    ),
    "catenary": ("z = c at the lowest point, so heights are measured from the directrix.",),
    "cycloid": (
        "As printed in the paper it is an arch: the top is an unstable equilibrium, and no oscillation exists on it.",
        "ds/dtheta = 2*R*sin(theta/2) holds for 0 < theta < 2*pi only; at both ends are cusps, where a motion ends.",
        "`inverted=True` hangs it: the tautochrone, whose period 4*pi*sqrt(R/g) does not depend on the amplitude.",
    ),
    "helix": (
        "Its parameter is proportional to arc length, and its curvature R/(R**2 + c**2) is constant.",
        "A body that slides down a slope of angle a with friction tends to a speed: "
        "kappa*V**2 = g*sqrt(sin(a)**2/mu**2 - cos(a)**2).",
    ),
    "conical_helix": (
        "At theta = 0 it passes through the tip of the cone, with a tangent along the x axis and upwards.",
    ),
    "torus_knot": (
        "p and q are whole numbers from 1 to 12 that are fixed when the curve is declared. By default p = 2 and q = 3, "
        "which is the trefoil.",
        "If p and q have a common divisor, the curve is traversed several times in 2*pi, and its period is shorter.",
    ),
    "viviani": (
        "The curve is a figure of eight that crosses itself at (2*a, 0, 0); each half of the period is one loop.",
    ),
    "implicit": (
        "The parameter is arc length from the point `start`. It increases along (-F_z, F_x)/|grad F| with tangent=1, "
        "and in the opposite direction with tangent=-1.",
        "The paper's +G/|grad F|**3, G = F_xx*F_z**2 - 2*F_xz*F_x*F_z + F_zz*F_x**2, is the curvature for tangent=1; "
        "for tangent=-1 it is the negative.",
        "x(s), z(s), alpha(s) and kappa(s) are not closed forms: the module traces the curve at run time, to rounding.",
        "A closed curve is recognised and closed on itself; where grad F = 0 (a node, a cusp) a motion ends.",
        "Without a domain an open curve is followed over 2000 pieces, or 10**9 times the length of the first, "
        "each way.",
        "A start point that is off the curve by less than 1e-6 of its coordinates is moved onto it.",
    ),
}

UNTITLED = {"cartesian_graph": "Graph of a function", "implicit": "Curve given by an equation"}
# The modules that are made from families of another name, and families of which there is none.
MODULES = {"helix": "helix_coulomb", "conical_helix": "", "torus_knot": ""}
# Where a family takes arguments: those, and the module that is made from it.
EXAMPLES: dict[str, tuple[tuple[str, ...], dict[str, tuple[str, ...]], str]] = {
    "cartesian_graph": (("x**4/4 + x**3/10 + x**2/2",), {}, "quartic"),
    "implicit": (("(x/a)**4 + (z/b)**4 - 1",), {"start": ("0", "-b")}, "superellipse"),
}


def page(name: str) -> str:
    """Return the page of one family."""
    given, named, module = EXAMPLES.get(name, ((), {}, MODULES.get(name, name)))
    curve: Curve = getattr(gqm.families, name)(*given, **named)
    spelled = [_quoted(text) for text in given]
    spelled += [f"{key}=({', '.join(map(_quoted, texts))})" for key, texts in named.items()]
    model = gqm.derive(curve, gqm.Gravity())
    parts = [
        "# " + (curve.title or UNTITLED[name]).replace("*", r"\*"),
        "",
        "```python",
        f"gqm.families.{name}({', '.join(spelled)})",
        "```",
        "",
    ]
    parts += [_conventions(model), ""]
    parts += [f"- {remark}" for remark in REMARKS[name]]
    parts += ["", "Under gravity, launched at place and speed with the index 0:", "", "$$", model.latex(), "$$", ""]
    if module:
        parts += [f"A module made from it: [`generated/{module}.py`](../../generated/{module}.py).", ""]
    if name == "cycloid":
        hung = gqm.derive(gqm.families.cycloid(inverted=True), gqm.Gravity())
        parts += ["## Upside down", "", "$$", hung.latex(), "$$", ""]
        parts += ["A module: [`generated/cycloid_inverted.py`](../../generated/cycloid_inverted.py).", ""]
    return "\n".join(parts)


def _quoted(text: str) -> str:
    return f'"{text}"'


def _conventions(model: Model) -> str:
    lam, curve = model.parameter.name, model.curve
    low, high = curve.domain
    reach = f"all {lam}" if low is None and high is None else f"{sp.sstr(low)} <= {lam} <= {sp.sstr(high)}"
    if curve.period is not None:
        reach = f"closed, with period {sp.sstr(curve.period)} in {lam}"
    own = ", ".join(f"`{name}`" for name in curve.parameters) or "none"
    return f"Parameter `{lam}` ({reach}); run-time parameters: {own}."


def pages() -> dict[Path, str]:
    """Return all pages by their files."""
    names = list(REMARKS)
    index = [
        "# Families of curves",
        "",
        "The rows of the paper's Table 3, with their conventions as corrected, and space curves.",
        "",
    ]
    index += [f"- [{name}]({name}.md)" for name in names]
    return {FOLDER / "index.md": "\n".join([*index, ""]), **{FOLDER / f"{name}.md": page(name) for name in names}}


def main() -> int:
    """Write the pages, or check them."""
    if "--check" not in sys.argv[1:]:
        for path, text in pages().items():
            write_text(text, path)
        return 0
    changes = "".join(difference(text, path) for path, text in pages().items())
    print(changes, end="")
    return 1 if changes else 0


if __name__ == "__main__":
    sys.exit(main())
