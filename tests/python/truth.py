#!/usr/bin/env python3
"""What is true of the stage, computed without any line of bench.

Reads a JSON array of questions on standard input, prints a JSON array of answers. Every question is an object with
`what` and with `config`, the object that `bench config show --json` prints: the parameters, and nothing else, are shared
with bench.

    model     modes, residues, zeros without and with damping
    margins   margins of the loop, `continuous` or sampled; stable by the poles of the closed loop
    frf       response of the rig (unmodelled modes included) from set-point to probe at `frequency_hz`
    loop      |S| = |1/(1 + L)| of the sampled loop at `omega_rad_s`
    step      settling time and overshoot of the sampled linear loop
    command   the same with the stage's unmodelled modes for a step of `height_m` behind the filters `reference` and `feedforward`
              ([delay in ticks, weight] each; the step is at tick `at`), with the largest current, change of the current from tick to
              tick and travel. `config.plant.frequency_ratio` scales the frequencies of the modelled modes
    sigma     standard deviation of the error in the steady state, from the spectra of floor, noise and quantisation, and
              by how much it differs from one run of `seconds` to the next
    bands     where along `operating_points` (ratios of L) there are CNMP zeros: their limits by bisection
    modal     zeros of constant + sum of r/(s^2 + 2 zeta w s + w^2) over `terms` [w, zeta, r], without and with damping, and
              their kinds, from polynomials of 60 digits; needs no `config`
    points    real and imaginary part at each of `omega_rad_s` in continuous time: of the `plant` in m/N, or of the `loop`
    course    the response of the sum of r/(s^2 + 2 zeta w s + w^2) over `terms` [w, zeta, r] to a unit step, at each of `time_s`;
              needs no `config`
    angle     the integral of Eq. (1-2) for each of `zeros`, up to its `omega_0`; needs no `config`
    crossing  the operating point (ratio of L) at which the two close modes have the same frequency
    veering   the operating point between `limits` (ratios of L) where the third and the fourth mode are closest, their mean
              frequency and gap there, the shares of the coordinates in their shapes there, and their MAC from limit to limit

How it differs from bench on purpose: M and K are typed in as Eq. (2-5) prints them, not assembled from constraints; the plant
is never split into modes to get a response or a sampled model: (s^2 M + s C + K) is solved as it stands, and one
exponential takes the whole chain over a period; zeros are those of the bordered pencil, not of a projection; Tustin's rule
is applied to state matrices and to H(s), never to coefficients; the controllers of Eqs. (6-6) and (6-7) are typed in.
"""

import functools
import json
import sys
import tomllib

import mpmath
import numpy as np
import scipy.linalg as la
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

UM_PER_M = 1e6

# Eq. (6-6) and Eq. (6-7): numerator, denominator by falling powers of s, prewarping frequency.
SLOW = [
    ([0.12], [1, 0], None),
    ([(179 / 2) ** 2], [1, 0.7 * 179, (179 / 2) ** 2], None),
]
FAST = [
    ([51110.0], [1, 0], None),
    ([1, 88.7], [1, 625.0], None),
    ([1.0], [1, 893.0], None),
    ([1, 2 * 0.4 * 175, 175**2], [1, 2 * 0.7 * 700, 700**2], None),
    # The notch; section by section, with the warping taken out at its own frequency.
    ([1, 2 * 0.01 * 520, 520**2], [1, 2 * 0.1 * 555, 555**2], 520.0),
]


# The plant -----------------------------------------------------------------------------------------------------------


