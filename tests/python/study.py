#!/usr/bin/env python3
"""What is true of a study of the XY stage over its secondary masses, without any line of bench.

Reads a JSON array of questions on standard input, prints a JSON array of answers. Questions have `what` and `config`, the
object that `bench config show --json` prints.

    digits   of the table of draws in the file `csv`: CNMP pairs of all draws in double precision, in one batch; and with 60
             digits those of the `hardest` draws and of as many chosen at random (`seed`)
    shares   shares of the variance of "has CNMP pairs" that each of `groups` of places explains, settings alone and all
             their couples included, with the deviations uniform within +-`limit`: by pick and freeze over `draws` pairs of
             draws (Sobol 1993), and the standard deviation of each

How it differs from bench on purpose: the stage has the 26 coordinates and 16 constraints of plants.py. A draw is the harder,
the less it takes to make two of its zeros u = s^2 one, as they are on every border between counts (`ease`). With 60 digits the numerator
is the determinant of the pencil by Faddeev and LeVerrier, and Sturm's theorem counts its real roots: no root is computed.
"""

import csv
import json
import sys

import mpmath as mp
import numpy as np
import scipy.linalg as la

from plants import DEGREES, NAMES, X, Y, parallelograms, xy

PLACES = NAMES[5:]
COMPLEX = 1e-7

# All draws at once, in double precision -------------------------------------------------------------------------------


class Batch:
    """N_q^T (K + u M) N_c, with M = M_0 + sum of deviation times M_place."""

    def __init__(self, plant):
        flat = {place: 0.0 for place in PLACES}
        matrices = lambda deviations: xy({**plant, "secondary_mass_deviation": {**flat, **deviations}})
        M, K, geometric, q, c, _ = matrices({})
        K = K + geometric if plant["geometric_stiffness"] else K
        left, right = la.null_space(q[None, :]).T, la.null_space(c[None, :])
        solve = lambda matrix: -np.linalg.solve(left @ K @ right, left @ matrix @ right)
        self.nominal = solve(M)
        self.places = np.array([solve(matrices({place: 1.0})[0] - M) for place in PLACES])

    def matrices(self, deviations):
        """One matrix a draw, with the eigenvalues -1/u."""
        return self.nominal + np.tensordot(deviations, self.places, 1)

    def pairs(self, deviations):
        mu = np.linalg.eigvals(self.matrices(deviations))
        return (np.abs(mu.imag) > COMPLEX * np.abs(mu)).sum(axis=1) // 2


def ease(matrices):
    """Of each matrix, the least of distance times sine over all pairs of eigenvalues: about how far, beside their size, the
    matrix is from one in which the two are one. The sine is that between left and right eigenvector."""
    mu, right = np.linalg.eig(matrices)
    sine = 1 / (np.linalg.norm(np.linalg.inv(right), axis=2) * np.linalg.norm(right, axis=1))
    size = 0.5 * (np.abs(mu[:, :, None]) + np.abs(mu[:, None, :]))
    distance = np.abs(mu[:, :, None] - mu[:, None, :]) / size * np.minimum(sine[:, :, None], sine[:, None, :])
    distance[:, np.arange(mu.shape[1]), np.arange(mu.shape[1])] = np.inf
    return distance.min(axis=(1, 2))


# Some draws with 60 digits --------------------------------------------------------------------------------------------


def degrees_of_freedom(plant):
    """26 x 10: all coordinates by the degrees of freedom; and the gradients of the bending of the parallelograms."""
    c, y0 = mp.mpf("0.6") / mp.mpf(plant["beam_length_m"]), mp.mpf(plant["operating_point_m"])
    static = [mp.mpf(0)] * 26
    for name in ("ms", "sT", "sB", "YT", "YB"):
        static[Y[name]] = y0
    for name in ("sL", "sR", "gT", "gB"):
        static[Y[name]] = y0 / 2
    constraints, bent = mp.zeros(16, 26), mp.zeros(16, 26)
    for row, (P, S, along, side) in enumerate(parallelograms(plant["layout"])):
        across = Y if along is X else X
        bend = static[across[S]] - (static[across[P]] if P else 0)
        for stage, sign in ((S, 1), (P, -1)) if P else ((S, 1),):
            bent[row, across[stage]] += sign
            constraints[row, along[stage]] += sign
            constraints[row, across[stage]] += 2 * c * side * bend * sign
    others = [i for i in range(26) if i not in DEGREES]
    columns = lambda indices: mp.matrix([[constraints[r, i] for i in indices] for r in range(16)])
    solved = columns(others) ** -1 * -columns(DEGREES)
    N = mp.zeros(26, 10)
    for k, i in enumerate(DEGREES):
        N[i, k] = 1
    for r, i in enumerate(others):
        for k in range(10):
            N[i, k] = solved[r, k]
    return N, bent * N


def complement(v):
    """n x (n - 1) with v^T (.) = 0: each column joins the largest element to another."""
    n = len(v)
    pivot = max(range(n), key=lambda i: abs(v[i]))
    basis = mp.zeros(n, n - 1)
    for column, i in enumerate(i for i in range(n) if i != pivot):
        basis[i, column], basis[pivot, column] = 1, -v[i] / v[pivot]
    return basis


