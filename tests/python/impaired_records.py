#!/usr/bin/env python3
"""Records with the difficulties of real laboratories, of random stages with known modes and zeros, without any line of bench.

    impaired_records.py SEED COUNT FOLDER BENCH [KIND ...]   COUNT records of each kind (default: all), identified by `BENCH identify`;
                                                             prints a line for each record and a table of the kinds, with processor times
    impaired_records.py SEED COUNT FOLDER numbers BENCH [KIND ...]
                                                             prints for each record: 1 if the verdict is right, 0 if there is none, -1 if it is
                                                             wrong; 1 if the stated cause is true or none is needed, 0 other, -1 wrong; wrong signs
    impaired_records.py list                                 prints the kinds

Each kind is one function below: it returns the columns of a file, the options that its user would give, and the causes that an undecided
verdict or a refusal may state. The stages are those of random_stages.py. The command is held over a period (`--hold zoh`); its response is
exact. A verdict is right if the stage has a CNMP pair in the analysed band, or has none, as stated; a zero within 5 % of the ends of the
band counts as either. Of an undecided verdict or a refusal the stated cause is true, other (none of CAUSES), or WRONG.
"""

import json
import pathlib
import re
import resource
import subprocess
import sys

import numpy as np
import scipy.linalg as la
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter

from random_stages import FAMILIES, stage, state, sweep, zeros

# A message and the cause that it states. A message of none of them states no cause.
CAUSES = {
    "spike": r"spike",
    "jump": r"jumps by",
    "stuck": r"have the same value",
    "slow probe": r"changes only",
    "clipped": r"clipped",
    "coarse": r"the output has steps",
    "start": r"moves at the first sample|begin the record before",
    "end": r"still moves at the last|continue the record after",
    "unrelated": r"not input and output of one system",
    "swapped": r"swapped|exchange --input",
    "kind": r"--output-kind",
    "early": r"precedes the input",
    "clocks": r"clocks that differ",
    "mains": r"mains",
    "misfit": r"not the fitted sum of modes|no sum of modes",
    "complex": r"complex residues",
    "nonlinear": r"nonlinear|friction or play",
    "lag": r"a first-order lag of",
    "uncertain": r"is uncertain|may lie on either side|lies on the imaginary axis|not significant|response is noise|increase the amplitude",
    "few modes": r"fewer than two modes",
    "gap": r"fill the gap",
    "unit": r"--time-unit",
    "jitter": r"times scatter",
    "times": r"only the times are inaccurate|not rising|earlier than",
    "opposite": r"no two neighbouring modes",
    "reference": r"--reference",
    "beyond": r"extend --band",
    "changes": r"changes during the record",
}
KINDS = {}


class Record:
    """Columns of a file with the truth about them."""

    def __init__(self, modes, rate, columns, options=("--hold", "zoh"), causes=(), scale=1.0, model_holds=True, zeros_at=None):
        self.modes, self.rate, self.columns, self.options = modes, rate, columns, list(options)
        # Where the model holds, the noise may prevent a verdict as well.
        self.causes = {"uncertain", "few modes", *causes} if model_holds or not causes else set(causes)
        # Residues are those of the stage times this number, and intervals hold the truth, unless the model does not.
        self.scale, self.model_holds = scale, model_holds
        self.zeros = zeros(modes) if zeros_at is None else zeros_at


def kind(name):
    def register(make):
        KINDS[name] = make
        return make

    return register


