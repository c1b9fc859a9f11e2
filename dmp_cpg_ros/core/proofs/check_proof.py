# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Check what ``certify --proof FILE`` wrote, in exact arithmetic; ``python3 check_proof.py FILE``
needs nothing of the package. doc/certificate.md has the format and the reasons.
"""

import json
import os
import sys
from fractions import Fraction as F  # noqa: N817 - the file is read more than any other
from typing import Any

GRID, CELL, FEW, DIGITS = F(1, 2**40), F(1, 100), F(0.02), 1000


def need(holds: bool, what: str) -> None:
    """Refuse what does not hold."""
    if not holds:
        raise ValueError(what)


def read(value: Any) -> Any:
    """Fractions of strings, which must be in lowest terms."""
    if isinstance(value, (list, dict)):
        return [*map(read, value)] if type(value) is list else {x: read(value[x]) for x in value}
    need(isinstance(value, str) and len(value) < DIGITS and not value.strip('-/0123456789')
         and str(F(value)) == value, f'{value!r:.80} is no fraction')
    return F(value)


def least(x: F, holds: Any) -> F:
    """Return x if it is the smallest number of the grid for which something holds."""
    need((x / GRID).denominator == 1 and holds(x) and not holds(x - GRID), 'not the least')
    return x


def root(x: F, square: F) -> F:
    """Return x if it is the root of a square, rounded upwards to the grid."""
    return least(x, lambda y: y >= 0 and y * y >= square)


def up(x: F) -> F:
    """x, rounded upwards to 80 binary places."""
    return -F(-x * 2**80 // 1, 2**80)


def decay(x: F) -> F:
    """Upper bound of exp(-x), x >= 0."""
    return up((1 + x / 256 + x * x / 2**17)**-256)


def times(M: Any, v: Any) -> list[F]:
    """M v."""
    return [sum(a * b for a, b in zip(row, v, strict=True)) for row in M]


def field(p: Any, omega: F, z: Any) -> tuple[F, F]:
    """dz/dt of an oscillator alone."""
    grow = p['rho'] * (p['radius']**2 - z[0]**2 - z[1]**2)
    return grow * z[0] + omega * z[1], grow * z[1] - omega * z[0]


def laplacian(p: Any, held: int) -> list[list[F]]:
    """L, or L + diag(gains) where the nodes are held."""
    return [[sum(row) + held * a if i == j else -k for j, k in enumerate(row)]
            for i, (row, a) in enumerate(zip(p['coupling'], p['gains'], strict=True))]


def pull(p: Any, u: Any) -> list[F]:
    """What drives u_i outwards on the face u_i of the box, without inhibition."""
    return [p['omega_max'] * p['radius'] + max(F(0), p['rho'] * (-d * d - 2 * d * c) * (c + d)) - x
            for d, x in zip(u, times(laplacian(p, 0), u), strict=True) for c in [
                max(-3 * d / 4, -p['radius'])]]


def disagreement(p: Any, xi: Any, b: F) -> list[list[F]]:
    """Symmetric part of P (L - b I), and b xi xi', with P = diag(xi) - xi xi'."""
    N = range(len(xi))
    P = [[x * ((i == j) - y) for j, y in enumerate(xi)] for i, x in enumerate(xi)]
    PL = [times(zip(*laplacian(p, 0), strict=True), row) for row in P]
    return [[(PL[i][j] + PL[j][i]) / 2 + b * (xi[i] * xi[j] - P[i][j]) for j in N] for i in N]


def plane_rates(p: Any, u: Any, c: F, s: F, h: Any) -> list[F]:
    """What drives states on the edge of the half-plane n.y >= h into it, n = (c, -s)."""
    both = zip(times(laplacian(p, 1), [p['radius'] * c - x for x in h]), u, strict=True)
    return [x - p['omega_max'] * min(max(d - p['radius'] * s, F(0)), p['radius']) for x, d in both]


def entry_height(p: Any, c: F, s: F, sine: F) -> F:
    """Lowest n.y where |y| >= 0.98 r in C; the sine is of the angle at which both circles meet."""
    r, r0, short = p['radius'], p['region_radius'], (1 - FEW) * p['radius']
    cosine = (short**2 + r**2 - r0**2) / (2 * short * r)
    corner = short * (cosine * c - root(sine, 1 - cosine**2) * s)
    return r * c - r0 if r**2 + r0**2 - 2 * r * r0 * c >= short**2 else corner


def shrinks(p: Any, v: Any, inner: Any, rate: F) -> list[F]:
    """(M - diag(rho (r^2 - inner^2)) - rate) v."""
    return [x - (p['rho'] * (p['radius']**2 - a * a) + rate) * y
            for x, a, y in zip(times(laplacian(p, 1), v), inner, v, strict=True)]


def speeds(p: Any, omega: F, y: Any) -> list[F]:
    """|dy_i/dt|^2."""
    flows = [times(laplacian(p, 1), axis) for axis in zip(*y, strict=True)]
    return [(f - a + g * p['radius'])**2 + (e - b)**2 for (f, e), a, b, g in zip(
        (field(p, omega, z) for z in y), *flows, p['gains'], strict=True)]


def leads_outwards(p: Any, size: F) -> bool:
    """Whether Kutta's step does from a circle."""
    h, z, a = p['tick'], (size, F(0)), field(p, p['omega_max'], (size, F(0)))
    b = field(p, p['omega_max'], [x + h / 2 * k for x, k in zip(z, a, strict=True)])
    c = field(p, p['omega_max'], [x - h * k + 2 * h * m for x, k, m in zip(z, a, b, strict=True)])
    return sum((x + h * (k + 4 * m + n) / 6)**2 for x, k, m, n in zip(
        z, a, b, c, strict=True)) > size**2


