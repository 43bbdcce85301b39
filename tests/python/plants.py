#!/usr/bin/env python3
"""What is true of the plants beside SR4DoF, and of SR4DoF with its constraints as they are, without any line of bench.

Reads a JSON array of questions on standard input, prints a JSON array of answers. Questions have `what` and `config`, the
object that `bench config show --json` prints.

    model      modes, residues, zeros without and with damping, of any model but `sr4dof`
    pairs      the number of CNMP pairs of the XY stage at `operating_points` (ratios of L)
    geometric  the static load of the XY stage: largest element of the geometric stiffness over that of K, and the largest
               change of a frequency in hertz
    frf        response from set-point to probe at `frequency_hz`, with hold, computing delay and amplifier
    trajectory displacement of the probe at each tick for `setpoint_a` held over each tick, quadratic constraints

How it differs from bench on purpose: the XY stage has all 26 coordinates of its 13 stages and 16 constraint equations; the
ten degrees of freedom are their null space, the geometric stiffness comes from Lagrange's multipliers. The trajectory takes
all coordinates with the constraints differentiated twice (index 1), by DOP853 at 1e-12. Zeros are those of the bordered
pencil.
"""

import json
import sys

import numpy as np
import scipy.linalg as la
from scipy.integrate import solve_ivp

from truth import complex_list, finite_eigenvalues

# The XY stage --------------------------------------------------------------------------------------------------------

NAMES = ["ms", "XL", "XR", "YT", "YB", "sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB"]
X = {name: 2 * i for i, name in enumerate(NAMES)}
Y = {name: 2 * i + 1 for i, name in enumerate(NAMES)}
DEGREES = [X["ms"], Y["ms"], Y["sL"], Y["sR"], X["sT"], X["sB"], X["gL"], X["gR"], Y["gT"], Y["gB"]]
SIDES = {"pinwheel": (1, -1), "mirror_away": (1, 1), "mirror_toward": (-1, -1)}


def parallelograms(layout):
    """(P, S, axis of the beams, side of S beside P); P is None for ground."""
    top, bottom = SIDES[layout]
    return [
        ("ms", "sL", X, -1), ("sL", "XL", X, 1), ("ms", "sR", X, 1), ("sR", "XR", X, -1),
        ("ms", "sT", Y, 1), ("sT", "YT", Y, -1), ("ms", "sB", Y, -1), ("sB", "YB", Y, 1),
        (None, "gL", Y, 1), ("gL", "XL", Y, -1), (None, "gR", Y, -1), ("gR", "XR", Y, 1),
        (None, "gT", X, top), ("gT", "YT", X, -top), (None, "gB", X, bottom), ("gB", "YB", X, -bottom),
    ]  # fmt: skip


def bending_stiffness(p):
    second_moment = p["beam_height_m"] * p["beam_thickness_m"] ** 3 / 12
    return 24 * p["youngs_modulus_pa"] * second_moment / (p["beam_length_m"] ** 3 * (1 - p["poisson_ratio"] ** 2))


def difference(coordinate, stage, other):
    d = np.zeros(26)
    d[coordinate[stage]] = 1
    if other:
        d[coordinate[other]] -= 1
    return d


