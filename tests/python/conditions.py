"""Chapter 4's conditions from another hand, with numpy, scipy and mpmath: questions in as JSON, answers out.

    stations    at each of `values` of the setting `vary`: residues aR, au, av, whether they alternate, whether Eq. (4-1) and
                the plant have complex zeros; modes u and v are those of `pair` (from 0, slowest first)
    placements  at each of `values` the number of CNMP pairs for a force on each node and a probe on each

How it differs from bench on purpose: all that is not u or v comes from a linear solve, G - Gu - Gv at j sqrt(wu wv), not
from a sum of modes; complex zeros of Eq. (4-1) from the roots of N(x), Eq. (4-3), with 40 digits, not from b-hat or a pencil.
"""

import json
import sys
from copy import deepcopy

import mpmath
import numpy as np
import scipy.linalg as la

import plants
import truth

mpmath.mp.dps = 40


def at(config, vary, value):
    config = deepcopy(config)
    *path, last = vary.split(".")
    place = config
    for key in path:
        place = place[key]
    place[last] = value
    return config["plant"]


def matrices(p):
    if p["model"] == "sr4dof":
        M, K, *rest = truth.matrices(p)
        a = 0.6 * p["operating_point_m"] / p["beam_length_m"]
        return M, K, np.array([1, a, -2 * a, 0]), np.array([1.0, 0, 0, 0])
    M, K, _, force, sensor = plants.matrices(p)
    return M, K, force, sensor


def station(p, pair):
    M, K, q, c = matrices(p)
    squares, V = la.eigh(K, M)
    u, v = pair
    (xu, xv), (au, av) = squares[[u, v]], [(V[:, i] @ q) * (V[:, i] @ c) for i in (u, v)]
    middle = np.sqrt(xu * xv)
    whole = c @ la.solve(K - middle * M, q)
    rest = -middle * (whole - au / (xu - middle) - av / (xv - middle))
    r, au, av, xu, xv = map(mpmath.mpf, (rest, au, av, xu, xv))
    b2, b1, b0 = r + au + av, (xu + xv) * r + au * xv + av * xu, r * xu * xv
    roots = mpmath.polyroots([b2, b1, b0], maxsteps=200, extraprec=200)
    zeros = plants.undamped_zeros(M, K, q, c)
    return {
        "residues": [float(x) for x in (r, au, av)],
        "alternate": bool(r * au < 0 and au * av < 0),
        "equation": any(abs(mpmath.im(x)) > 1e-12 * abs(x) for x in roots),
        "plant": plants.cnmp_pairs(zeros) > 0,
    }


def stations(q):
    return [station(at(q["config"], q["vary"], value), q["pair"]) for value in q["values"]]


def placements(q):
    counts = []
    for value in q["values"]:
        M, K, *_ = matrices(at(q["config"], q["vary"], value))
        one = np.eye(len(M))
        counts.append([[plants.cnmp_pairs(plants.undamped_zeros(M, K, i, j)) for j in one] for i in one])
    return counts


ANSWERS = {f.__name__: f for f in (stations, placements)}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
