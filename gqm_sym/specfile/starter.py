"""The file that ``gqm-gen --init`` writes: a first curve file with other possible entries as comments."""

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
title: Bead in a bowl # one line of text for readers

# The curve, in exactly one of these ways; z points upwards.
curve:
  graph: {{z: x**2/a, parameter: x}}
  # parametric: {{x: a*cos(theta), z: a*sin(theta), parameter: theta, period: 2*pi}}
  # polar: {{r: a*theta, parameter: theta}}
  # family: {{name: cycloid, R: a, inverted: true}} # `gqm families` lists them

# The forces, which are added. Gravity acts only if it is listed. `gqm kernels` lists all forces.
kernel:
  gravity: {{}}
  # rotating_frame: {{Omega: 1/2}}
  # rolling: {{beta: 2/5}}

# Every other name in the expressions above, with a number or with value, unit and description. Values are
# converted to SI; null means that the value is given at run time. By default m is 1 kg and g is 9.81 m/s**2.
parameters:
  a: {{value: 140, unit: cm, description: size of the bowl}}
  m: {{value: 250, unit: g}}

# The start of the motion, for --solve and gqm plot.
launch:
  lam0: 0.8 # the curve's parameter
  v0: 0 # speed
  # direction: -1 # towards decreasing parameter
  # t_max: {{value: 1, unit: min}} # time up to which the motion is followed
  # contact: above # the body is on top of the track and can lift off
"""


def starter(name: str) -> str:
    """Return the text of a commented curve file, from which a module can be generated and solved.

    Parameters
    ----------
    name
        Name of the generated module, a Python identifier.

    Raises
    ------
    ExpressionError
        If the name is not allowed.
    """
    return _TEXT.format(name=check_module_name(name, where="name"))