def xy(p):
    """M, K without and the part of K with the static load, force vector, sensor vector, load of the floor."""
    c, k, y0 = 0.6 / p["beam_length_m"], bending_stiffness(p), p["operating_point_m"]
    static = np.zeros(26)
    static[[Y[name] for name in ("ms", "sT", "sB", "YT", "YB")]] = y0
    static[[Y[name] for name in ("sL", "sR", "gT", "gB")]] = y0 / 2
    gradients, curves, bending = [], [], np.zeros((26, 26))
    for P, S, along, side in parallelograms(p["layout"]):
        d = difference(Y if along is X else X, S, P)
        # g = a_S - a_P + c s (d q)^2 = 0
        gradients.append(difference(along, S, P) + 2 * c * side * (d @ static) * d)
        curves.append(2 * c * side * np.outer(d, d))
        bending += k * np.outer(d, d)
    A = np.array(gradients)
    N = la.null_space(A)
    N = N @ np.linalg.inv(N[DEGREES])
    mass = {"ms": p["motion_stage_mass_kg"]} | dict.fromkeys(NAMES[1:5], p["intermediate_stage_mass_kg"])
    for name, deviation in p["secondary_mass_deviation"].items():
        mass[name] = p["secondary_stage_mass_kg"] * (1 + deviation)
    M = np.diag(np.repeat([mass[name] for name in NAMES], 2))
    # Statics: bending q0 + A^T multipliers = F on YB in Y.
    held = np.eye(26)[Y["YB"]]
    right = -bending @ static
    unknown = np.linalg.lstsq(np.column_stack([A.T, -held]), right, rcond=None)[0]
    assert np.allclose(np.column_stack([A.T, -held]) @ unknown, right, atol=1e-9 * (1 + abs(right).max()))
    geometric = N.T @ sum(f * curve for f, curve in zip(unknown, curves)) @ N
    in_x = np.zeros(26)
    in_x[0::2] = 1
    return N.T @ M @ N, N.T @ bending @ N, geometric, N[X["XL"]], N[X["ms"]], N.T @ M @ in_x


# Any model -----------------------------------------------------------------------------------------------------------


def matrices(p):
    """M, K, C, force vector, sensor vector."""
    if p["model"] == "xy":
        M, K, geometric, q, c, _ = xy(p)
        K = K + geometric if p["geometric_stiffness"] else K
        return M, K, damping(p["damping"], M, K), q, c
    if p["model"] == "lumped":
        names = sorted(p["nodes"])
        M = np.diag([p["nodes"][name]["mass_kg"] for name in names])
        K = np.zeros_like(M)
        for spring in p["springs"].values():
            d = np.array([(name == spring["between"][0]) - (name == spring["between"][1]) for name in names], float)
            K += spring["stiffness_n_per_m"] * np.outer(d, d)
        q, c = ([p["nodes"][name][key] for name in names] for key in ("actuator", "sensor"))
        return M, K, damping(p["damping"], M, K), np.array(q), np.array(c)
    modes = [p["modes"][name] for name in sorted(p["modes"])]
    w, r, zeta = (np.array([mode[key] for mode in modes]) for key in ("omega_rad_s", "residue_per_kg", "damping_ratio"))
    # Another realisation than bench's: residue in the sensor, modes mixed by a rotation.
    mix = la.qr(np.vander(np.linspace(1, 2, len(w))))[0]
    square = lambda values: mix @ np.diag(values) @ mix.T
    return np.eye(len(w)), square(w * w), square(2 * zeta * w), mix @ np.ones(len(w)), mix @ r


def damping(d, M, K):
    if d["kind"] == "rayleigh":
        return d["mass_per_s"] * M + d["stiffness_s"] * K
    assert d["kind"] == "uniform"
    squares, V = la.eigh(K, M)
    return M @ V @ np.diag(2 * d["ratio"] * np.sqrt(np.maximum(squares, 0))) @ V.T @ M


