#!/usr/bin/env python3
"""Controllers made by python-control and scipy, for a comparison with bench.

    random FOLDER   writes random controllers FOLDER/INDEX.toml; prints for each of them and each of its frequencies a line
                    index, rate in Hz (0: continuous), frequency in rad/s, the response of the numbers in the file with 60 digits
                    (re, im), that of python-control (re, im), a bound of the relative error that rounding has there (of the
                    coefficients of polynomials; of matrices in a backward stable algorithm), and whether all poles of the numbers in the file are stable (1 or 0)
    fast FOLDER     the same for the fast controller of the thesis, Eq. (6-7), as tf, zpk and ss, continuous and discrete
    files FOLDER    writes the controllers of standard input (JSON: num, den, z, p, k, A, B, C, D, Ts) in every format
    fields FOLDER   writes the JSON array of objects of standard input as INDEX-struct.mat, INDEX-top.mat and INDEX.npz
    gain FOLDER     writes a static gain of 2e4 as matrices without states: gain.mat, gain.npz
    butterworth FOLDER   writes 60 Butterworth filters at 5 kHz as INDEX.npz, as polynomials and as matrices; prints for each of them
                    and each of its frequencies a line index, frequency in rad/s, the response of the numbers in the file with 60
                    digits (re, im), the largest magnitude in the band, whether its poles are stable (1 or 0), the form (0: polynomials,
                    1: zeros and poles, 2: matrices)
    integrators FOLDER   the same for 40 random controllers with an integrator at 1 to 20 kHz, in three forms, by Tustin's rule and
                    with a zero-order hold
    runs            reads a JSON array of controllers with `input`; prints a line for each: the output of scipy.signal.lfilter
                    (num, den) or dlsim (A, B, C, D)
"""

import json
import sys

import control
import mpmath
import numpy as np
import scipy.io
import scipy.signal

mpmath.mp.dps = 60
RATE_HZ = 5000.0
FREQUENCIES = 5


def number(x):
    return repr(float(x))


def numbers(values):
    return "[" + ", ".join(number(x) for x in np.ravel(values)) + "]"


def pairs(values):
    return "[" + ", ".join(f"[{number(x.real)}, {number(x.imag)}]" for x in np.asarray(values, complex)) + "]"


def tables(form, parts):
    if form == "tf":
        return f"numerator = {numbers(parts[0])}\ndenominator = {numbers(parts[1])}\n"
    if form == "zpk":
        return f"zeros = {pairs(parts[0])}\npoles = {pairs(parts[1])}\ngain = {number(parts[2])}\n"
    a, b, c, d = parts
    rows = ", ".join(numbers(row) for row in a)
    return f"a = [{rows}]\nb = {numbers(b)}\nc = {numbers(c)}\nd = {number(np.ravel(d)[0])}\n"


def toml(form, parts, rate_hz):
    rate = f"rate_hz = {rate_hz}\n" if rate_hz else ""
    return f'title = "random"\n[{form}]\ngain_unit = "A/um"\n{rate}{tables(form, parts)}'


def mp(values):
    return [mpmath.mpmathify(complex(x) if np.iscomplexobj(x) else float(x)) for x in np.ravel(values)]


def exact(form, parts, v):
    """The response of the numbers themselves."""
    if form == "tf":
        return mpmath.polyval(mp(parts[0]), v) / mpmath.polyval(mp(parts[1]), v)
    if form == "zpk":
        value = mpmath.mpf(float(parts[2]))
        for zero in mp(np.asarray(parts[0], complex)):
            value *= v - zero
        for pole in mp(np.asarray(parts[1], complex)):
            value /= v - pole
        return value
    a, b, c, d = (mpmath.matrix(np.atleast_2d(part).tolist()) for part in parts)
    n = a.rows
    state = mpmath.lu_solve(v * mpmath.eye(n) - a, b)
    return (c * state)[0] + d[0]


def are_stable(form, parts, rate_hz):
    """By the poles of the numbers themselves; a pole within rounding of the integrator counts as one."""
    if form == "tf":
        falling = np.trim_zeros(np.asarray(parts[1], float), "f")
        last = len(falling) - len(np.trim_zeros(falling, "b"))
        kept = mp(falling[: len(falling) - last])
        poles = mpmath.polyroots(kept, maxsteps=500, extraprec=400) if len(kept) > 1 else []
        poles = list(poles) + [mpmath.mpf(0)] * last
    elif form == "zpk":
        poles = mp(np.asarray(parts[1], complex))
    else:
        poles = list(mpmath.eig(mpmath.matrix(np.atleast_2d(parts[0]).tolist()), left=False, right=False))
    origin = 1 if rate_hz else 0
    integrators = sum(1 for pole in poles if pole == origin)
    others = [pole for pole in poles if pole != origin]
    inside = [abs(pole) < 1 if rate_hz else pole.real < 0 for pole in others]
    return int(integrators < 2 and all(inside))