def arc(p: Any) -> F:
    """Lower bound of the arc of C, 4 asin(r0/2r)."""
    q = min(F(1), p['region_radius'] / (2 * p['radius']))
    return 4 * (q + q**3 / 6 + 3 * q**5 / 40 + 5 * q**7 / 112)


def time_to_rest(p: Any, w: Any, inner: Any, size: F) -> F:
    """Bound on the time from arming to rest [s]."""
    u, v, rate, r, slow = w['u'], w['v'], w['rate'], p['radius'], p['omega_armed_min']
    own = p['omega_armed_max'] * r + F('0.385') * p['rho'] * r**3
    a = max((own + g * d + sum(row) * (d + max(u))) / x for g, d, row, x in zip(
        p['gains'], u, p['coupling'], v, strict=True))
    e = max(2 * d / x for d, x in zip(u, v, strict=True))
    # 355/113 > pi
    wait, drive = (F(710, 113) - arc(p)) / slow, up(p['omega_slope'] * r / (rate * min(v)))
    speed, activity = p['armed_speed'] * decay(p['alpha_r'] * wait), F(1)
    keep, fade, swing = (decay(x * CELL) for x in (rate, p['alpha_r'], p['activity_rate']))
    for k in range(1000):
        lows = [max(x, size - e * y) for x, y in zip(inner, v, strict=True)]
        a, e = max(a, drive * p['alpha_r'] * speed), max(e, drive * speed)
        phase = max(a * y / x for x, y in zip(lows, v, strict=True)) if min(lows) > 0 else slow + 1
        if phase <= F('0.05') and speed <= F('0.01') and activity <= FEW:
            return wait + k * CELL + 6 * p['tick']
        wanted = min(F(1), phase / slow)
        activity = up(wanted + max(F(0), activity - wanted) * swing)
        a = up(drive * p['alpha_r'] * speed * (1 - keep) + a * keep)
        e, speed = up(drive * speed * (1 - keep) + e * keep), up(speed * fade)
    raise ValueError('no time to rest')


