// Amplitude spectral density of the error: Hann window, mean of half-overlapping segments [Welch 1967].

import { axes, begin, colour, line, quantity } from "/page/drawing.js";
import { FrequencyAxis } from "/page/frequency_axis.js";

const SEGMENT = 4096;
const SEGMENTS = 7;
const ERROR = 2;

/** Discrete Fourier transform of real and imaginary parts, in place; the length is a power of two [Cooley and Tukey 1965]. */
export function fft(real, imaginary) {
  const count = real.length;
  for (let index = 1, reversed = 0; index < count; index++) {
    let bit = count >> 1;
    for (; reversed & bit; bit >>= 1) reversed ^= bit;
    reversed ^= bit;
    if (index < reversed) {
      [real[index], real[reversed]] = [real[reversed], real[index]];
      [imaginary[index], imaginary[reversed]] = [imaginary[reversed], imaginary[index]];
    }
  }
  for (let length = 2; length <= count; length <<= 1) {
    const half = length >> 1, angle = -2 * Math.PI / length;
    for (let k = 0; k < half; k++) {
      const cos = Math.cos(angle * k), sin = Math.sin(angle * k);
      for (let start = k; start < count; start += length) {
        const other = start + half;
        const re = real[other] * cos - imaginary[other] * sin, im = real[other] * sin + imaginary[other] * cos;
        real[other] = real[start] - re; imaginary[other] = imaginary[start] - im;
        real[start] += re; imaginary[start] += im;
      }
    }
  }
}

/** One-sided density in unit/sqrt(Hz) at k rate / SEGMENT, of the values without their mean. */
export function density(values, rateHz, segment = SEGMENT) {
  const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
  const window = Float64Array.from({ length: segment }, (_, n) => 0.5 - 0.5 * Math.cos(2 * Math.PI * n / segment));
  const power = window.reduce((sum, value) => sum + value * value, 0);
  const total = new Float64Array(segment / 2);
  let segments = 0;
  for (let start = 0; start + segment <= values.length; start += segment / 2, segments++) {
    const real = Float64Array.from(window, (weight, n) => weight * (values[start + n] - mean)), imaginary = new Float64Array(segment);
    fft(real, imaginary);
    for (let k = 0; k < segment / 2; k++) total[k] += real[k] ** 2 + imaginary[k] ** 2;
  }
  return total.map((sum) => Math.sqrt(2 * sum / (segments * rateHz * power)));
}

export class Spectrum {
  constructor(canvas, readout, hint, samples) {
    Object.assign(this, { canvas, readout, hint, samples });
    this.axis = new FrequencyAxis(canvas, () => this.paint());
  }

  /** Computes the density anew and draws it. */
  draw() {
    const values = this.samples.last(ERROR, SEGMENT / 2 * (SEGMENTS + 1));
    this.hint.classList.toggle("is-empty", values !== null);
    this.canvas.classList.toggle("is-empty", values === null);
    this.density = null;
    this.readout.textContent = "";
    if (!values) return;
    const rateHz = 1 / this.samples.periodS;
    this.density = density(values, rateHz);
    this.stepHz = rateHz / SEGMENT;
    this.axis.setLimits(2 * this.stepHz, rateHz / 2);
    this.paint();
  }

  paint() {
    if (!this.density) return;
    const { context, width, height, em } = begin(this.canvas);
    const shown = [...this.density].slice(2).map((value) => Math.log10(Math.max(value, 1e-15) * 1e9));
    const y = { from: Math.floor(Math.min(...shown)), to: Math.ceil(Math.max(...shown)), text: (value) => Number.isInteger(value) ? `1e${value}` : "" };
    const box = { left: 3.3 * em, top: 1.4 * em, width: width - 5.1 * em, height: height - 3.1 * em };
    this.axis.box = box;
    const { toX, toY } = axes(context, box, this.axis.describe(true), y);
    context.fillStyle = colour("text");
    context.textAlign = "left";
    context.textBaseline = "top";
    context.fillText("nm/sqrt(Hz)", box.left, 2);
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.width, box.height);
    context.clip();
    context.strokeStyle = colour("error");
    context.lineWidth = 1.5;
    context.beginPath();
    shown.forEach((value, index) => context.lineTo(toX(Math.log10((index + 2) * this.stepHz)), toY(value)));
    context.stroke();
    context.restore();
    if (this.axis.cursor !== null) {
      context.strokeStyle = colour("soft");
      line(context, toX(this.axis.cursor), box.top, toX(this.axis.cursor), box.top + box.height);
    }
    this.showReadout();
  }

  showReadout() {
    const hz = this.axis.cursorHz;
    if (hz === null) {
      const rms = Math.sqrt(this.density.reduce((sum, value) => sum + value * value, 0) * this.stepHz);
      this.readout.textContent = `rms ${quantity(rms, "m")} from ${this.stepHz.toFixed(2)} Hz to half the sampling rate`;
      return;
    }
    const value = this.density[Math.min(this.density.length - 1, Math.max(0, Math.round(hz / this.stepHz)))];
    this.readout.textContent = `${hz.toPrecision(4)} Hz: ${quantity(value, "m")}/sqrt(Hz)`;
  }
}