def matrices(p):
    """M, K, Q of Eq. (2-5), the damping matrix and the load of the floor's acceleration."""
    a = 0.6 * p["operating_point_m"] / p["beam_length_m"]  # Eq. (2-6)
    m1, m3 = p["motion_stage_mass_kg"], p["secondary_stage_mass_kg"]
    m4 = m5 = p["intermediate_stage_mass_kg"]
    m2 = m3 * (1 + p["mass_asymmetry"])
    k4 = k5 = p["spring_stiffness_n_per_m"]
    second_moment = p["beam_height_m"] * p["beam_thickness_m"] ** 3 / 12
    k = 24 * p["youngs_modulus_pa"] * second_moment / (p["beam_length_m"] ** 3 * (1 - p["poisson_ratio"] ** 2))
    k12 = k24 = k13 = k35 = k
    b = a * a
    M = np.array(
        [
            [m1 + m2 + m3 + m4 + m5, a * (m2 + m4 - m3 - m5), -a * (m2 + 2 * m4), a * (m3 + 2 * m5)],
            [a * (m2 + m4 - m3 - m5), m1 + b * (m2 + m3 + m4 + m5), -b * (m2 + 2 * m4), -b * (m3 + 2 * m5)],
            [-a * (m2 + 2 * m4), -b * (m2 + 2 * m4), m2 + b * m2 + 4 * b * m4, 0],
            [a * (m3 + 2 * m5), -b * (m3 + 2 * m5), 0, m3 + b * m3 + 4 * b * m5],
        ]
    )
    K = np.array(
        [
            [k4 + k5, a * (k4 - k5), -2 * a * k4, 2 * a * k5],
            [a * (k4 - k5), k12 + k13 + b * (k4 + k5), -2 * b * k4 - k12, -2 * b * k5 - k13],
            [-2 * a * k4, -2 * b * k4 - k12, 4 * b * k4 + k24 + k12, 0],
            [2 * a * k5, -2 * b * k5 - k13, 0, 4 * b * k5 + k13 + k35],
        ]
    )
    Q = np.array([1, a, -2 * a, 0])
    # All frequencies times a ratio, with the same damping ratios.
    ratio = p.get("frequency_ratio", 1.0)
    return M, ratio**2 * K, Q, ratio * damping_matrix(p["damping"], M, K), M[:, 0]


def damping_matrix(d, M, K):
    if d["kind"] == "rayleigh":
        return d["mass_per_s"] * M + d["stiffness_s"] * K
    if d["kind"] == "measured":
        w = np.array([d["first"]["omega_rad_s"], d["second"]["omega_rad_s"]])
        zeta = np.array([d["first"]["ratio"], d["second"]["ratio"]])
        mass_per_s, stiffness_s = np.linalg.solve(np.column_stack([0.5 / w, 0.5 * w]), zeta)
        return mass_per_s * M + stiffness_s * K
    # 2 zeta sqrt(M^-1 K) in the metric of M gives every mode the same ratio.
    return 2 * d["ratio"] * np.real(M @ la.sqrtm(np.linalg.solve(M, K)))


def modes(p):
    M, K, Q, C, _ = matrices(p)
    squares, V = la.eigh(K, M)
    return [
        {
            "omega_rad_s": w,
            "damping_ratio": v @ C @ v / (2 * w),
            "residue": v[0] * (v @ Q),
            "shape": list(v / np.linalg.norm(v)),
        }
        for w, v in zip(np.sqrt(squares), V.T)
    ]


def finite_eigenvalues(constant, linear, count):
    """The `count` finite s of (constant + s linear) x = 0."""
    alpha, beta = la.eig(constant, -linear, right=False, homogeneous_eigvals=True)
    finite = np.argsort(np.abs(beta) / np.hypot(np.abs(alpha), np.abs(beta)))[::-1][:count]
    return alpha[finite] / beta[finite]


def undamped_zeros(p):
    """s with [K + s^2 M, -Q; e1, 0] singular; time is scaled so that masses and stiffnesses are of one size."""
    M, K, Q, _, _ = matrices(p)
    scale = np.sqrt(np.trace(K) / np.trace(M))
    constant, linear = np.zeros((5, 5)), np.zeros((5, 5))
    constant[:4, :4], constant[:4, 4], constant[4, 0] = K / scale**2, -Q, 1
    linear[:4, :4] = M
    roots = np.sqrt(finite_eigenvalues(constant, linear, 3).astype(complex)) * scale
    return np.concatenate([roots, -roots])