class Exact:
    """The same pencil with 60 digits. Without geometric stiffness."""

    def __init__(self, plant):
        assert not plant["geometric_stiffness"]
        self.plant = plant
        self.N, bent = degrees_of_freedom(plant)
        # Only the ratio of masses to k and the place of u on the real axis depend on k: it is taken as 1.
        row = lambda i: [self.N[i, k] for k in range(10)]
        self.left, self.right = complement(row(X["XL"])).T, complement(row(X["ms"]))
        self.inverse = (self.left * (bent.T * bent) * self.right) ** -1

    def pairs(self, deviations):
        p = self.plant
        mass = {"ms": mp.mpf(p["motion_stage_mass_kg"])} | dict.fromkeys(NAMES[1:5], mp.mpf(p["intermediate_stage_mass_kg"]))
        for place, deviation in zip(PLACES, deviations):
            mass[place] = mp.mpf(p["secondary_stage_mass_kg"]) * (1 + mp.mpf(float(deviation)))
        weighted = self.N.copy()
        for name in NAMES:
            for i in (X[name], Y[name]):
                for k in range(10):
                    weighted[i, k] *= mass[name]
        B = self.left * (self.N.T * weighted) * self.right
        polynomial = characteristic(self.inverse * B)
        return (degree(polynomial) - real_roots(polynomial)) // 2


def characteristic(A):
    """Coefficients of det(mu - A), highest first, by Faddeev and LeVerrier."""
    n = A.rows
    coefficients, power = [mp.mpf(1)], mp.zeros(n, n)
    for k in range(1, n + 1):
        power = A * power + coefficients[-1] * mp.eye(n)
        product = A * power
        coefficients.append(-sum(product[i, i] for i in range(n)) / k)
    # Roots mu = 0, of u at infinity, come out as last coefficients that are rounding.
    size = abs(coefficients[1] / n)
    while abs(coefficients[-1]) < mp.mpf(10) ** -40 * size ** (len(coefficients) - 1):
        coefficients.pop()
    scale = size
    return [coefficient / scale**k for k, coefficient in enumerate(coefficients)]


def degree(polynomial):
    return len(polynomial) - 1


def real_roots(polynomial):
    """How many there are, all simple, by the signs of Sturm's chain at both ends of the real axis."""
    n = degree(polynomial)
    chain = [polynomial, [c * (n - k) for k, c in enumerate(polynomial[:-1])]]
    while len(chain[-1]) > 1:
        rest = list(chain[-2])
        while len(rest) >= len(chain[-1]):
            factor = rest[0] / chain[-1][0]
            for k, c in enumerate(chain[-1]):
                rest[k] -= factor * c
            rest.pop(0)
        largest = max(abs(c) for c in rest)
        assert largest > mp.mpf(10) ** -45 * max(abs(c) for c in chain[-2]), "two zeros are one to 45 digits"
        chain.append([-c / largest for c in rest])
    high = [mp.sign(p[0]) for p in chain]
    low = [mp.sign(p[0]) * (-1) ** degree(p) for p in chain]
    changes = lambda signs: sum(a != b for a, b in zip(signs, signs[1:]))
    return changes(low) - changes(high)


def digits(q):
    mp.mp.dps = 60
    plant = q["config"]["plant"]
    with open(q["csv"]) as file:
        rows = list(csv.DictReader(file))
    deviations = np.array([[float(row[f"plant.secondary_mass_deviation.{place}"]) for place in PLACES] for row in rows])
    theirs = np.array([int(row["cnmp_pairs"]) for row in rows])
    batch, exact = Batch(plant), Exact(plant)
    near, ours = [], []
    for part in np.array_split(deviations, max(1, len(rows) // 5000)):
        near.append(ease(batch.matrices(part)))
        ours.append(batch.pairs(part))
    near, ours = np.concatenate(near), np.concatenate(ours)
    hardest = np.argsort(near)[: q["hardest"]]
    others = np.random.default_rng(q["seed"]).choice(len(rows), q["hardest"], replace=False)
    chosen = list(dict.fromkeys([*hardest, *others]))
    with_60 = [exact.pairs(deviations[k]) for k in chosen]
    return {
        "draws": len(rows),
        "differ_in_double": [int(k) for k in np.flatnonzero(ours != theirs)],
        "checked": len(chosen),
        "differ_with_60_digits": [int(k) for k, pairs in zip(chosen, with_60) if pairs != theirs[k]],
        "ease_of_the_hardest": [float(near[k]) for k in hardest],
        "with_pairs": int(sum(pairs > 0 for pairs in with_60)),
    }


# Shares of the variance -----------------------------------------------------------------------------------------------


def shares(q):
    batch, random, n = Batch(q["config"]["plant"]), np.random.default_rng(q["seed"]), q["draws"]
    drawn = lambda: random.uniform(-q["limit"], q["limit"], (n, len(PLACES)))
    first = drawn()
    has = lambda deviations: (batch.pairs(deviations) > 0).astype(float)
    y, found = has(first), []
    for group in q["groups"]:
        again = drawn()
        kept = [PLACES.index(place) for place in group]
        again[:, kept] = first[:, kept]
        z = has(again)
        p = (y.mean() + z.mean()) / 2
        product = (y - p) * (z - p) / (p * (1 - p))
        found.append({"share": product.mean(), "sigma": product.std() / np.sqrt(n)})
    return {"shares": found, "probability": y.mean()}


ANSWERS = {f.__name__: f for f in (digits, shares)}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