def rounding(form, parts, v):
    """Relative change of the response when every number changes by half a unit in the last place, times the order."""
    v = complex(v)
    if form != "ss":
        # python-control keeps zeros and poles as polynomials.
        if form == "zpk":
            parts = (np.poly(parts[0]), np.poly(parts[1]))
        parts = [np.atleast_1d(part) for part in parts]
        terms = [np.polyval(np.abs(part), abs(v)) / abs(np.polyval(part, v)) for part in parts]
        return 2.2e-16 * len(parts[1]) * sum(terms)
    # Normwise in balanced coordinates, as for any backward stable algorithm.
    a, b, c, d = (np.atleast_2d(np.asarray(part, float)) for part in parts)
    bordered = np.block([[a, b], [c, np.zeros((1, 1))]])
    _, (scale, _) = scipy.linalg.matrix_balance(bordered, permute=False, separate=True)
    t = scale[:-1]
    a, b, c = a / t[:, None] * t[None, :], b / t[:, None], c * t[None, :]
    resolvent = np.linalg.inv(v * np.eye(len(a)) - a)
    x, y = np.linalg.norm(c @ resolvent), np.linalg.norm(resolvent @ b)
    value = abs((c @ resolvent @ b + d)[0, 0])
    a, b, c = np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(c)
    return 2.2e-16 * 10 * (len(t) + 1) * (x * (a * y + b) + c * y + abs(d[0, 0])) / value


def system(form, parts, rate_hz):
    dt = 1 / rate_hz if rate_hz else 0
    return {"tf": control.tf, "zpk": control.zpk, "ss": control.ss}[form](*parts, dt)


def report(folder, index, form, parts, rate_hz, omegas):
    with open(f"{folder}/{index}.toml", "w", encoding="utf-8") as file:
        file.write(toml(form, parts, rate_hz))
    stable = are_stable(form, parts, rate_hz)
    theirs = system(form, parts, rate_hz)
    for omega in omegas:
        v = np.exp(1j * omega / rate_hz) if rate_hz else 1j * omega
        truth = complex(exact(form, parts, mpmath.mpc(v.real, v.imag)))
        other = complex(theirs(v))
        print(index, rate_hz, omega, truth.real, truth.imag, other.real, other.imag, rounding(form, parts, v), stable)


def some_roots(draw, count, left):
    """Real roots and pairs between 30 and 3000 rad/s."""
    roots = []
    while len(roots) < count:
        omega, zeta = np.exp(draw.uniform(np.log(30), np.log(3000))), np.exp(draw.uniform(np.log(0.01), 0))
        side = -1 if left or draw.random() < 0.7 else 1
        if count - len(roots) >= 2 and draw.random() < 0.6:
            root = omega * (side * zeta + 1j * np.sqrt(1 - zeta**2))
            roots += [root, root.conjugate()]
        else:
            roots.append(side * omega)
    return np.array(roots, complex)


def random_systems():
    draw = np.random.default_rng(20061009)
    for order in range(1, 13):
        for rate_hz in (0, RATE_HZ):
            for form in ("tf", "zpk", "ss", "random ss"):
                for _ in range(2):
                    yield order, rate_hz, form, draw


def random(folder):
    for index, (order, rate_hz, form, draw) in enumerate(random_systems()):
        poles = some_roots(draw, order, True)
        real = np.flatnonzero(poles.imag == 0)
        if len(real) and draw.random() < 0.5:
            poles[real[0]] = 0
        zeros = some_roots(draw, int(draw.integers(0, order + 1)), False)
        gain = float(np.exp(draw.uniform(-10, 10)))
        omegas = [0.03, *np.exp(draw.uniform(np.log(10), np.log(5000), FREQUENCIES - 1))]
        if rate_hz:
            zeros, poles = np.exp(zeros / rate_hz), np.exp(poles / rate_hz)
        if form == "random ss":
            # python-control's own random matrices; the continuous ones in units of 1 ms.
            plant = control.drss(order) if rate_hz else control.rss(order)
            time = 1 if rate_hz else 1000
            parts = (plant.A * time, plant.B * time, plant.C, plant.D)
            report(folder, index, "ss", parts, rate_hz, omegas)
            continue
        parts = {
            "tf": lambda: (np.real(gain * np.poly(zeros)), np.real(np.poly(poles))),
            "zpk": lambda: (zeros, poles, gain),
            "ss": lambda: scipy.signal.zpk2ss(zeros, poles, gain),
        }[form]()
        report(folder, index, form, [np.asarray(part) for part in parts], rate_hz, omegas)


