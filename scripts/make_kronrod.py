"""Print gqm_sym/runtime/quadrature/kronrod.py: the 21-point Gauss-Kronrod rule and its Legendre transform.

They are right to the last bit.

The Stieltjes polynomial of degree 11 is found from its orthogonality to P10 times every polynomial of degree below 11,
in 80-digit arithmetic; the transform inverts the Legendre-Vandermonde matrix, split by parity.
"""

from mpmath import legendre, matrix, mp, mpf, polyroots, quad

HEADER = '''"""The 21-point Gauss-Kronrod rule, and Legendre coefficients from values at its nodes.

Made by scripts/make_kronrod.py, in 80-digit arithmetic. Nodes are the eleven that are not negative, in rising order;
the others mirror them. ``EVEN[j] @ (g(x) + g(-x))`` is the coefficient of P_2j and ``ODD[j] @ (g(x) - g(-x))`` that of
P_(2j+1) in the interpolant of degree 20 (the first column of ``EVEN`` belongs to the middle node, taken once).
"""

import numpy as np

'''


def legendre_row(x, count):
    """P_0 ... P_(count-1) at x."""
    row = [mpf(1), x]
    for k in range(2, count):
        row.append(((2 * k - 1) * x * row[-1] - (k - 1) * row[-2]) / k)
    return row[:count]


def kronrod_nodes():
    """Return the nodes of the rule that are not negative."""
    # E11 = sum of e_k P_k over odd k, with e_11 = 1: int P10 E11 P_j = 0 for j = 1, 3, 5, 7, 9.
    odd = [1, 3, 5, 7, 9]

    def moment(k, j):
        return quad(lambda x: legendre(10, x) * legendre(k, x) * legendre(j, x), [-1, 0, 1])

    left = matrix([[moment(k, j) for k in odd] for j in odd])
    right = matrix([-moment(11, j) for j in odd])
    e = [*mp.lu_solve(left, right), mpf(1)]
    coefficients = [mpf(0)] * 12
    for weight, k in zip(e, [*odd, 11], strict=True):
        for power, c in enumerate(mp.taylor(lambda x, k=k: legendre(k, x), 0, k)):
            coefficients[power] += weight * c
    stieltjes = polyroots(coefficients[::-1], maxsteps=400, extraprec=400)
    gauss = polyroots(mp.taylor(lambda x: legendre(10, x), 0, 10)[::-1], maxsteps=400, extraprec=400)
    roots = sorted(r.real for r in [*stieltjes, *gauss])
    return [mpf(0), *roots[11:]], sorted(r.real for r in gauss)[5:]


def show(name, values):
    """Return one array as text, four numbers a line."""
    print(f"{name} = np.array(\n    [")
    for i in range(0, len(values), 4):
        print("        " + ", ".join(repr(float(v)) for v in values[i : i + 4]) + ",")
    print("    ]\n)\n")


def main():
    """Print the module."""
    mp.dps = 80
    nodes, gauss = kronrod_nodes()
    even = matrix([[legendre_row(x, 21)[2 * j] for j in range(11)] for x in nodes])
    odd = matrix([[legendre_row(x, 21)[2 * j + 1] for j in range(10)] for x in nodes[1:]])
    to_even, to_odd = even**-1, odd**-1
    # Values enter as g(x) + g(-x), except the middle one: half the coefficient for the pairs.
    even_rows = [[to_even[j, i] / (1 if i == 0 else 2) for i in range(11)] for j in range(11)]
    odd_rows = [[to_odd[j, i] / 2 for i in range(10)] for j in range(10)]
    print(HEADER, end="")
    show("NODES", nodes)
    show("KRONROD_WEIGHTS", [2 * even_rows[0][i] for i in range(11)])
    weights = [2 / ((1 - x**2) * mp.diff(lambda t: legendre(10, t), x) ** 2) for x in gauss]
    at_gauss = [mpf(0)] * 11
    for x, w in zip(gauss, weights, strict=True):
        at_gauss[min(range(11), key=lambda i: abs(nodes[i] - x))] = w
    show("GAUSS_WEIGHTS", at_gauss)
    show("EVEN", [v for row in even_rows for v in row])
    show("ODD", [v for row in odd_rows for v in row])


if __name__ == "__main__":
    main()