def damped_zeros(p):
    M, K, Q, C, _ = matrices(p)
    scale = np.sqrt(np.trace(K) / np.trace(M))
    constant, linear = np.zeros((9, 9)), np.zeros((9, 9))
    constant[:4, 4:8], linear[:4, :4] = np.eye(4), -np.eye(4)
    constant[4:8, :4], constant[4:8, 4:8], constant[4:8, 8], constant[8, 0] = K / scale**2, C / scale, -Q, 1
    linear[4:8, 4:8] = M
    return finite_eigenvalues(constant, linear, 6) * scale


def cnmp_pairs(p):
    zeros = undamped_zeros(p)
    return int(sum((abs(z.real) > 1e-7 * abs(z)) & (abs(z.imag) > 1e-7 * abs(z)) for z in zeros)) // 4


def complex_list(values):
    return [[float(z.real), float(z.imag)] for z in values]


def model(q):
    p = q["config"]["plant"]
    return {
        "modes": modes(p),
        "zeros": complex_list(undamped_zeros(p)),
        "damped_zeros": complex_list(damped_zeros(p)),
        "cnmp_pairs": cnmp_pairs(p),
    }


def at_point(p, ratio):
    return {**p, "operating_point_m": ratio * p["beam_length_m"]}


def bands(q):
    p, points = q["config"]["plant"], q["operating_points"]
    edges, before = [], cnmp_pairs(at_point(p, points[0])) > 0
    for low, high in zip(points, points[1:]):
        inside = cnmp_pairs(at_point(p, high)) > 0
        if inside != before:
            for _ in range(40):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if (cnmp_pairs(at_point(p, middle)) > 0) == before else (low, middle)
            edges.append(0.5 * (low + high))
        before = inside
    return {"edges": edges}


def crossing(q):
    """With D = 0 the matrices split by symmetry into [x1, y2 - y3] and [y1, y2 + y3]; each half has one of the modes."""
    p = q["config"]["plant"]
    halves = (np.array([[1, 0, 0, 0], [0, 0, 1, -1]]).T, np.array([[0, 1, 0, 0], [0, 0, 1, 1]]).T)

    def frequencies(ratio):
        M, K = matrices(at_point(p, ratio))[:2]
        return [np.sqrt(la.eigvalsh(h.T @ K @ h, h.T @ M @ h)[1]) for h in halves]

    ratio = brentq(lambda r: np.subtract(*frequencies(r)), 0.01, 0.15)
    return {"operating_point": ratio, "frequency_hz": frequencies(ratio)[0] / (2 * np.pi)}


def veering(q):
    """The loci of D other than 0 do not cross, so that modes keep their order and scipy's order serves."""
    p = q["config"]["plant"]

    def pair(ratio):
        M, K = matrices(at_point(p, ratio))[:2]
        squares, V = la.eigh(K, M)
        return M, np.sqrt(squares[2:4]) / (2 * np.pi), V[:, 2:4]

    low, high = q["limits"]
    found = minimize_scalar(lambda r: np.ptp(pair(r)[1]), bounds=(low, high), method="bounded", options={"xatol": 1e-10})
    (M0, _, V0), (_, f, V), (M1, _, V1) = pair(low), pair(found.x), pair(high)
    M = (M0 + M1) / 2
    norms = np.outer(np.diag(V0.T @ M @ V0), np.diag(V1.T @ M @ V1))
    return {
        "operating_point": found.x,
        "frequency_hz": np.mean(f),
        "gap_hz": np.ptp(f),
        "shares": [list(v**2 / (v @ v)) for v in V.T],
        "mac_across": ((V0.T @ M @ V1) ** 2 / norms).tolist(),
    }


# Plants given by their modes -----------------------------------------------------------------------------------------