def fast(folder):
    s = control.tf("s")
    # Eq. (6-7) as it is printed, factor by factor.
    factors = [
        51110 / s,
        (s + 88.7) / (s + 625),
        1 / (s + 893),
        (s**2 + 2 * 0.4 * 175 * s + 175**2) / (s**2 + 2 * 0.7 * 700 * s + 700**2),
        (s**2 + 2 * 0.01 * 520 * s + 520**2) / (s**2 + 2 * 0.1 * 555 * s + 555**2),
    ]
    product = np.prod(factors)
    tf = (product.num[0][0], product.den[0][0])
    zpk = scipy.signal.tf2zpk(*tf)
    exact_zpk = ([z for f in factors for z in f.zeros()], [p for f in factors for p in f.poles()], zpk[2])
    discrete = scipy.signal.bilinear_zpk(*exact_zpk, RATE_HZ)
    cases = [
        ("tf", tf, 0),
        ("zpk", exact_zpk, 0),
        ("ss", scipy.signal.tf2ss(*tf), 0),
        ("zpk", discrete, RATE_HZ),
    ]
    for index, (form, parts, rate_hz) in enumerate(cases):
        parts = [np.asarray(part) for part in parts]
        report(folder, index, form, parts, rate_hz, [0.1, 10.0, 88.7, 284.3, 519.0, 555.0, 5000.0])


def files(folder):
    given = json.load(sys.stdin)
    roots = lambda name: np.array([complex(re, im) for re, im in given[name]])
    forms = {
        "tf": {"num": np.array(given["num"]), "den": np.array(given["den"])},
        "zpk": {"z": roots("z"), "p": roots("p"), "k": given["k"]},
        "ss": {name: np.array(given[name]) for name in "ABCD"},
    }
    for form, parts in forms.items():
        parts = {**parts, "Ts": given["Ts"]}
        for compressed in (False, True):
            scipy.io.savemat(f"{folder}/{form}-{int(compressed)}.mat", parts, do_compression=compressed)
        scipy.io.savemat(f"{folder}/{form}-struct.mat", {"other": 3.0, "C": parts})
        columns = {"z": parts["z"][:, None]} if form == "zpk" else {}
        scipy.io.savemat(f"{folder}/{form}-columns.mat", {**parts, **columns}, oned_as="column")
        np.savez(f"{folder}/{form}.npz", **parts)
        np.savez_compressed(f"{folder}/{form}-compressed.npz", **parts)
    # python-control keeps lists of arrays, which savemat writes as cells.
    system = control.tf(given["num"], given["den"], given["Ts"])
    scipy.io.savemat(f"{folder}/tf-cells.mat", {"num": system.num, "den": system.den, "Ts": system.dt})
    system = control.ss(*(given[name] for name in "ABCD"), given["Ts"])
    scipy.io.savemat(f"{folder}/ss-control.mat", {"A": system.A, "B": system.B, "C": system.C, "D": system.D, "dt": system.dt})


def arrays(fields):
    """A JSON object as arrays; texts and flags remain."""
    keep = (bool, str)
    return {name: value if isinstance(value, keep) else np.array(value) for name, value in fields.items()}


def fields(folder):
    for index, given in enumerate(json.load(sys.stdin)):
        parts = arrays(given)
        scipy.io.savemat(f"{folder}/{index}-struct.mat", {"S": parts})
        scipy.io.savemat(f"{folder}/{index}-top.mat", parts, do_compression=True)
        np.savez(f"{folder}/{index}.npz", **parts)


def gain(folder):
    parts = {"A": np.zeros((0, 0)), "B": np.zeros((0, 1)), "C": np.zeros((1, 0)), "D": [[2e4]], "Ts": 0.0}
    scipy.io.savemat(f"{folder}/gain.mat", parts)
    np.savez(f"{folder}/gain.npz", **parts)