def undamped_zeros(M, K, q, c):
    n, scale = len(M), np.trace(K) / np.trace(M)
    constant, linear = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    constant[:n, :n], constant[:n, n], constant[n, :n] = K / scale, -q, c
    linear[:n, :n] = M
    alpha, beta = la.eig(constant, -linear, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-9 * np.hypot(np.abs(alpha), np.abs(beta))
    roots = np.sqrt(alpha[finite] / beta[finite] * scale)
    return np.concatenate([roots, -roots])


def damped_zeros(M, K, C, q, c):
    n, scale = len(M), np.sqrt(np.trace(K) / np.trace(M))
    size = 2 * n + 1
    constant, linear = np.zeros((size, size)), np.zeros((size, size))
    constant[:n, n : 2 * n], linear[:n, :n] = np.eye(n), -np.eye(n)
    constant[n : 2 * n, :n], constant[n : 2 * n, n : 2 * n] = K / scale**2, C / scale
    constant[n : 2 * n, 2 * n], constant[2 * n, :n], linear[n : 2 * n, n : 2 * n] = -q, c, M
    alpha, beta = la.eig(constant, -linear, right=False, homogeneous_eigvals=True)
    ratio = np.abs(beta) / np.hypot(np.abs(alpha), np.abs(beta))
    return finite_eigenvalues(constant, linear, int(np.sum(ratio > 1e-7))) * scale


def cnmp_pairs(zeros):
    return int(sum((abs(z.real) > 1e-7 * abs(z)) & (abs(z.imag) > 1e-7 * abs(z)) for z in zeros)) // 4


def model(q):
    M, K, C, force, sensor = matrices(q["config"]["plant"])
    squares, V = la.eigh(K, M)
    zeros = undamped_zeros(M, K, force, sensor)
    return {
        "omega_rad_s": list(np.sqrt(np.maximum(squares, 0))),
        "damping_rate": [v @ C @ v for v in V.T],
        "residue": [(v @ force) * (v @ sensor) for v in V.T],
        "zeros": complex_list(zeros),
        "damped_zeros": complex_list(damped_zeros(M, K, C, force, sensor)),
        "cnmp_pairs": cnmp_pairs(zeros),
    }


def pairs(q):
    p = q["config"]["plant"]
    at = lambda ratio: matrices({**p, "operating_point_m": ratio * p["beam_length_m"]})
    counts = []
    for ratio in q["operating_points"]:
        M, K, _, force, sensor = at(ratio)
        counts.append(cnmp_pairs(undamped_zeros(M, K, force, sensor)))
    return {"cnmp_pairs": counts}


def geometric(q):
    M, K, part, *_ = xy(q["config"]["plant"])
    hertz = lambda stiffness: np.sqrt(la.eigvalsh(stiffness, M)) / (2 * np.pi)
    return {"ratio": abs(part).max() / abs(K).max(), "shift_hz": abs(hertz(K + part) - hertz(K)).max()}


# From set-point to probe ---------------------------------------------------------------------------------------------


def frf(q):
    """One exponential takes displacements, velocities, current and the held set-point over a period."""
    config = q["config"]
    M, K, C, force, sensor = matrices(config["plant"])
    n, rate = len(M), config["loop"]["rate_hz"]
    A = np.zeros((2 * n + 2, 2 * n + 2))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -np.linalg.solve(M, K), -np.linalg.solve(M, C)
    A[n : 2 * n, 2 * n] = np.linalg.solve(M, force) * config["motor"]["force_constant_n_per_a"]
    lag = 2 * np.pi * config["amplifier"]["bandwidth_hz"]
    A[2 * n, 2 * n], A[2 * n, 2 * n + 1] = -lag, lag
    over = la.expm(A / rate)
    F, g = over[:-1, :-1], over[:-1, -1]
    z = np.exp(2j * np.pi * np.array(q["frequency_hz"]) / rate)
    out = np.concatenate([sensor, np.zeros(n + 1)])
    response = [out @ np.linalg.solve(at * np.eye(len(F)) - F, g) for at in z]
    return complex_list(response * z ** -float(config["loop"]["computing_delay_periods"]))


# SR4DoF with quadratic constraints -----------------------------------------------------------------------------------


def trajectory(q):
    """All of q = [x1..x5, y1..y5], absolute in Y, with g(q) = 0 kept by multipliers."""
    config = q["config"]
    p, period = config["plant"], 1 / config["loop"]["rate_hz"]
    c, k, y0 = 0.6 / p["beam_length_m"], bending_stiffness(p), p["operating_point_m"]
    m3, m4, k4 = p["secondary_stage_mass_kg"], p["intermediate_stage_mass_kg"], p["spring_stiffness_n_per_m"]
    m = np.tile([p["motion_stage_mass_kg"], m3 * (1 + p["mass_asymmetry"]), m3, m4, m4], 2)
    # (near, far, side): x_far = x_near - c side (y_far - y_near)^2; stage 2 is on the left of 1, 4 on the right of 2.
    joints = [(0, 1, -1), (1, 3, 1), (0, 2, 1), (2, 4, -1)]
    start = np.concatenate([np.zeros(5), [y0, y0 / 2, y0 / 2, 0, 0]])
    start[1], start[2] = c * (y0 / 2) ** 2, -c * (y0 / 2) ** 2

    def gradient(z):
        A = np.zeros((6, 10))
        for row, (near, far, side) in enumerate(joints):
            bend = z[5 + far] - z[5 + near]
            A[row, far], A[row, near] = 1, -1
            A[row, 5 + far], A[row, 5 + near] = 2 * c * side * bend, -2 * c * side * bend
        A[4, 8] = A[5, 9] = 1
        return A

    def elastic(z):
        f = np.zeros(10)
        f[[3, 4]] = -k4 * z[[3, 4]]
        for near, far, _ in joints:
            bend = z[5 + far] - z[5 + near]
            f[5 + far] -= k * bend
            f[5 + near] += k * bend
        return f

    # What holds y0 in place, and the damping matrix of the linear structure in the four degrees of freedom.
    holding = -elastic(start)[5]
    N = la.null_space(gradient(start))
    degrees = [0, 5, 6, 7]
    N = N @ np.linalg.inv(N[degrees])
    stiffness = sum(k * np.outer(d, d) for d in (np.eye(10)[5 + f] - np.eye(10)[5 + n] for n, f, _ in joints))
    stiffness = stiffness + k4 * np.diag(np.eye(10)[3] + np.eye(10)[4])
    M4, K4 = N.T @ np.diag(m) @ N, N.T @ stiffness @ N
    d = p["damping"]
    if d["kind"] == "measured":
        w = np.array([d["first"]["omega_rad_s"], d["second"]["omega_rad_s"]])
        zeta = np.array([d["first"]["ratio"], d["second"]["ratio"]])
        mass_per_s, stiffness_s = np.linalg.solve(np.column_stack([0.5 / w, 0.5 * w]), zeta)
        C4 = mass_per_s * M4 + stiffness_s * K4
    else:
        C4 = damping(d, M4, K4)
    # A generalised force on the degrees of freedom acts on those four coordinates themselves.
    lag = 2 * np.pi * config["amplifier"]["bandwidth_hz"]

    def rate(t, state, setpoint):
        z, v, current = state[:10], state[10:20], state[20]
        A = gradient(z)
        f = elastic(z)
        f[5] += holding
        f[3] += config["motor"]["force_constant_n_per_a"] * current
        f[degrees] -= C4 @ v[degrees]
        turn = np.zeros(6)
        for row, (near, far, side) in enumerate(joints):
            turn[row] = 2 * c * side * (v[5 + far] - v[5 + near]) ** 2
        # A m^-1 (f - A^T l) + turn = 0
        multipliers = np.linalg.solve(A / m @ A.T, A @ (f / m) + turn)
        return np.concatenate([v, (f - A.T @ multipliers) / m, [lag * (setpoint - current)]])

    state, seen = np.concatenate([start, np.zeros(11)]), []
    scale = np.concatenate([np.full(10, 1e-14), np.full(10, 1e-12), [1e-12]])
    for setpoint in q["setpoint_a"]:
        seen.append(float(state[0]))
        done = solve_ivp(rate, (0, period), state, method="DOP853", args=(setpoint,), rtol=1e-12, atol=scale)
        state = done.y[:, -1]
    return {"position_m": seen}


ANSWERS = {f.__name__: f for f in (model, pairs, geometric, frf, trajectory)}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