class Bench:
    """A random stage, its command, and the exact response at the ticks."""

    def __init__(self, rng, seconds=None, top_ratio=3.0, rates=(500, 1000, 2000, 4000)):
        self.rng = rng
        self.modes, (self.low, self.high) = stage(rng, FAMILIES[int(rng.integers(len(FAMILIES)))])
        self.rate = float(rng.choice([r for r in rates[:-1] if r > top_ratio * self.high] or rates[-1:]))
        self.seconds = seconds or float(rng.choice([20, 30]))
        self.amplitude = float(rng.uniform(0.02, 0.1))
        self.u = sweep(self.rate, self.seconds, self.low, self.high, self.amplitude)
        slowest = np.min(self.modes[:, 0] * self.modes[:, 1])
        self.rest = np.zeros(int(9 / slowest * self.rate))
        self.u = np.concatenate([self.u, self.rest])
        self.noise = float(np.exp(rng.uniform(np.log(3e-4), np.log(3e-3))))

    def excite(self, force):
        """Replaces the sweep, with rest before and after."""
        self.u = np.concatenate([np.zeros(int(self.rate)), force, np.zeros(int(4 * self.rate)), self.rest])

    @property
    def t(self):
        return np.arange(len(self.u)) / self.rate

    def motion(self, u=None, derivatives=0, modes=None):
        """y^(k) of a held force, at each tick before its step."""
        u = self.u if u is None else u
        total = np.zeros(len(u))
        for w, zeta, r in self.modes if modes is None else modes:
            damped = w * np.sqrt(1 - zeta * zeta)
            pole = complex(-zeta * w, damped)
            total += 2 * np.real(r / (2j * damped) * pole**derivatives * state(pole, u, 1 / self.rate))
        return total

    def at_motor(self, derivatives=0):
        return self.motion(derivatives=derivatives, modes=self.modes * [1, 1, 0] + [0, 0, 1])

    def noisy(self, y):
        return y + self.noise * np.std(y) * self.rng.standard_normal(len(y))

    def columns(self, y, u=None, t=None):
        return {"time_s": self.t if t is None else t, "force_n": self.u if u is None else u, "position_m": y}

    def record(self, y, **about):
        columns = self.columns(y, about.pop("u", None), about.pop("t", None))
        return Record(self.modes, self.rate, columns, **about)

    def at(self, y, times):
        """A smooth signal between its ticks: band-limited up to 16 times the rate, then cubic."""
        n = len(y)
        spectrum = np.fft.rfft(y)
        fine = np.fft.irfft(np.concatenate([spectrum, np.zeros(16 * n // 2 + 1 - len(spectrum))]), 16 * n) * 16
        return CubicSpline(np.arange(16 * n) / (16 * self.rate), fine)(times)


# Plain records, and what a model holds for.


@kind("plain")
def plain(rng):
    b = Bench(rng)
    return b.record(b.noisy(b.motion()))


@kind("inverted sensor")
def inverted(rng):
    b = Bench(rng)
    return b.record(b.noisy(-b.motion()), scale=-1.0)


@kind("delay")
def delay(rng):
    b = Bench(rng)
    ticks = int(rng.integers(1, 6))
    return b.record(b.noisy(np.concatenate([np.zeros(ticks), b.motion()[:-ticks]])))


@kind("known lag")
def known_lag(rng):
    b = Bench(rng)
    tau = float(rng.uniform(0.2, 2.0)) / b.rate
    return b.record(b.noisy(through_lag(b, tau)), options=["--hold", "zoh", "--input-lag", f"{tau:.9g}s"])


def through_lag(b, tau):
    """The response of the stage to a held command behind a lag."""
    y, at_pole = np.zeros(len(b.u)), 0.0
    for w, zeta, r in b.modes:
        damped = w * np.sqrt(1 - zeta * zeta)
        pole = complex(-zeta * w, damped)
        y += 2 * np.real(r / (2j * damped) / (1 + tau * pole) * state(pole, b.u, 1 / b.rate))
        at_pole += r / (1 / tau**2 - 2 * zeta * w / tau + w * w) / tau
    return y + at_pole * np.real(state(-1 / tau, b.u, 1 / b.rate))


@kind("slow noise of the floor")
def pink(rng):
    b = Bench(rng)
    y = b.motion()
    spectrum = np.fft.rfft(rng.standard_normal(len(y))) / np.sqrt(np.maximum(np.arange(len(y) // 2 + 1), 1))
    noise = np.fft.irfft(spectrum, len(y))
    return b.record(b.noisy(y + 3 * b.noise * np.std(y) * noise / np.std(noise)))


@kind("drift")
def drift(rng):
    b = Bench(rng)
    y = b.motion()
    walk = np.cumsum(rng.standard_normal(len(y)))
    return b.record(b.noisy(y + 0.1 * np.std(y) * walk / np.std(walk)))


@kind("hum within the band")
def hum(rng):
    b = Bench(rng)
    y = b.motion()
    hz = 50.0 if b.high > 60 else rng.uniform(b.low, b.high)
    return b.record(b.noisy(y + rng.uniform(0.02, 0.3) * np.std(y) * np.sin(2 * np.pi * hz * b.t + 1)), causes=["mains"])


@kind("stated velocity")
def velocity(rng):
    b = Bench(rng)
    return b.record(b.noisy(b.motion(derivatives=1)), options=["--hold", "zoh", "--output-kind", "velocity"])


@kind("stated acceleration")
def acceleration(rng):
    b = Bench(rng)
    y = b.motion(derivatives=2)
    force = b.u if rng.random() < 0.5 else np.concatenate([[0.0], b.u[:-1]])
    y = y + np.sum(b.modes[:, 2]) * force
    return b.record(b.noisy(y), options=["--hold", "zoh", "--output-kind", "acceleration"])


# Sensors.


@kind("coarse resolution")
def quantised(rng):
    b = Bench(rng)
    y = b.motion()
    step = rng.uniform(0.002, 0.02) * np.max(abs(y))
    return b.record(step * np.round(b.noisy(y) / step), causes=["coarse"])


@kind("clipped output")
def clipped(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    limit = rng.uniform(0.4, 0.8) * np.max(abs(y))
    return b.record(np.clip(y, -limit, limit), causes=["clipped"])


@kind("spike")
def spike(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    y[int(rng.uniform(0.2, 0.7) * len(y))] += rng.uniform(2, 10) * np.max(abs(y))
    return b.record(y, causes=["spike"])


@kind("jump")
def jump(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    y[int(rng.uniform(0.2, 0.6) * len(y)) :] += rng.uniform(0.5, 2) * np.max(abs(y))
    return b.record(y, causes=["jump"])


@kind("stuck samples")
def stuck(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    at, count = int(rng.uniform(0.2, 0.5) * len(y)), int(rng.uniform(0.05, 0.3) * b.rate)
    y[at : at + count] = y[at]
    return b.record(y, causes=["stuck", "jump", "spike"])


@kind("slow probe")
def slow_probe(rng):
    b = Bench(rng)
    every = int(rng.integers(2, 6))
    y = b.noisy(b.motion())
    return b.record(y[np.arange(len(y)) // every * every], causes=["slow probe"])


@kind("velocity, not stated")
def velocity_unstated(rng):
    b = Bench(rng)
    return b.record(b.noisy(b.motion(derivatives=1)), causes=["kind"], model_holds=False)


@kind("acceleration, not stated")
def acceleration_unstated(rng):
    b = Bench(rng)
    y = b.motion(derivatives=2) + np.sum(b.modes[:, 2]) * np.concatenate([[0.0], b.u[:-1]])
    return b.record(b.noisy(y), causes=["kind"], model_holds=False)


# Times.


@kind("clocks that differ")
def clocks(rng):
    b = Bench(rng)
    ppm = rng.choice([-1, 1]) * np.exp(rng.uniform(np.log(20), np.log(1000)))
    y = b.motion()
    times = np.minimum(b.t * (1 + 1e-6 * ppm), b.t[-1])
    return b.record(b.noisy(b.at(y, times)), causes=["clocks"])


@kind("jitter, true times")
def jitter(rng):
    b = Bench(rng, top_ratio=5.0)
    times = b.t + rng.uniform(0.02, 0.1) / b.rate * rng.standard_normal(len(b.u)).clip(-3, 3)
    times[0] = 0.0
    y = b.at(b.motion(), np.clip(times, 0, b.t[-1]))
    smooth = b.at(b.u, np.clip(times, 0, b.t[-1]))
    return b.record(b.noisy(y), u=smooth, t=times, options=[], model_holds=False)


@kind("rate that drifts, true times")
def rate_drift(rng):
    b = Bench(rng, top_ratio=5.0)
    part = rng.uniform(0.001, 0.01)
    times = b.t * (1 - 0.5 * part * b.t / b.t[-1])
    return b.record(b.noisy(b.at(b.motion(), times)), u=b.at(b.u, times), t=times, options=[], model_holds=False)


@kind("missing rows, with times")
def missing_rows(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    keep = rng.random(len(y)) > 0.002
    keep[:2] = True
    return Record(b.modes, b.rate, {name: c[keep] for name, c in b.columns(y).items()}, causes=["gap"])


@kind("milliseconds without a unit")
def milliseconds(rng):
    b = Bench(rng)
    columns = b.columns(b.noisy(b.motion()))
    columns = {"time": columns["time_s"] * 1e3, "force_n": columns["force_n"], "position_m": columns["position_m"]}
    return Record(b.modes, b.rate, columns, causes=["unit"])


# How the record was made.


@kind("no rest at the beginning")
def no_start(rng):
    b = Bench(rng)
    y, cut = b.noisy(b.motion()), int(rng.uniform(1.5, 5) * b.rate)
    return Record(b.modes, b.rate, {name: c[cut:] for name, c in b.columns(y).items()}, causes=["start"], model_holds=False)


@kind("no rest at the end")
def no_end(rng):
    b = Bench(rng)
    y, cut = b.noisy(b.motion()), int((1 + b.seconds * rng.uniform(0.5, 0.9)) * b.rate)
    return Record(b.modes, b.rate, {name: c[:cut] for name, c in b.columns(y).items()}, causes=["end"], model_holds=False)


@kind("swapped columns")
def swapped(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    return Record(b.modes, b.rate, b.columns(b.u, u=y), causes=["swapped", "unrelated"], options=[], model_holds=False)


@kind("unrelated columns")
def unrelated(rng):
    b = Bench(rng)
    y = lfilter(*butter(2, 0.2), rng.standard_normal(len(b.u))) * 1e-6
    return b.record(y, causes=["unrelated", "start", "end"], model_holds=False)


@kind("output before the input")
def early(rng):
    b = Bench(rng)
    ticks = int(rng.integers(2, 8))
    return b.record(b.noisy(np.concatenate([b.motion()[ticks:], np.zeros(ticks)])), causes=["early"], model_holds=False)


@kind("hammer")
def hammer(rng):
    b = Bench(rng, top_ratio=4.0)
    width = 1 / (2.5 * b.high)
    t = b.t - 1.0
    b.u = np.where((t > 0) & (t < width), np.sin(np.pi * t / width) ** 2, 0.0)
    b.noise *= 0.1
    return b.record(b.noisy(b.motion()))


@kind("bursts of noise")
def burst(rng):
    b = Bench(rng)
    force = lfilter(*butter(3, min(0.9, 2.2 * b.high / b.rate)), rng.standard_normal(len(b.u)))
    b.u = 0.05 * force * (abs(b.u) > 0)
    return b.record(b.noisy(b.motion()))


@kind("PRBS, periods")
def prbs(rng):
    b = Bench(rng)
    order, hold = int(rng.integers(10, 13)), int(rng.choice([1, 2]))
    taps = {10: (10, 7), 11: (11, 9), 12: (12, 11, 10, 4)}[order]
    bits, register = [], [1] * order
    for _ in range(2**order - 1):
        bits.append(register[-1])
        register = [sum(register[k - 1] for k in taps) % 2, *register[:-1]]
    period = np.repeat(0.05 * (2.0 * np.array(bits) - 1), hold)
    count = int(np.clip(60 * b.rate / len(period), 8, 40))
    b.u = np.tile(period, count)
    y = b.noisy(b.motion())
    skip = count // 3
    options = ["--hold", "zoh", "--period", str(len(period)), "--skip-periods", str(skip)]
    return Record(b.modes, b.rate, b.columns(y), options=options)


@kind("multisine, six periods")
def multisine(rng):
    b = Bench(rng)
    length = int(rng.choice([4, 8]) * b.rate)
    lines = np.arange(max(1, int(b.low * length / b.rate)), int(b.high * length / b.rate))
    phase = -np.pi * np.arange(len(lines)) ** 2 / len(lines)
    spectrum = np.zeros(length // 2 + 1, complex)
    spectrum[lines] = np.exp(1j * phase)
    period = np.fft.irfft(spectrum, length)
    settle = int(np.ceil(8 / np.min(b.modes[:, 0] * b.modes[:, 1]) * b.rate / length))
    b.u = 0.05 * np.tile(period / np.max(abs(period)), 6 + settle)
    options = ["--hold", "zoh", "--period", str(length), "--skip-periods", str(settle)]
    return Record(b.modes, b.rate, b.columns(b.noisy(b.motion())), options=options)


@kind("closed loop")
def closed_loop(rng):
    """Integral feedback with a bandwidth below the first mode; the sweep is added to the force. Noise of the probe runs through the loop."""
    b = Bench(rng)
    static = np.sum(b.modes[:, 2] / b.modes[:, 0] ** 2)
    # The crossover is below the half-width of each mode, so that the loop is stable.
    parts = np.sum(abs(b.modes[:, 2]) / b.modes[:, 0] ** 2)
    gain = np.sign(static) * 0.3 * np.min(b.modes[:, 0] * b.modes[:, 1]) / parts / b.rate
    poles = [complex(-z * w, w * np.sqrt(1 - z * z)) for w, z, _ in b.modes]
    factor = np.exp(np.array(poles) / b.rate)
    drive = np.expm1(np.array(poles) / b.rate) / np.array(poles)
    weight = b.modes[:, 2] / (1j * np.imag(poles))
    noise = b.noise * np.std(b.motion()) * rng.standard_normal(len(b.u))
    x, integral, u, y = np.zeros(len(poles), complex), 0.0, np.zeros(len(b.u)), np.zeros(len(b.u))
    for k in range(len(b.u)):
        y[k] = np.real(weight @ x) + noise[k]
        integral -= gain * y[k]
        u[k] = b.u[k] + integral
        x = factor * x + drive * u[k]
    columns = {"time_s": b.t, "force_n": u, "position_m": y, "reference": b.u}
    return Record(b.modes, b.rate, columns, causes=["reference"], model_holds=False)


@kind("operating noise")
def operating(rng):
    b = Bench(rng)
    b.u = 0.03 * lfilter(*butter(2, min(0.9, 2 * b.high / b.rate)), rng.standard_normal(int(30 * b.rate)))
    return b.record(b.noisy(b.motion()), causes=["start", "end"])


@kind("too short for its modes")
def short(rng):
    b = Bench(rng, seconds=4.0)
    return b.record(b.noisy(b.motion()))


# Channels and stages that are no sum of modes with real residues.


@kind("filter in the channel")
def filtered(rng):
    b = Bench(rng)
    corner = rng.uniform(1.0, 2.5) * b.high / (b.rate / 2)
    y = lfilter(*butter(2, min(0.95, corner)), b.motion())
    return b.record(b.noisy(y), causes=["misfit", "complex"], model_holds=False)


@kind("mean of eight samples")
def averaged(rng):
    b = Bench(rng)
    return b.record(b.noisy(lfilter(np.ones(8) / 8, 1, b.motion())), causes=["misfit", "complex"], model_holds=False)


@kind("digital filter of first order that is not given")
def digital_filter(rng):
    b = Bench(rng)
    pole = np.exp(-2 * np.pi * rng.uniform(0.5, 3) * b.high / b.rate)
    y = lfilter([1 - pole], [1, -pole], b.motion())
    return b.record(b.noisy(y), causes=["misfit", "complex", "lag"], model_holds=False)


@kind("one damper")
def damper(rng, accelerometer=False):
    """A chain of masses with one damper: the damping is not proportional, the residues are complex."""
    b = Bench(rng)
    n = int(rng.integers(2, 4))
    mass, spring = rng.uniform(0.3, 2.0, n), rng.uniform(1e4, 1e5, n)
    stiff = np.zeros((n, n))
    for k in range(n):
        stiff[k, k] += spring[k]
        if k:
            stiff[k - 1, k - 1] += spring[k]
            stiff[k - 1, k] -= spring[k]
            stiff[k, k - 1] -= spring[k]
    at = int(rng.integers(n))
    damp = 1e-4 * stiff + np.diag(np.eye(n)[at]) * rng.uniform(2, 20)
    return of_matrices(b, mass, stiff, damp, accelerometer)


def of_matrices(b, mass, stiff, damp, accelerometer=False):
    """The record of masses with stiffness and damping matrices, with force and probe at random masses: of a held force and the position,
    or of a force and an acceleration that are both measured."""
    rng, n = b.rng, len(mass)
    inverse = np.diag(1 / mass)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiff, -inverse @ damp]])
    force, probe = np.zeros(2 * n), np.zeros(2 * n)
    force[n + int(rng.integers(n))] = 1.0
    force[n:] /= mass
    probe[int(rng.integers(n))] = 1.0
    poles, vectors = np.linalg.eig(a)
    drive, seen = np.linalg.solve(vectors, force.astype(complex)), probe @ vectors
    high = 1.4 * np.max(abs(poles)) / (2 * np.pi)
    b.rate = float(np.ceil(4 * high / 100) * 100)
    b.u = sweep(b.rate, 20, 1.0, high, 0.1)
    b.u = np.concatenate([b.u, np.zeros(int(9 / np.min(-poles.real) * b.rate))])
    options = ["--hold", "zoh"]
    if accelerometer:
        options = ["--output-kind", "acceleration"]
        s = 2j * np.pi * np.fft.rfftfreq(len(b.u), 1 / b.rate)
        y = np.fft.irfft(s**2 * sum(seen[k] * drive[k] / (s - poles[k]) for k in range(2 * n)) * np.fft.rfft(b.u), len(b.u))
    else:
        y = sum(np.real(seen[k] * drive[k] * state(poles[k], b.u, 1 / b.rate)) for k in range(2 * n))
    left = np.block([[a, force[:, None]], [probe[None, :], np.zeros((1, 1))]])
    at = la.eigvals(left, np.diag([1.0] * (2 * n) + [0.0]))
    at = at[np.isfinite(at) & (abs(at) < 1e4)]
    modes = [[abs(p), -p.real / abs(p), np.nan] for p in poles if p.imag > 0]
    about = {"options": options, "causes": ["misfit", "complex"], "model_holds": False, "zeros_at": at}
    return Record(np.array(modes), b.rate, b.columns(b.noisy(y)), **about)


def integrated(b, force, substeps=8):
    """The position of the modes with a force at the motor, as `force(u, y, v)` of its position and velocity: a leapfrog of small steps.

    Shapes are 1 at the motor and r at the probe."""
    w, zeta, r = b.modes.T
    step = 1 / (b.rate * substeps)
    q, v, y = np.zeros(len(w)), np.zeros(len(w)), np.zeros(len(b.u))
    shape = r
    decay = np.exp(-2 * zeta * w * step)
    for k, u in enumerate(b.u):
        y[k] = q @ shape
        for _ in range(substeps):
            v = decay * v + step * (force(u, np.sum(q), np.sum(v)) - w * w * q)
            q = q + step * v
    return y


@kind("friction")
def friction(rng):
    b = Bench(rng, seconds=10.0)
    size = rng.uniform(0.02, 0.3) * b.amplitude
    # Not so steep that a step of the integration reverses the velocity.
    steepest = size * len(b.modes) * 2 / (8 * b.rate)
    scale = max(np.std(b.at_motor(derivatives=1)) * 0.05, steepest)
    y = integrated(b, lambda u, y, v: u - size * np.tanh(v / scale))
    return b.record(b.noisy(y), causes=["misfit", "nonlinear", "complex"], model_holds=False)


@kind("stiffness that depends on amplitude")
def duffing(rng):
    b = Bench(rng, seconds=10.0)
    stiff = rng.uniform(0.05, 0.5) * b.amplitude / np.max(abs(b.at_motor())) ** 3
    return b.record(b.noisy(integrated(b, lambda u, y, v: u - stiff * y**3)), causes=["misfit", "nonlinear", "complex"], model_holds=False)


@kind("mode that moves during the record")
def moving(rng):
    b = Bench(rng)
    change = rng.choice([-1, 1]) * rng.uniform(0.002, 0.02)
    changed = b.modes.copy()
    changed[:, 0] *= 1 + change
    part = np.arange(len(b.u)) / len(b.u)
    y = (1 - part) * b.motion() + part * b.motion(modes=changed)
    return b.record(b.noisy(y), causes=["misfit", "complex", "nonlinear", "changes"], model_holds=False)


@kind("lag of the drive that is not given")
def lag_of_drive(rng):
    b = Bench(rng)
    tau = 1 / (2 * np.pi * rng.uniform(0.3, 4) * b.high)
    return b.record(b.noisy(through_lag(b, tau)), causes=["misfit", "complex", "lag"])


# Stages that are hard to decide.


@kind("pair of modes a few bins apart")
def pair(rng):
    """One mode of a stage is replaced by two, 1 to 6 bins of the record apart, with any signs."""
    b = Bench(rng, seconds=float(rng.uniform(10, 60)))
    k = int(rng.integers(len(b.modes)))
    w, zeta, r = b.modes[k]
    half = np.pi * rng.uniform(1, 6) * b.rate / len(b.u)
    shares = rng.uniform(0.2, 1.0, 2) * rng.choice([-1, 1], 2)
    twins = [[w - half, zeta, r * shares[0]], [w + half, zeta * rng.uniform(1, 1.5), r * shares[1]]]
    b.modes = np.vstack([b.modes[:k], twins, b.modes[k + 1 :]])
    return b.record(b.noisy(b.motion()))


@kind("zero near the axis")
def near_the_axis(rng):
    """A stage of which one residue is changed until a complex zero in the band has a real part of at most 0.5 % of its magnitude."""
    while True:
        b = Bench(rng)
        k, sign = int(rng.integers(len(b.modes))), rng.choice([-1, 1])
        found = []
        for factor in np.exp(np.linspace(np.log(0.02), np.log(50), 400)):
            modes = b.modes.copy()
            modes[k, 2] *= sign * factor
            at = zeros(modes)
            hz = abs(at) / (2 * np.pi)
            at = at[(at.imag > 1e-3 * abs(at)) & (hz > 1.2 * b.low) & (hz < 0.9 * b.high)]
            if len(at) and np.min(abs(at.real) / abs(at)) < 5e-3:
                found.append(modes)
        if found:
            b.modes = found[int(rng.integers(len(found)))]
            return b.record(b.noisy(b.motion()))


# What is rounded as well.
ROUNDED_AS_WELL = (
    "slow noise of the floor",
    "drift",
    "hum within the band",
    "delay",
    "known lag",
    "hammer",
    "bursts of noise",
    "filter in the channel",
    "mean of eight samples",
    "one damper",
    "friction",
    "stiffness that depends on amplitude",
    "mode that moves during the record",
    "lag of the drive that is not given",
    "zero near the axis",
    "pair of modes a few bins apart",
)


@kind("coarse resolution beside another difficulty")
def coarse_as_well(rng):
    record = KINDS[ROUNDED_AS_WELL[int(rng.integers(len(ROUNDED_AS_WELL)))]](rng)
    name = list(record.columns)[2]
    y = record.columns[name]
    step = rng.uniform(0.002, 0.02) * np.max(abs(y))
    # Of one in three the ends of the cells are off by some per cent of a step.
    levels = np.arange(np.floor(np.min(y) / step) - 1, np.max(y) / step + 2)
    uneven = rng.uniform(0.0, 0.1) * (rng.random() < 1 / 3)
    ends = levels + (0.5 if rng.random() < 0.5 else 1.0) + uneven * rng.standard_normal(len(levels))
    record.columns[name] = step * (levels[0] + np.searchsorted(np.sort(ends), y / step))
    record.causes |= {"coarse"}
    record.model_holds &= uneven < 0.01
    return record


@kind("clipped input")
def clipped_input(rng):
    b = Bench(rng)
    y = b.noisy(b.motion())
    limit = rng.uniform(0.3, 0.9) * np.max(abs(b.u))
    return b.record(y, u=np.clip(b.u, -limit, limit), causes=["clipped"], model_holds=False)


# Other excitations.


@kind("sweep of rising speed")
def logarithmic(rng):
    b = Bench(rng)
    t = np.arange(int(b.seconds * b.rate)) / b.rate
    growth = np.log(b.high / b.low) / b.seconds
    window = np.sin(0.5 * np.pi * np.clip(np.minimum(t, b.seconds - t) / 0.5, 0, 1)) ** 2
    b.excite(b.amplitude * window * np.sin(2 * np.pi * b.low / growth * np.expm1(growth * t)))
    return b.record(b.noisy(b.motion()))


@kind("sine in steps of frequency")
def stepped_sine(rng):
    b = Bench(rng)
    frequencies = np.linspace(b.low, b.high, int(rng.integers(40, 120)))
    each = np.maximum(np.round(rng.uniform(4, 10) * b.rate / frequencies), 0.3 * b.rate).astype(int)
    angle = np.cumsum(np.repeat(2 * np.pi * frequencies / b.rate, each))
    b.excite(b.amplitude * np.sin(angle))
    return b.record(b.noisy(b.motion()))


@kind("steps of the input")
def steps(rng):
    b = Bench(rng)
    each = rng.uniform(0.2, 2.0, 200) / b.low
    each = each[np.cumsum(each) < b.seconds]
    b.excite(np.repeat(b.amplitude * rng.uniform(-1, 1, len(each)), (each * b.rate).astype(int)))
    b.noise *= 0.1
    # The power of steps falls with the square of frequency: modes lie above the band.
    return b.record(b.noisy(b.motion()), causes=["beyond"])


@kind("multisine whose period is not stated")
def multisine_unstated(rng):
    record = multisine(rng)
    record.options = ["--hold", "zoh"]
    record.causes |= {"start", "end"}
    return record


@kind("measured current of a drive")
def measured_current(rng):
    b = Bench(rng, top_ratio=6.0)
    tau = rng.uniform(1.0, 4.0) / b.rate
    current = np.real(state(-1 / tau, b.u, 1 / b.rate)) / tau
    current += rng.uniform(1e-4, 3e-3) * np.std(current) * rng.standard_normal(len(current))
    return b.record(b.noisy(through_lag(b, tau)), u=current, options=[], causes=["uncertain", "few modes", "misfit"], model_holds=False)


@kind("voltage of a coil")
def voltage(rng):
    b = Bench(rng)
    tau = float(rng.uniform(0.3e-3, 3e-3))
    options = ["--hold", "zoh", "--input-kind", "voltage"]
    return b.record(b.noisy(through_lag(b, tau)), options=options, causes=["uncertain", "few modes", "misfit", "complex", "lag"], model_holds=False)


@kind("blow soon after the first sample")
def blow(rng):
    """As of an analyser with a pre-trigger of some samples."""
    record = hammer(rng)
    cut = int(record.rate) - int(rng.uniform(20, 200))
    record.columns = {name: column[cut:] for name, column in record.columns.items()}
    return record


# Other times.


@kind("jitter, regular times")
def hidden_jitter(rng):
    b = Bench(rng)
    times = b.t + rng.uniform(0.005, 0.05) / b.rate * rng.standard_normal(len(b.u)).clip(-3, 3)
    return b.record(b.noisy(b.at(b.motion(), np.clip(times, 0, b.t[-1]))), causes=["jitter"])


@kind("times rounded by their format")
def rounded_times(rng):
    b = Bench(rng, rates=(600, 1300, 2300, 4700))
    decimals = int(np.ceil(-np.log10(1 / b.rate))) + int(rng.integers(0, 2))
    return b.record(b.noisy(b.motion()), t=np.round(b.t, decimals))


# Other stages.


@kind("free body")
def free_body(rng):
    """A mass without a spring beside the modes. The command leaves it at rest, where it began."""
    b = Bench(rng)
    residue = rng.uniform(0.1, 2.0) * np.max(abs(b.modes[:, 2]))
    active = np.flatnonzero(b.u)
    span = np.linspace(-1, 1, active[-1] - active[0] + 1)
    moments = np.stack([(1 - span**2) ** 2, span * (1 - span**2) ** 2])
    part = b.u[active[0] : active[-1] + 1]
    powers = np.stack([np.ones_like(span), span])
    part -= np.linalg.solve(powers @ moments.T, powers @ part) @ moments
    speed = np.concatenate([[0.0], np.cumsum(b.u)[:-1]]) / b.rate
    place = np.concatenate([[0.0], np.cumsum(speed + 0.5 * b.u / b.rate)[:-1]]) / b.rate
    y = b.motion() + residue * place
    b.modes = np.vstack([[0.01, 0.0, residue], b.modes])
    return b.record(b.noisy(y))


@kind("mode above the band")
def above(rng):
    b = Bench(rng, top_ratio=5.0)
    mode = [2 * np.pi * b.high * rng.uniform(1.2, 2.4), rng.uniform(0.003, 0.02), rng.choice([-1, 1]) * np.max(abs(b.modes[:, 2]))]
    b.modes = np.vstack([b.modes, mode])
    return b.record(b.noisy(b.motion()))


@kind("all-pass in the channel")
def all_pass(rng):
    b = Bench(rng)
    corner = np.pi * min(0.9, rng.uniform(0.5, 3) * b.high / (b.rate / 2))
    if rng.random() < 0.5:
        pole = (1 - np.tan(corner / 2)) / (1 + np.tan(corner / 2))
        below = [1.0, -pole]
    else:
        radius = rng.uniform(0.6, 0.9)
        below = [1.0, -2 * radius * np.cos(corner), radius**2]
    y = lfilter(below[::-1], below, b.motion())
    return b.record(b.noisy(y), causes=["misfit", "complex", "lag"], model_holds=False)


@kind("gyroscopic")
def gyroscopic(rng):
    """Two masses of a rotor: the coupling of their velocities is antisymmetric, the residues are complex."""
    b = Bench(rng)
    mass = rng.uniform(0.3, 2.0, 2)
    stiff = np.diag(rng.uniform(1e4, 1e5, 2))
    stiff[0, 1] = stiff[1, 0] = -rng.uniform(0.0, 0.3) * np.min(np.diag(stiff))
    gyro = rng.uniform(2.0, 60.0) * np.array([[0.0, 1.0], [-1.0, 0.0]])
    return of_matrices(b, mass, stiff, 1e-4 * stiff + gyro)


@kind("hysteresis of the guide")
def dahl(rng):
    """The friction of P. Dahl (1968): dF/dx = (F_c/x_c) (1 - F/F_c sgn v)."""
    b = Bench(rng, seconds=10.0)
    size, reach = rng.uniform(0.02, 0.3) * b.amplitude, rng.uniform(0.05, 0.5) * np.std(b.at_motor())
    step, held = 1 / (8 * b.rate), [0.0]

    def force(u, y, v):
        rate = v / reach
        # Exact for a constant velocity.
        held[0] = np.sign(v) + (held[0] - np.sign(v)) * np.exp(-abs(rate) * step)
        return u - size * held[0]

    return b.record(b.noisy(integrated(b, force)), causes=["misfit", "nonlinear", "complex"], model_holds=False)


@kind("play of the probe")
def play(rng):
    b = Bench(rng)
    y = b.motion()
    half, seen = rng.uniform(0.001, 0.02) * np.max(abs(y)), np.zeros(len(y))
    for k in range(1, len(y)):
        seen[k] = min(max(seen[k - 1], y[k] - half), y[k] + half)
    return b.record(b.noisy(seen), causes=["misfit", "nonlinear", "complex"], model_holds=False)


@kind("one damper, measured force and acceleration")
def damper_by_accelerometer(rng):
    return damper(rng, accelerometer=True)


# What is done with a record.


def identify(bench, path, record, folder):
    names = list(record.columns)
    command = [bench, "identify", path, "--time", names[0], "--input", names[1], "--output", names[2]]
    begin = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    out = subprocess.run([*command, *record.options, "--json", "--out", folder], capture_output=True, text=True, timeout=600)
    return out, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin


def cnmp(record, band_hz, widened):
    low, high = band_hz[0] / widened, band_hz[1] * widened
    upper = record.zeros[record.zeros.imag > 0]
    return any(z.real > 0 and low <= abs(z) / (2 * np.pi) <= high for z in upper)


def cause(record, text):
    stated = {name for name, pattern in CAUSES.items() if re.search(pattern, text)}
    if stated & record.causes:
        return "true"
    return "WRONG cause" if stated else "other"


def judged(record, answer):
    if answer["cnmp"] == "undecided":
        return "undecided"
    is_there = answer["cnmp"] == "detected"
    return "right" if cnmp(record, answer["band_hz"], 1.05 if is_there else 0.95) == is_there else "WRONG"


def intervals(record, answer):
    """Whether the 95 % intervals of frequency, damping and residue hold the truth, and the number of wrong signs that are shown as certain."""
    rows, wrong = [], 0
    low, high = answer["band_hz"]
    # A mode outside the band represents all that lies beyond it.
    inside = [mode for mode in answer["modes"] if low <= mode["frequency_hz"] <= high]
    for w, zeta, r in record.modes:
        hz = w / (2 * np.pi)
        near = min(inside, key=lambda m: abs(m["frequency_hz"] / hz - 1), default=None)
        if near is None or abs(near["frequency_hz"] / hz - 1) > 0.02 or np.isnan(r):
            continue
        truth = {"frequency_hz": hz, "damping_ratio": zeta, "residue": r * record.scale}
        rows.append([abs(near[name] - value) <= 1.96 * near[name + "_sigma"] for name, value in truth.items()])
        is_certain = near["sign"] != "c" and near["sign_error_probability"] < 0.025
        # A mode in place of a pair that no record separates has the sign of the sum.
        nearest = min(record.modes[:, 0], key=lambda other: abs(near["frequency_hz"] / other * (2 * np.pi) - 1))
        wrong += bool(nearest == w and is_certain and near["residue"] * truth["residue"] < 0)
    return rows, wrong


class Totals:
    def __init__(self):
        self.verdicts, self.causes, self.rows, self.wrong_signs, self.seconds = {}, {}, [], 0, []

    def add(self, counts, name):
        counts[name] = counts.get(name, 0) + 1

    def add_all(self, other):
        for own, counts in ((self.verdicts, other.verdicts), (self.causes, other.causes)):
            for name, number in counts.items():
                own[name] = own.get(name, 0) + number
        self.rows += other.rows
        self.wrong_signs += other.wrong_signs
        self.seconds += other.seconds

    def line(self, name):
        verdicts = " ".join(f"{v} {n}" for v, n in sorted(self.verdicts.items()))
        causes = " ".join(f"{c} {n}" for c, n in sorted(self.causes.items()))
        inside = " ".join(f"{100 * part:.0f}" for part in np.mean(self.rows, axis=0)) if self.rows else "-"
        return f"{name:38}| {verdicts:32}| {causes:26}| {inside:10} of {len(self.rows):3}| signs wrong {self.wrong_signs}| {np.median(self.seconds):.2f} s, at most {np.max(self.seconds):.1f} s"


def main():
    if sys.argv[1:] == ["list"]:
        return print("\n".join(KINDS))
    seed, count, folder = int(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3])
    numbers = sys.argv[4] == "numbers"
    bench, *selected = sys.argv[5:] if numbers else sys.argv[4:]
    folder.mkdir(parents=True, exist_ok=True)
    table, all_kinds = [], Totals()
    for index, name in enumerate(KINDS):
        if selected and name not in selected:
            continue
        totals = Totals()
        for k in range(count):
            record = KINDS[name](np.random.default_rng([seed, index, k]))
            path = str(folder / f"{name.replace(' ', '-').replace(',', '')}-{k}.csv")
            np.savetxt(path, np.column_stack(list(record.columns.values())), delimiter=",", header=",".join(record.columns), comments="", fmt="%.9g")
            out, seconds = identify(bench, path, record, str(folder / "results"))
            totals.seconds.append(seconds)
            wrong = 0
            if out.returncode:
                verdict, text = "refused", out.stderr.strip()
            else:
                answer = json.loads(out.stdout)
                verdict, text = judged(record, answer), answer["why"]
                rows, wrong = intervals(record, answer)
                totals.rows += rows if record.model_holds else []
                totals.wrong_signs += wrong
            totals.add(totals.verdicts, verdict)
            stated = cause(record, text) if verdict in ("undecided", "refused") else ""
            if stated:
                totals.add(totals.causes, stated)
            if numbers:
                codes = {"right": 1, "WRONG": -1, "": 1, "true": 1, "WRONG cause": -1}
                print(codes.get(verdict, 0), codes.get(stated, 0), wrong, flush=True)
            else:
                print(f"{name} {k}: {verdict} {stated} {seconds:.2f} s: {text[:230]}", flush=True)
        table.append(totals.line(name))
        all_kinds.add_all(totals)
    if not numbers:
        print("\n".join([*table, all_kinds.line("all kinds")]))


if __name__ == "__main__":
    main()