def saved(folder, index, form, parts, rate_hz, slowest):
    """Writes a discrete controller, and prints its response from a tenth of its slowest mode to half the rate."""
    names = {"tf": ("num", "den"), "zpk": ("z", "p", "k"), "ss": ("A", "B", "C", "D")}[form]
    parts = [np.asarray(part) for part in parts]
    np.savez(f"{folder}/{index}.npz", **dict(zip(names, parts)), Ts=1 / rate_hz)
    omegas = np.geomspace(0.1 * slowest, np.pi * rate_hz, 25)
    points = [np.exp(1j * omega / rate_hz) for omega in omegas]
    truth = [complex(exact(form, parts, mpmath.mpc(v.real, v.imag))) for v in points]
    largest = max(abs(value) for value in truth)
    stable = are_stable(form, parts, rate_hz)
    for omega, value in zip(omegas, truth):
        print(index, omega, value.real, value.imag, largest, stable, ("tf", "zpk", "ss").index(form))


def butterworth(folder):
    index = 0
    for order in range(1, 7):
        for cutoff_hz in (20, 40, 70, 100, 200, 300, 500, 1000, 1500, 2000):
            tf = scipy.signal.butter(order, cutoff_hz, fs=RATE_HZ)
            for form, parts in (("tf", tf), ("ss", scipy.signal.tf2ss(*tf))):
                saved(folder, index, form, parts, RATE_HZ, 2 * np.pi * cutoff_hz)
                index += 1


def random_factors(draw):
    """Numerators and denominators of PI, lead, low-pass, one or two notches; s in rad/s."""
    crossover = np.exp(draw.uniform(np.log(60), np.log(1500)))
    gain, low_pass = np.exp(draw.uniform(-5, 10)), crossover * draw.uniform(8, 15)
    factors = [
        ([gain, gain * crossover / draw.uniform(5, 20)], [1, 0]),
        ([3, crossover], [1, 3 * crossover]),
        ([low_pass], [1, low_pass]),
    ]
    for _ in range(int(draw.integers(1, 3))):
        omega = crossover * draw.uniform(1.5, 5)
        zetas = draw.uniform(0.005, 0.05), draw.uniform(0.1, 0.7)
        factors.append(tuple([1, 2 * zeta * omega, omega**2] for zeta in zetas))
    return factors


def matrices(system):
    return system.A, system.B, system.C, system.D


def integrators(folder):
    draw = np.random.default_rng(20261126)
    index = 0
    for _ in range(40):
        factors = random_factors(draw)
        zeros, poles = (np.concatenate([np.roots(factor[part]) for factor in factors]) for part in (0, 1))
        gain = np.prod([factor[0][0] / factor[1][0] for factor in factors])
        fastest, slowest = max(abs(poles)), min(abs(pole) for pole in poles if pole != 0)
        rate_hz = float(next(rate for rate in (1000, 2000, 5000, 10000, 20000) if rate > 0.5 * fastest))
        series = control.ss([], [], [], [[1.0]])
        for factor in factors:
            series = control.ss(control.tf(*factor)) * series
        tustin = scipy.signal.bilinear_zpk(zeros, poles, gain, rate_hz)
        held = matrices(control.sample_system(series, 1 / rate_hz, "zoh"))
        held_tf = scipy.signal.ss2tf(*held)
        held_zeros = np.roots(np.trim_zeros(np.where(np.arange(len(held_tf[0][0])) < 1, 0, held_tf[0][0]), "f"))
        forms = [
            ("tf", [np.real(part) for part in scipy.signal.zpk2tf(*tustin)]),
            ("zpk", tustin),
            ("ss", matrices(control.sample_system(series, 1 / rate_hz, "tustin"))),
            ("tf", [np.ravel(part) for part in held_tf]),
            ("zpk", (closed(held_zeros), np.exp(poles / rate_hz), held_tf[0][0][1])),
            ("ss", held),
        ]
        for form, parts in forms:
            saved(folder, index, form, parts, rate_hz, slowest)
            index += 1


def closed(roots):
    """The roots with exact conjugates."""
    upper = [root for root in roots if root.imag > 0]
    return np.array([complex(root.real) for root in roots if root.imag == 0] + upper + [root.conjugate() for root in upper])


def runs():
    for case in json.load(sys.stdin):
        signal = np.array(case["input"])
        if "num" in case:
            output = scipy.signal.lfilter(case["num"], case["den"], signal)
        else:
            matrices = [np.atleast_2d(np.array(case[name])) for name in "ABCD"]
            _, output, _ = scipy.signal.dlsim((*matrices, 1.0), signal)
        print(*np.ravel(output))


def main():
    mode, *rest = sys.argv[1:]
    modes = (random, fast, files, fields, gain, butterworth, integrators, runs)
    {function.__name__: function for function in modes}[mode](*rest)


main()