def rows(p: Any, w: Any, alone: bool) -> dict[str, tuple[F, F]]:
    """Both sides of every inequality; the time to rest where none of the step is proved."""
    r, r0, omega, tick, gains, coupling = (p[x] for x in (
        'radius', 'region_radius', 'omega_max', 'tick', 'gains', 'coupling'))
    u, v, b, D, T, xi, rate, planes = (w[x] for x in (
        'u', 'v', 'connectivity', 'D', 'T', 'xi', 'rate', 'half_planes'))
    numbers = sum(coupling, gains + [x for x in p.values() if isinstance(x, F)])
    growth, places = p['rho'] * r**2, r * min(FEW, p['omega_at_rest'] / max(map(sum, coupling)))
    need(len(p) == 19 and len(w) == 16 and min(numbers) >= 0 == sum(row[i] for i, row in enumerate(
        coupling)) and omega >= max(p['omega_at_rest'], p['omega_armed_max']), 'range')
    found: Any = {'premises': (F(0), sum(numbers)), 'synchronisation': (growth, b)}
    need(min(D) >= 0 < min(xi) and sum(xi) == 1 == T[-1][-1] and disagreement(p, xi, b) == [
        times(T, [x * d for x, d in zip(row, D, strict=True)]) for row in T], 'factors')
    need(pull(p, u) == w['pull'] and all(
        d == r0 if gain else d == 2 * r or x <= 0 <= d - r0 - places
        for d, x, gain in zip(u, w['pull'], gains, strict=True)), 'box')
    found['capture'] = max(x / (r0 * a) for x, a in zip(w['pull'], gains, strict=True) if a), F(1)
    for c, s, height, sine, rates in planes:
        need(plane_rates(p, u, c, s, height) == rates and min(*rates, *height, s) >= 0 < c
             and c**2 + s**2 == 1 and max(height) <= entry_height(p, c, s, sine) - places, 'plane')
    inner = [max(F(0), r - d, *heights) * bool(planes) for d, *heights in zip(
        u, *(plane[2] for plane in planes), strict=True)]
    need(shrinks(p, v, inner, rate) == w['shrinks'] and min(v) > 0 <= min(w['shrinks']), 'rate')
    found['contraction'], rest = (F(0), rate), []
    for at, (y, flow, error) in zip((omega, p['omega_at_rest']), w['equilibria'], strict=True):
        far, size = ([(z[0] - x)**2 + z[1]**2 for z in y] for x in (r, F(0)))
        need(flow == speeds(p, at, y) and max(size) <= r**2 and all(
            x <= d**2 for x, d in zip(far, u, strict=True)) and all(
                c * z[0] - s * z[1] >= x for c, s, height, *_ in planes
                for z, x in zip(y, height, strict=True)), 'equilibrium')
        off = max(v) * root(error, max(x / y**2 for x, y in zip(flow, v, strict=True)) / rate**2)
        rest.append((max(x for x, gain in zip(far, gains, strict=True) if gain), min(size), off))
    found['rest_in_region'] = root(w['rest_distance'], rest[0][0]) + rest[0][2], r0
    size = -least(-w['rest_size'], lambda x: x >= 0 or x * x <= rest[1][1]) - rest[1][2]
    found['rest_radius'], mild = (r / 2, size), root(w['mild_root'], omega**2 + growth**2) + growth
    slowest, d, k = min(b - growth, rate, 2 * growth), p['damping'], p['stiffness']
    rates = p['alpha_r'], p['slowest_filter'], slowest, d * k / (k + d * d) / 3
    found['time_step'] = max(tick * mild / F('1.4'), tick**3 * mild**4 / 40 / slowest), F(1)
    found['cycle_radius'] = least(w['cycle_error'], lambda x: x >= 0 and leads_outwards(
        p, r - r * x) and not leads_outwards(p, r + r * x)), min(FEW, (r0 / r)**2)
    found['region_per_tick'] = omega * tick, arc(p)
    found['reference'], found['transformation'] = (F(0), rates[0]), (F(0), rates[3])
    found['hierarchy'] = F(0), 1 / sum(1 / x for x in rates)
    found['rest_posture'] = p['clearance'] * FEW, F(1, 100)
    arming = least(w['arming_time'], lambda x: x >= 0 and p['armed_speed'] >= p[
        'foot_speed'] * decay(p['alpha_r'] * x))
    found |= {'time_to_rest': (arming + time_to_rest(p, w, inner, size), F(10))} if alone else {}
    return found


def check(proof: Any) -> dict[str, tuple[F, F]]:
    """Return both sides of every inequality; raise an error unless the proof is one."""
    found = rows(read(proof['parameters']), read(proof['witnesses']), not proof['rest'])
    need(proof['format'] == 'dmp_cpg_ros proof 4' and len(proof) == 6 and read(proof['rows']) == {
        x: [*pair] for x, pair in found.items()} and all(a < b for a, b in found.values()), 'rows')
    return found


def once(pairs: Any) -> dict[str, Any]:
    """Names and values as a dictionary, if no name is there twice."""
    need(len(dict(pairs)) == len(pairs), 'a name twice')
    return dict(pairs)


def run(check: Any) -> None:
    """Check the file that a script is given, and end with what became of it."""
    try:
        need(os.path.isfile(sys.argv[1]), 'there is no such file, or it is a pipe or a device')
        with open(sys.argv[1], encoding='utf-8') as file:
            print('accepted:', *check(json.loads(file.read(2**20), object_pairs_hook=once)))
    except Exception as error:  # noqa: BLE001 - whatever goes wrong, it is no proof
        print(f'{" ".join(sys.argv[1:]) or "no file"} is refused: {error!r:.200}', file=sys.stderr)
        sys.exit(2 if isinstance(error, OSError) or not os.path.isfile([*sys.argv, ''][1]) else 1)


if __name__ == '__main__':
    run(check)
