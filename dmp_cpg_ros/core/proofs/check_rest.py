# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Check what ``certify --proof FILE`` wrote of the time in which the step that runs comes to rest,
and all that it follows from, in exact arithmetic; ``python3 check_rest.py FILE`` needs nothing of
the package but check_proof.py and check_step.py beside it. doc/certificate.md has the reasons.
"""

from fractions import Fraction as F  # noqa: N817 - the file is read more than any other
from typing import Any

if __package__:
    from dmp_cpg_ros.core.proofs import check_proof, check_step
else:
    import check_proof  # type: ignore[import-not-found, no-redef]
    import check_step  # type: ignore[import-not-found, no-redef]

UNIT, LONGEST = 2**80, F(10)
QUIET, SLOW = F('0.05'), F('0.01')                              # phases [rad/s], feet [m/s]


def whole(x: Any) -> Any:
    """Numbers in units of 1/UNIT, rounded upwards."""
    return [*map(whole, x)] if isinstance(x, (list, tuple)) else -(-x * UNIT // 1)


def times(x: int, y: int) -> int:
    """Product of such numbers."""
    return -(-x * y // UNIT)


def total(*terms: tuple[Any, Any]) -> list[int]:
    """Sum of matrices times vectors of such numbers."""
    return [-(sum(-a * b for row, (_, v) in zip(rows, terms, strict=True) for a, b in zip(
        row, v, strict=True)) // UNIT) for rows in zip(*(X for X, _ in terms), strict=True)]


def columns(of: Any, size: int) -> Any:
    """Matrix of a linear function."""
    return [*zip(*map(of, check_step.diagonal([F(1)] * size)), strict=True)]


def rated(of: Any, shift: F, w: F) -> list[Any]:
    """Bounds of G, D, X + q, W, S_a and U_b: with c = h y' before a step, b - y = D c + B_a R_a,
    y+ - y = G c + C_a R_a + C_b R_b and c+ = (X + q) (y+ - y) + R + W c + S_a R_a + U_b R_b,
    X = phi_0(h M/2), where R_a, R_b and R are what h Q changes by from y to a, b and y+.
    """
    (half, *_), (full, f, g, k) = of
    add, Polynomial = check_step.add, check_step.Polynomial
    one = check_step.diagonal([check_step.ONE] * len(f))
    q = Polynomial(check_step.diagonal([-(shift * check_step.ONE // 1)] * len(f)), one)
    *_, C_b, _, A_y, _, _, B_a, _, _ = check_step.matrices(of, shift)
    b_2, less = Polynomial(add((4, g), (-8, k))), Polynomial(add((-1, half)))
    U_a = Polynomial(add((4, f), (-8, g))) + less @ b_2
    U_b = Polynomial(add((4, g), (-1, one), (-1, f))) + less @ C_b
    D = Polynomial(f) + q @ B_a @ A_y
    W = Polynomial(full) + less @ Polynomial(f) + q @ (U_a @ A_y + U_b @ D)
    return check_step.moduli([Polynomial(f) + q @ (b_2 @ A_y + C_b @ D), D, Polynomial(half) + q,
                              W, U_a + q @ U_b @ B_a, U_b], w)


def falling(p: Any, s: Any) -> tuple[Any, ...]:
    """What bounds, over r and in the box, |y - z| after a step by that before it; |c+| by |y+ - y|
    and |c|; |y+ - y| by |c|; and y+ by what h omega is off by. Last is what |y| does not pass.
    """
    held, near, *boxes, _ = check_step.captured(p, s)
    h, shift, none = check_step.step_of(p), s['shifts'][0], [F(0)] * len(boxes[0])
    g, w = h * p['rho'] * p['radius']**2, h * p['omega_max']
    at = check_step.moduli(check_step.matrices(held, shift), w)
    off = [check_step.lipschitz(shift, g, u, near) for u in boxes]
    most = check_step.lipschitz(shift, g, [*map(max, *boxes)], near)
    G, D, X, W, S_a, U_b = rated(held, shift, w)

    def changed(c: Any, *by: Any) -> list[F]:
        a = most(check_step.total((at[5], c)))
        b = most(check_step.total((D, c), (at[8], a)))
        return check_step.total(*zip(by, (c, a, b), strict=True))

    return (columns(lambda v: check_step.stepped(at, v, none, *off)[2], len(none)),
            columns(lambda v: [*map(sum, zip(check_step.total((X, v)), most(v), strict=True))],
                    len(none)),
            columns(lambda v: changed(v, W, S_a, U_b), len(none)),
            columns(lambda v: changed(v, G, at[2], at[3]), len(none)),
            check_step.stepped(at, none, none, *(
                lambda v, of=of: [x + near for x in of(v)] for of in off))[2], near)


def time_to_rest(p: Any, w: Any, s: Any, fallen: Any = ()) -> F:
    """Bound on the time from a request to rest [s]; w are the witnesses of check_proof.py, fallen
    is falling(p, s) where that is known.
    """
    Z, P, S, G, Y, near = whole(fallen or falling(p, s))
    h, r, u, R, tick, slow = check_step.step_of(p), p['radius'], s['box'], s['disc'], p['tick'], p[
        'omega_armed_min']
    y, _, error = w['equilibria'][1]
    check_proof.need(F(1, 10**4) <= tick <= F(1, 10), 'tick')
    check_proof.need(all((x - r)**2 + z**2 <= (d * r - v * error)**2 and d * r >= v * error
                         for (x, z), d, v in zip(y, u, w['v'], strict=True)), 'rest')
    size = (w['rest_size'] - max(w['v']) * error) / r * UNIT // 1
    inner = [max(0, (1 - d) * UNIT // 1) for d in u]
    own = p['omega_armed_max'] * R + p['rho'] * r * r * max(F('0.385'), (R * R - 1) * R)
    c = whole([h * (own + gain * d + sum(row) * (d + max(u))) for gain, d, row in zip(
        p['gains'], u, p['coupling'], strict=True)])
    e = whole([2 * d for d in u])
    m = [*map(min, e, total((G, c)))]
    wait = (F(710, 113) - check_proof.arc(p)) / slow                            # 355/113 > pi
    fade, swing = (check_proof.decay(p[name] * tick) for name in ('alpha_r', 'activity_rate'))
    speed, activity = p['armed_speed'] * check_proof.decay(p['alpha_r'] * wait), F(1)
    for k in range(int(LONGEST / tick)):
        phase = max(F(x, max(low, size - d, 1)) for x, low, d in zip(c, inner, e, strict=True)) / h
        if phase <= QUIET and speed <= SLOW and activity <= check_proof.FEW:
            return w['arming_time'] + wait + (k + 6) * tick
        wanted, away = min(F(1), phase / slow), whole(h * p['omega_slope'] * speed)
        activity = check_proof.up(wanted + max(F(0), activity - wanted) * swing)
        speed, turn = check_proof.up(speed * fade), whole(away * p['alpha_r'] * tick / UNIT)
        for last in [0] * (round(tick / h) - 1) + [turn]:
            c = [x + times(last, near) for x in total((P, m), (S, c))]
            m = [x + times(last, y) for x, y in zip(total((Z, m)), Y, strict=True)]
            e = [x + times(away, y) for x, y in zip(total((Z, e)), Y, strict=True)]
    raise ValueError('no time to rest')


def check(proof: Any) -> dict[str, tuple[F, F]]:
    """Return both sides of every inequality; raise an error unless all of them are proved."""
    found = {**check_proof.check(proof), **check_step.check(proof)}
    rest = {'step_time_to_rest': (time_to_rest(*map(check_proof.read, (
        proof['parameters'], proof['witnesses'], proof['step']['witnesses']))), LONGEST)}
    check_proof.need(check_proof.read(proof['rest']) == {
        name: list(sides) for name, sides in rest.items()} and all(
            left < right for left, right in rest.values()), 'rest')
    return {**found, **rest}


if __name__ == '__main__':
    check_proof.run(check)