def product(a, b):
    """Of two polynomials, falling powers."""
    out = [mpmath.mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def numerator(denominators, residues, constant):
    """Of constant + sum of residue/denominator."""
    def rest(left_out):
        out = [mpmath.mpf(1)]
        for i, d in enumerate(denominators):
            out = out if i == left_out else product(out, d)
        return out

    parts = [[r * c for c in rest(i)] for i, r in enumerate(residues)] + [[constant * c for c in rest(None)]]
    size = max(map(len, parts))
    padded = [[mpmath.mpf(0)] * (size - len(part)) + part for part in parts]
    sums = [mpmath.fsum(column) for column in zip(*padded)]
    while sums and sums[0] == 0:
        sums.pop(0)
    return sums


def roots(polynomial):
    return mpmath.polyroots(polynomial, maxsteps=500, extraprec=400) if len(polynomial) > 1 else []


def modal(q):
    with mpmath.workdps(60):
        terms = [[mpmath.mpf(x) for x in term] for term in q["terms"]]
        constant = mpmath.mpf(q["constant"])
        residues = [r for _, _, r in terms]
        squares = roots(numerator([[1, w * w] for w, _, _ in terms], residues, constant))
        damped = roots(numerator([[1, 2 * z * w, w * w] for w, z, _ in terms], residues, constant))
        complex_ones = [x for x in squares if abs(mpmath.im(x)) > mpmath.mpf(10) ** -30 * abs(x)]
        real_ones = [mpmath.re(x) for x in squares if x not in complex_ones]
        halves = [mpmath.sqrt(x) for x in squares]
        return {
            "zeros": complex_list([complex(s) for s in halves] + [complex(-s) for s in halves]),
            "damped_zeros": complex_list([complex(s) for s in damped]),
            "mmp": sum(x < 0 for x in real_ones),
            "real": sum(x > 0 for x in real_ones),
            "quartets": len(complex_ones) // 2,
        }


def angle(q):
    def weight(omega, x, y):
        return x / (x * x + (y - omega) ** 2) + x / (x * x + (y + omega) ** 2)

    def one(x, y, omega_0):
        near = [y] if 0 < y < omega_0 else None
        return quad(weight, 0, omega_0, args=(x, y), points=near, epsabs=1e-13, epsrel=1e-12, limit=500)[0]

    return [one(*zero) for zero in q["zeros"]]


# The chain from set-point to probe -----------------------------------------------------------------------------------


def continuous_plant(config, s):
    """Metres per ampere at s (one or many), without amplifier, delay and unmodelled modes."""
    M, K, Q, C, _ = matrices(config["plant"])
    s = np.atleast_1d(s)[:, None, None]
    right = np.broadcast_to(Q.astype(complex)[:, None], (len(s), 4, 1))
    return np.linalg.solve(s * s * M + s * C + K, right)[:, 0, 0] * config["motor"]["force_constant_n_per_a"]


def state_space(config, unmodelled):
    """x' = A x + B u + E a, y = C x: [z, z', modes beyond the model, current], time in units of `scale`."""
    M, K, Q, D, floor = matrices(config["plant"])
    kf = config["motor"]["force_constant_n_per_a"]
    extra = config["sim"]["unmodelled"] if unmodelled else []
    n = 9 + 2 * len(extra)
    A, B, E, C = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
    A[:4, 4:8] = np.eye(4)
    A[4:8, :4], A[4:8, 4:8] = -np.linalg.solve(M, K), -np.linalg.solve(M, D)
    A[4:8, -1] = np.linalg.solve(M, Q) * kf
    E[4:8] = -np.linalg.solve(M, floor)
    C[0] = 1
    for i, mode in enumerate(extra):
        at, w = 8 + 2 * i, 2 * np.pi * mode["frequency_hz"]
        A[at, at + 1] = 1
        A[at + 1, at], A[at + 1, at + 1] = -w * w, -2 * mode["damping_ratio"] * w
        A[at + 1, -1] = mode["residue_per_kg"] * kf
        C[at] = 1
    lag = 2 * np.pi * config["amplifier"]["bandwidth_hz"]
    A[-1, -1], B[-1] = -lag, lag
    return A, B, E, C


def sampled(config, unmodelled):
    """F, g of x+ = F x + g u with the set-point held over a period, and C; delay is not in it."""
    A, B, _, C = state_space(config, unmodelled)
    n = len(A)
    rate = np.zeros((n + 1, n + 1))
    rate[:n, :n], rate[:n, n] = A, B
    over = la.expm(rate / config["loop"]["rate_hz"])
    return over[:n, :n], over[:n, n], C


def resolvent(F, g, C, z):
    """C (z - F)^-1 g at each z, with F in Schur form: one substitution for all z together."""
    z = np.atleast_1d(z)
    T, U = la.schur(F, output="complex")
    right, out = U.conj().T @ g, C @ U
    x = np.zeros((len(F), len(z)), complex)
    for i in reversed(range(len(F))):
        x[i] = (right[i] + T[i, i + 1 :] @ x[i + 1 :]) / (z - T[i, i])
    return out @ x


def on_circle(config, omega):
    return np.exp(1j * np.atleast_1d(omega) / config["loop"]["rate_hz"])


def sampled_plant(config, omega, unmodelled):
    z = on_circle(config, omega)
    F, g, C = sampled(config, unmodelled)
    return resolvent(F, g, C, z) * z ** -float(config["loop"]["computing_delay_periods"])


def frf(q):
    f = np.array(q["frequency_hz"])
    return complex_list(sampled_plant(q["config"], 2 * np.pi * f, True))


# The controller ------------------------------------------------------------------------------------------------------


@functools.cache
def sections_of(name):
    if name in ("fast", "slow"):
        return FAST if name == "fast" else SLOW
    with open(name, "rb") as file:
        return [section(s) for s in tomllib.load(file)["section"]]


def sections(config):
    return sections_of(config["control"]["controller"])


def section(s):
    match s["kind"]:
        case "gain":
            return [s["gain_a_per_um"]], [1], None
        case "integrator":
            return [s["gain_a_per_um"]], [1, 0], None
        case "zero_pole":
            return [1, s["zero_rad_s"]], [1, s["pole_rad_s"]], None
        case "pole":
            return [1], [1, s["pole_rad_s"]], None
        case "pole_pair":
            w = s["omega_rad_s"]
            return [w * w], [1, 2 * s["damping_ratio"] * w, w * w], None
        case "biquad":
            pair = lambda which: [1, 2 * s[which + "_damping_ratio"] * s[which + "_rad_s"], s[which + "_rad_s"] ** 2]
            return pair("zeros"), pair("poles"), s.get("prewarp_rad_s")
        case "coefficients":
            return s["numerator"], s["denominator"], s.get("prewarp_rad_s")


def tustin_rate(prewarp, period):
    """c of s = c (z - 1)/(z + 1)."""
    return 2 / period if prewarp is None else prewarp / np.tan(prewarp * period / 2)


def continuous_controller(config, s):
    return UM_PER_M * np.prod([np.polyval(n, s) / np.polyval(d, s) for n, d, _ in sections(config)], axis=0)


def law_response(config, z):
    period = 1 / config["loop"]["rate_hz"]
    value = UM_PER_M
    for n, d, prewarp in sections(config):
        s = tustin_rate(prewarp, period) * (z - 1) / (z + 1)
        value = value * np.polyval(n, s) / np.polyval(d, s)
    return value


def companion(n, d):
    """A, B, C, D of a section in a companion form whose entries are of one size."""
    order = len(d) - 1
    n = np.concatenate([np.zeros(order + 1 - len(n)), n]) / d[0]
    d = np.array(d) / d[0]
    size = max(np.abs(d[1:] ** (1 / np.arange(1, order + 1)) if order else [1.0])) or 1.0
    A = np.zeros((order, order))
    if order:
        A[0] = -d[1:] / size ** np.arange(order)
        A[np.arange(1, order), np.arange(order - 1)] = size
    B = np.eye(order, 1)[:, 0]
    C = (n[1:] - d[1:] * n[0]) / size ** np.arange(order)
    return A, B, C, n[0]


def tustin(A, B, C, D, c):
    """The trapezoidal rule on state matrices."""
    inverse = np.linalg.inv(c * np.eye(len(A)) - A)
    return inverse @ (c * np.eye(len(A)) + A), 2 * c * inverse @ B, C @ inverse, D + C @ inverse @ B


def cascade(parts):
    """The systems (A, B, C, D) one behind the other."""
    A, B, C, D = parts[0]
    for a, b, c, d in parts[1:]:
        A = np.block([[A, np.zeros((len(A), len(a)))], [np.outer(b, C), a]])
        B, C, D = np.concatenate([B, b * D]), np.concatenate([d * C, c]), d * D
    return A, B, C, D


def open_loop(config, continuous):
    """Error in metres to position in metres."""
    gain = (np.zeros((0, 0)), np.zeros(0), np.zeros(0), UM_PER_M)
    if continuous:
        A, B, _, C = state_space(config, False)
        # The amplifier left out: its lag replaced by a straight wire.
        plant = (A[:-1, :-1], A[:-1, -1], C[:-1], 0.0)
        return cascade([gain] + [companion(n, d) for n, d, _ in sections(config)] + [plant])
    period = 1 / config["loop"]["rate_hz"]
    control = [tustin(*companion(n, d), tustin_rate(w, period)) for n, d, w in sections(config)]
    delay = (np.zeros((1, 1)), np.ones(1), np.ones(1), 0.0)
    F, g, C = sampled(config, False)
    return cascade([gain] + control + [delay] * config["loop"]["computing_delay_periods"] + [(F, g, C, 0.0)])


def closed_poles(config, continuous):
    A, B, C, D = open_loop(config, continuous)
    return la.eigvals(la.matrix_balance(A - np.outer(B, C) / (1 + D))[0])


# Margins -------------------------------------------------------------------------------------------------------------


def turning_points(config, continuous, poles):
    """(w, width) around which a response turns quickly: poles of open and closed loop, zeros of the plant."""
    if continuous:
        roots = np.concatenate([la.eigvals(open_loop(config, True)[0]), poles])
    else:
        rate = config["loop"]["rate_hz"]
        z = np.concatenate([la.eigvals(open_loop(config, False)[0]), poles])
        roots = np.log(z[np.abs(z) > 1e-9].astype(complex)) * rate
    roots = np.concatenate([roots, damped_zeros(config["plant"])])
    return [(abs(r.imag), max(abs(r.real), 1e-7 * abs(r))) for r in roots if r.imag > 0]


def frequencies(config, continuous, poles):
    slowest = modes(config["plant"])[0]["omega_rad_s"]
    nyquist = np.pi * config["loop"]["rate_hz"]
    high = 1e6 if continuous else nyquist * (1 - 1e-9)
    grid = [np.geomspace(1e-4 * min(slowest, nyquist), high, 6001)]
    for w, width in turning_points(config, continuous, poles):
        grid.append(w + width * np.sinh(np.linspace(-9, 9, 401)))
    grid = np.unique(np.concatenate(grid))
    return grid[(grid >= 1e-4 * min(slowest, nyquist)) & (grid <= high)]


def margins(q):
    config, continuous = q["config"], q["continuous"]
    poles = closed_poles(config, continuous)
    w = frequencies(config, continuous, poles)
    if continuous:
        response = lambda w: continuous_plant(config, 1j * w) * continuous_controller(config, 1j * np.atleast_1d(w))
    else:
        F, g, C = sampled(config, False)
        delay = float(config["loop"]["computing_delay_periods"])

        def response(w):
            z = on_circle(config, w)
            return resolvent(F, g, C, z) * z**-delay * law_response(config, z)

    L = response(w)
    one = lambda f: (lambda x: float(f(response(x)[0])))
    changes = lambda values: np.nonzero((values[:-1] > 0) != (values[1:] > 0))[0]
    solve = lambda f, i: brentq(f, w[i], w[i + 1], xtol=1e-12 * w[i], rtol=1e-14)
    gain = lambda l: np.log(np.abs(l))
    at = [(solve(one(gain), i), gain(L[i]) > 0) for i in changes(gain(L))]
    crossings = [(x, float(np.degrees(np.angle(-response(x)[0])))) for x, _ in at]
    phase = [response(solve(one(np.imag), i))[0] for i in changes(L.imag) if L[i].real < 0 or L[i + 1].real < 0]
    decibels = [-20 * np.log10(abs(l)) for l in phase if l.real < 0]
    S = 1 / np.abs(1 + L)
    peak = S.max()
    tops = np.nonzero((S[1:-1] >= S[:-2]) & (S[1:-1] >= S[2:]))[0] + 1
    for i in tops[np.argsort(S[tops])][-8:]:
        found = minimize_scalar(
            lambda x: -1 / abs(1 + response(x)[0]), bounds=(w[i - 1], w[i + 1]), method="bounded", options={"xatol": 1e-9 * w[i]}
        )
        peak = max(peak, -found.fun)
    rise = lambda l: -np.log(np.abs(1 + l)) + 0.5 * np.log(2)
    rises = [i for i in changes(rise(L)) if rise(L[i]) < 0]
    reach = np.log(np.abs(poles)).max() if not continuous else poles.real.max()
    return {
        "crossover_rad_s": next((x for x, falls in at if falls), None),
        "phase_margin_deg": min((m for _, m in crossings), key=abs, default=None),
        "gain_margin_db": min(decibels, key=abs, default=None),
        "modulus_margin": 1 / peak,
        "sensitivity_bandwidth_rad_s": solve(one(rise), rises[0]) if rises else None,
        "stable": bool(reach < 0),
        # How far the nearest pole is from the border: nothing can be said of a loop on it.
        "border_rad_s": float(abs(reach) * (1 if continuous else config["loop"]["rate_hz"])),
        "crossings": [{"rad_s": x, "phase_margin_deg": m} for x, m in crossings],
    }


def points(q):
    config, s = q["config"], 1j * np.array(q["omega_rad_s"])
    plant = continuous_plant(config, s)
    if q["of"] == "plant":
        return complex_list(plant / config["motor"]["force_constant_n_per_a"])
    return complex_list(plant * continuous_controller(config, s))


# Time and noise ------------------------------------------------------------------------------------------------------


def sensitivity(config, omega):
    z = on_circle(config, omega)
    return 1 / (1 + sampled_plant(config, omega, False) * law_response(config, z))


def loop(q):
    return {"sensitivity": [float(s) for s in np.abs(sensitivity(q["config"], np.array(q["omega_rad_s"])))]}


def step(q):
    """2 % settling and overshoot of the closed loop from rest, over `seconds` after a unit step."""
    config = q["config"]
    A, B, C, D = open_loop(config, False)
    closed, drive = A - np.outer(B, C) / (1 + D), B / (1 + D)
    ticks = int(round(q["seconds"] * config["loop"]["rate_hz"]))
    x, y = np.zeros(len(A)), np.zeros(ticks)
    for k in range(ticks):
        y[k] = C @ x
        x = closed @ x + drive
    outside = np.nonzero(np.abs(y - 1) > 0.02)[0]
    settled = outside[-1] + 1 if len(outside) else 0
    return {
        "settling_time_s": settled / config["loop"]["rate_hz"] if settled < ticks else None,
        "overshoot_percent": 100 * max(0.0, float(y.max() - 1)),
    }


def filtered(taps, height, at, ticks):
    """A step at tick `at` behind a filter."""
    values = np.zeros(ticks)
    for delay, weight in taps:
        values[max(at + delay, 0) :] += weight * height
    return values


def command(q):
    """The loop tick by tick: controller on the error, feedforward added, one period of delay for each configured one."""
    config, height, at = q["config"], q["height_m"], q["at"]
    rate = config["loop"]["rate_hz"]
    ticks = int(round(q["seconds"] * rate))
    reference = filtered(q["reference"], height, at, ticks)
    feedforward = filtered(q["feedforward"], height, at, ticks)
    gain = (np.zeros((0, 0)), np.zeros(0), np.zeros(0), UM_PER_M)
    a, b, c, d = cascade([gain] + [tustin(*companion(n, m), tustin_rate(w, 1 / rate)) for n, m, w in sections(config)])
    F, g, C = sampled(config, True)
    waiting = [0.0] * config["loop"]["computing_delay_periods"]
    x, p = np.zeros(len(a)), np.zeros(len(F))
    position, current = np.zeros(ticks), np.zeros(ticks)
    for k in range(ticks):
        position[k] = C @ p
        error = reference[k] - position[k]
        current[k] = c @ x + d * error + feedforward[k]
        x = a @ x + b * error
        waiting.append(current[k])
        p = F @ p + g * waiting.pop(0)
    after = position[at:]
    outside = np.nonzero(np.abs(after - height) > 0.02 * abs(height))[0]
    settled = outside[-1] + 1 if len(outside) else 0
    return {
        "settling_time_s": settled / rate if settled < len(after) else None,
        "overshoot_percent": 100 * max(0.0, float((after / height).max() - 1)),
        "current_a": float(np.abs(current).max()),
        "change_a": float(np.abs(np.diff(current, prepend=0.0)).max()),
        "travel_m": float(np.abs(position).max()),
    }


def course(q):
    terms = q["terms"]
    A = la.block_diag(*[[[0, 1], [-w * w, -2 * zeta * w]] for w, zeta, _ in terms])
    B = np.concatenate([[0.0, r] for _, _, r in terms])
    C = np.tile([1.0, 0.0], len(terms))
    # The step is one state more, which stands at 1.
    whole = np.zeros((len(A) + 1, len(A) + 1))
    whole[:-1, :-1], whole[:-1, -1] = A, B
    return [float(C @ la.expm(whole * t)[:-1, -1]) for t in q["time_s"]]


def sigma(q):
    """Root of the integral of |S|^2 (probe) + |S P_floor|^2 (floor), seen at the probe, noise included.

    The floor moves slowly against a tick: its way to the probe is taken in continuous time, the loop is sampled.
    """
    config = q["config"]
    sim, rate = config["sim"], config["loop"]["rate_hz"]
    poles = closed_poles(config, False)
    w = frequencies(config, False, poles)
    w = w[w > 0.05]
    S = np.abs(sensitivity(config, w))
    # Noise and quantisation (its error is white, as the noise is larger than a step) spread over rate/2 hertz.
    variance = sim["probe_noise_rms_m"] ** 2 + sim["probe_quantisation_m"] ** 2 / 12
    power = np.full(len(w), variance / (rate / 2))
    M, K, _, C, load = matrices(config["plant"])
    s = (1j * w)[:, None, None]
    right = np.broadcast_to(load.astype(complex)[:, None], (len(w), 4, 1))
    way = np.abs(np.linalg.solve(s * s * M + s * C + K, right)[:, 0, 0])
    for line in sim["floor"]:
        w0, zeta = 2 * np.pi * line["frequency_hz"], line["damping_ratio"]
        band = np.abs(2 * zeta * w0 * 1j * w / (w0 * w0 - w * w + 2j * zeta * w0 * w)) ** 2
        # The integral of the band-pass over frequency in hertz is pi zeta f0.
        power = power + way**2 * line["acceleration_rms_m_per_s2"] ** 2 * band / (np.pi * zeta * line["frequency_hz"])
    power, f = S**2 * power, w / (2 * np.pi)
    variance = np.trapezoid(power, f)
    # The variance found in T seconds of a Gaussian process has the variance (1/T) times the integral of its spectrum squared.
    spread = 0.5 * np.sqrt(np.trapezoid(power**2, f) / q["seconds"]) / variance
    return {"sigma_m": float(np.sqrt(variance)), "relative_spread": float(spread)}


ANSWERS = {f.__name__: f for f in (model, margins, frf, loop, step, command, sigma, bands, crossing, veering, modal, angle, points, course)}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
