# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Check what ``certify --proof FILE`` wrote of the step that runs, in exact arithmetic;
``python3 check_step.py FILE`` needs nothing of the package but check_proof.py beside it. It is
about the part ``step`` alone. doc/certificate.md has the format and the reasons.
"""

from fractions import Fraction as F  # noqa: N817 - the file is read more than any other
from typing import Any

if __package__:
    from dmp_cpg_ros.core.proofs.check_proof import need, read, run
else:
    from check_proof import need, read, run  # type: ignore[import-not-found, no-redef]

GRID, TINY, ONE, FEW = F(1, 2**40), F(1, 2**80), 2**400, F(0.02)
QUICKEST, FARTHEST, STEPS = F('2.5'), F('1.29'), 200           # of omega, of r, in a second


def root(square: F) -> F:
    """Upper bound of a root, not below GRID; the guess is in floating point."""
    x = F(float(square)**0.5) + GRID
    need(x * x >= square, 'root')
    return x


def add(*terms: tuple[Any, Any], over: int = 1) -> Any:
    """Sum of factors times matrices; entries of matrices are whole numbers, in units of 1/ONE."""
    return [[sum(c * x for (c, _), x in zip(terms, entries, strict=True)) // over
             for entries in zip(*rows, strict=True)]
            for rows in zip(*(X for _, X in terms), strict=True)]


def product(X: Any, Y: Any) -> Any:
    """Product of matrices."""
    return [[sum(a * b for a, b in zip(row, column, strict=True)) // ONE
             for column in zip(*Y, strict=True)] for row in X]


def diagonal(numbers: Any) -> Any:
    """Matrix with some numbers on its diagonal."""
    return [[x * (i == j) for j in range(len(numbers))] for i, x in enumerate(numbers)]


def phi(z: Any) -> tuple[Any, Any]:
    """phi_0 to phi_3 of -z/2 and of -z, phi_k(-z) = sum of (-z)^j/(j + k)!."""
    z, one = add((1, z), over=2), diagonal([ONE] * len(z))
    if max(sum(map(abs, row)) for row in z) > ONE:
        f = phi(z)[1]
    else:
        f = [term := add((1, one), over=6)]
        for j in range(4, 84):
            term = add((-1, product(term, z)), over=j)
            f[0] = add((1, f[0]), (1, term))
        for share in (2, 1, 1):
            f.insert(0, add((1, add((1, one), over=share)), (-1, product(z, f[0]))))
    return f, [add((2, product(f[0], f[k])), *(((2, 2, 1)[k - j], f[j]) for j in range(1, k + 1)),
                   over=2**(k + 1)) for k in range(4)]


class Polynomial:
    """Of degree 3 at most in -i w, with matrices."""

    def __init__(self, *coefficients: Any) -> None:
        self.d = [*coefficients, *[add((0, coefficients[0]))] * (4 - len(coefficients))]

    def __add__(self, other: Any) -> Any:
        return Polynomial(*(add((1, x), (1, y)) for x, y in zip(self.d, other.d, strict=True)))

    def __matmul__(self, other: Any) -> Any:
        return Polynomial(*(add(*((1, product(self.d[j], other.d[m - j])) for j in range(m + 1)))
                            for m in range(4)))


def matrices(of: Any, shift: F) -> list[Polynomial]:
    """T, C_y, C_a, C_b, A, A_y, B, B_y, B_a, C, B_c of a step of y' = -M y + q y + Q, of h Q in
    place of Q, with q h = -shift - i w, from phi of h M.
    """
    (half, short, *_), (whole, f, g, k) = of
    q = Polynomial(diagonal([-(shift * ONE // 1)] * len(half)), diagonal([ONE] * len(half)))
    b_1, b_2, C_b = map(Polynomial, (
        add((1, f), (-3, g), (4, k)), add((4, g), (-8, k)), add((4, k), (-1, g))))
    A_y, B_a, back = map(Polynomial, (add((1, short), over=2), add((2, f)), add((-1, f))))
    A = Polynomial(half) + q @ A_y
    B, B_y = Polynomial(whole) + q @ (back + B_a @ A), back + q @ B_a @ A_y
    C_y, C_a = b_1 + q @ (b_2 @ A_y + C_b @ B_y), b_2 + q @ C_b @ B_a
    T = Polynomial(whole) + q @ (b_1 + b_2 @ A + C_b @ B)
    return [T, C_y, C_a, C_b, A, A_y, B, B_y, B_a, C_y + C_a + C_b, B_y + B_a]


def moduli(polynomials: list[Polynomial], w: F) -> list[Any]:
    """Bounds of the moduli of all entries a - i b w' - c w'^2 + i d w'^3, |w'| <= w."""
    n, m = (w * w).as_integer_ratio()
    return [[[root(F(m**3 * a * a + n * (m * m * max(b * b - 2 * a * c, 0) + n * (m * max(
        c * c - 2 * b * d, 0) + n * d * d)), m**3 * ONE**2)) for a, b, c, d in zip(
            *rows, strict=True)] for rows in zip(*of.d, strict=True)] for of in polynomials]


def total(*terms: tuple[Any, Any]) -> list[F]:
    """Sum of matrices times vectors, rounded upwards."""
    return [sum(-a * b for row, (_, v) in zip(rows, terms, strict=True) for a, b in zip(
        row, v, strict=True)) // TINY * -TINY for rows in zip(*(X for X, _ in terms), strict=True)]


def phi_of(p: Any, held: int) -> Any:
    """Make :func:`phi` of h M, M = L, or L + diag(gains) where the nodes are held."""
    return phi([[(sum(row) - k + held * a if i == j else -k) * step_of(p) * ONE // 1
                 for j, k in enumerate(row)] for i, (row, a) in enumerate(zip(
                     p['coupling'], p['gains'], strict=True))])


def step_of(p: Any) -> F:
    """Length of a step of the oscillators, some of which make a tick."""
    return p['tick'] / -((F(1, 10**9) - p['tick'] * STEPS) // 1)


def shifted(g: F, u: Any, far: F) -> list[F]:
    """Largest h |kappa (y - x_d) + rho (r^2 - |y|^2) y|/r, kappa = 2 rho r^2, |y - x_d| <= u r;
    its square is concave in d = |y|^2/r^2 - 1 where it is largest, so that d may be a guess.
    """
    d = [(x := min(y, far + 1)**2, max(F(-1), F((1 - float(1 + 6 * x)**0.5) / 3))) for y in u]
    return [g * root(4 * y - 2 * y * z - z * z + z**3 + 2 * max(
        m := 3 * z * z - 2 * z - 2 * y, -m * (z > -1))) for y, z in d]


def radial(g: F, far: Any) -> list[F]:
    """Largest h rho |r^2 - |y|^2||y|/r, |y| <= far r."""
    return [g * max(F('0.385'), (x * x - 1) * x) for x in far]


def stepped(at: Any, u: Any, c: Any, *off: Any) -> tuple[list[F], list[F], list[F]]:
    """What distances or differences u, and c that is constant, become in the stages and the step;
    off makes of those of y, a and b what h Q is.
    """
    T, C_y, C_a, C_b, A, A_y, B, B_y, B_a, C, B_c = at
    y = off[0](u)
    a = total((A, u), (A_y, c), (A_y, y))
    b = total((B, u), (B_c, c), (B_y, y), (B_a, off[1](a)))
    return a, b, total((T, u), (C, c), (C_y, y), (C_a, off[1](a)), (C_b, off[2](b)))


def size(p: Any, held: int, of: Any, w: F, R: F) -> tuple[Any, F]:
    """Bounds of the step with and without shift; what |y| and its stages do not pass, over r, in a
    disc that is kept.
    """
    g, pull = step_of(p) * p['rho'] * p['radius']**2, [step_of(p) * held * a for a in p['gains']]
    at, plain = (moduli(matrices(of, shift), w) for shift in (2 * g, F(0)))
    need(1 <= R >= max(stepped(at, [R] * len(pull), pull, *[lambda u: [2 * g] * len(u)] * 3)[2]),
         'disc')
    a, b, _ = stepped(plain, [R] * len(pull), pull, *[lambda u: radial(g, u)] * 3)
    need(max(R, *a, *b) <= FARTHEST, 'stages')
    return (at, plain), max(R, *a, *b)


def boxed(p: Any, both: Any, u: Any, w: F, far: F) -> tuple[list[F], list[F], list[F]]:
    """Distances from x_d over r, of the stages of a box and after the step."""
    (at, plain), c, g = both, [w] * len(u), step_of(p) * p['rho'] * p['radius']**2
    other = stepped(plain, u, c, *[lambda u: radial(g, [far] * len(u))] * 3)[1]
    a, b, last = stepped(at, u, c, *[lambda u: shifted(g, u, far)] * 2, lambda u: shifted(
        g, [*map(min, u, other)], far))
    return a, [*map(min, b, other)], last


def captured(p: Any, s: Any) -> tuple[Any, ...]:
    """Functions of the inhibited step, what |y| does not pass over r, the box, its stages, and
    where it ends.
    """
    w, of = step_of(p) * p['omega_max'], phi_of(p, 1)
    both, near = size(p, 1, of, w, s['disc'])
    return of, near, s['box'], *boxed(p, both, s['box'], w, near)


def gram(of: Polynomial, xi: Any) -> list[Any]:
    """Coefficients of the square of what a polynomial makes of (sum of xi |y - mean|^2)^1/2, but
    for a factor i of those that are odd.
    """
    spread = [[x * ((i == j) - y) * ONE // 1 for j, y in enumerate(xi)] for i, x in enumerate(xi)]
    left, right = [[*zip(*x, strict=True)] for x in of.d], [product(spread, x) for x in of.d]
    return [add(*((1 if (2 * j - m) % 4 < 2 else -1, product(left[j], right[m - j]))
                  for j in range(max(0, m - 3), min(m, 3) + 1))) for m in range(7)]


def bernstein(K: list[Any], t: F) -> list[Any]:
    """Matrices whose means are all values in [0, t] of a polynomial with four coefficients K."""
    return [add((1, K[0]), (F(k, 3) * t, K[1]), (F(k * (k - 1), 6) * t**2, K[2]),
                (k // 3 * t**3, K[3])) for k in range(4)]


def norm(of: Polynomial, xi: Any, w: F, most: F) -> F:
    """Return a bound of what a polynomial makes of differences between nodes, if it is one."""
    K = gram(of, xi)
    spare = most * most - sum(w**m * root(sum(F(x * x, ONE**2) / (a * b) for a, row in zip(
        xi, K[m], strict=True) for b, x in zip(xi, row, strict=True))) for m in (1, 3, 5))
    for even in bernstein(K[::2], w * w):
        S = [[spare * x * ((i == j) - y) - k / F(ONE) + x * y for j, (y, k) in enumerate(zip(
            xi, row, strict=True))] for i, (x, row) in enumerate(zip(xi, even, strict=True))]
        while S:                                                 # positive, by elimination
            (pivot, *top), *rest = S
            need(pivot > 0, 'norm')
            S = [[x - row[0] * y / pivot for x, y in zip(row[1:], top, strict=True)]
                 for row in rest]
    return most + GRID


def lipschitz(shift: F, g: F, u: Any, far: F) -> Any:
    """What h Q makes of differences, at distances u from x_d and in a disc, over r."""
    return lambda v: [y * max(shift + g * (1 - max(F(0), 1 - x)**2), g * (
        3 * min(1 + x, far)**2 - 1) - shift) for x, y in zip(u, v, strict=True)]


def rows(p: Any, xi: Any, s: Any) -> dict[str, tuple[F, F]]:
    """Both sides of the inequalities of the step."""
    h, r0, gains, v = step_of(p), p['region_radius'] / p['radius'], p['gains'], s['v']
    g, w, (shift, loose) = h * p['rho'] * p['radius']**2, h * p['omega_max'], s['shifts']
    most, rates = max(map(sum, p['coupling'])), [*gains, *sum(p['coupling'], []), p['rho']]
    need(min(*rates, w, p['omega_at_rest'], shift, loose, 1 - shift, 1 - loose, 1 - 2 * g,
             1 - QUICKEST * w, min(v) - GRID, min(xi) - F(1, 2**256), 16 - len(xi),
             2**16 - h * sum(rates)) >= 0 and sum(xi) == 1 and len(s) == 5, 'range')
    _, far = size(p, 0, free := phi_of(p, 0), QUICKEST * w, s['disc'])
    held, near, u, a, b, last = captured(p, s)
    entry = r0 + min(FEW, p['omega_at_rest'] / most)
    need(all(d == r0 if gain else d >= min(s['disc'] + 1, max(x, entry))
             for d, x, gain in zip(u, last, gains, strict=True)), 'box')
    Z = stepped(moduli(matrices(held, shift), w), v, [F(0)] * len(v), *(
        lipschitz(shift, g, x, near) for x in (u, a, b)))[2]
    norms = [[[norm(of, xi, QUICKEST * w, x)]] for of, x in zip(
        matrices(free, loose)[:9], s['norms'], strict=True)]
    Y = stepped([*norms, *norms[:2]], [F(1)], [F(0)], *[lipschitz(loose, g, [far + 1], far)] * 3)
    return {'step_premises': (F(0), sum([s['disc'], *s['shifts'], *s['norms'], *u, *v])),
            'step_capture': (max(x for x, gain in zip(last, gains, strict=True) if gain), r0),
            'step_contraction': (max(x / y for x, y in zip(Z, v, strict=True)), F(1)),
            'step_synchronisation': (*Y[2], F(1))}


def check(proof: Any) -> dict[str, tuple[F, F]]:
    """Return both sides of every inequality of the step; raise an error unless it is proved."""
    found = rows(*map(read, (
        proof['parameters'], proof['witnesses']['xi'], proof['step']['witnesses'])))
    need(len(proof['step']) == 2 and all(left < right for left, right in found.values()) and read(
        proof['step']['rows']) == {name: list(sides) for name, sides in found.items()}, 'rows')
    return found


if __name__ == '__main__':
    run(check)
