"""The file that ``gqm-gen --init`` writes: a first curve file, with what else could stand in it as comments."""

from gqm_sym.expressions import check_module_name

_TEXT = """\
# A curve, the forces on a body that moves along it, and a launch.
#
#   gqm-gen {name}.yaml            derives the closed forms and writes generated/{name}.py
#   gqm-gen {name}.yaml --solve    also runs the launch at the end of this file
#   gqm plot {name}.yaml {name}.svg
#
# Numbers are exact: 0.7 is 7/10, and pi/2 is pi/2. Editors that know JSON Schema complete and check
# such files: write the schema by `gqm schema > curve.schema.json`.

name: {name}
title: Bead in a bowl # one line for people

# Exactly one kind of curve; z points upwards.
curve:
  graph: {{z: x**2/a, parameter: x}}
  # parametric: {{x: a*cos(theta), z: a*sin(theta), parameter: theta, period: 2*pi}}
  # polar: {{r: a*theta, parameter: theta}}
  # family: {{name: cycloid, R: a, inverted: true}} # gqm families lists them

# The forces, which add. Gravity too acts only if it is named; gqm kernels lists them.
kernel:
  gravity: {{}}
  # rotating_frame: {{Omega: 1/2}}
  # rolling: {{beta: 2/5}}

# Every name in the expressions above: a number, or more about it. A unit is converted to SI; null
# means that the value is given at run time. The mass m is 1 kg and g is 9.81 m/s**2 if not said otherwise.
parameters:
  a: {{value: 140, unit: cm, description: size of the bowl}}
  m: {{value: 250, unit: g}}

# Where the motion begins, for --solve and gqm plot.
launch:
  lam0: 0.8 # the curve's parameter
  v0: 0 # speed
  # direction: -1 # against growing parameter
  # t_max: {{value: 1, unit: min}} # follow the motion so long
  # contact: above # the body lies on the track and may lift off
"""


def starter(name: str) -> str:
    """The text of a commented curve file that generates and solves.

    Parameters
    ----------
    name
        Of the generated module: a Python identifier.

    Raises
    ------
    ExpressionError
        If it may not be called so.
    """
    return _TEXT.format(name=check_module_name(name, where="name"))
