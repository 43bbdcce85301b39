// The response of the stage during a chirp, as it grows: magnitude, phase, coherence.

import { axes, begin, colour, line } from "/page/drawing.js";
import { FrequencyAxis } from "/page/frequency_axis.js";

const STRIPS = [
  { title: "magnitude (um/A)", share: 0.45, colour: "position" },
  { title: "phase (deg)", share: 0.33, colour: "position" },
  { title: "coherence", share: 0.22, colour: "current" },
];

export class Response {
  constructor(canvas, readout) {
    Object.assign(this, { canvas, readout });
    this.response = null;
    this.axis = new FrequencyAxis(canvas, () => this.draw());
  }

  /** Takes a response of the daemon. */
  show(response) {
    this.response = response;
    const hz = response.frequency_hz;
    if (hz.length) this.axis.setLimits(hz[0] / 1.1, hz.at(-1) * 1.1);
    this.draw();
  }

  draw() {
    if (!this.response || this.canvas.clientWidth === 0) return;
    const { context, width, height, em } = begin(this.canvas);
    const { frequency_hz: hz, magnitude_m_per_a: magnitude, phase_deg: phase, coherence } = this.response;
    const values = [magnitude.map((value) => Math.log10(Math.max(value * 1e6, 1e-9))), phase, coherence];
    const ranges = [range(values[0]), { from: -180, to: 180 }, { from: 0, to: 1.02 }];
    ranges[0].text = (value) => Number.isInteger(value) ? `1e${value}` : "";
    const left = 4 * em, bottom = 1.7 * em, titles = 1.3 * em;
    let top = 0;
    STRIPS.forEach((strip, index) => {
      const room = (height - bottom) * strip.share;
      const box = { left, top: top + titles, width: width - left - 1.8 * em, height: room - titles - 4 };
      this.axis.box = box;
      context.fillStyle = colour("text");
      context.textAlign = "left";
      context.textBaseline = "bottom";
      context.fillText(strip.title, box.left, box.top - 2);
      const { toX, toY } = axes(context, box, this.axis.describe(index === STRIPS.length - 1), ranges[index]);
      const isWrapping = index === 1;
      drawCurve(context, box, hz.map((value) => toX(Math.log10(value))), values[index], toY, strip.colour, isWrapping);
      if (this.axis.cursor !== null) {
        context.strokeStyle = colour("soft");
        line(context, toX(this.axis.cursor), box.top, toX(this.axis.cursor), box.top + box.height);
      }
      top += room;
    });
    this.showReadout();
  }

  showReadout() {
    const { frequency_hz: hz, magnitude_m_per_a: magnitude, phase_deg: phase, coherence } = this.response;
    const at = this.axis.cursorHz;
    if (at === null || hz.length === 0) {
      this.readout.textContent = hz.length ? `${hz.length} bands from ${hz[0].toPrecision(3)} to ${hz.at(-1).toPrecision(4)} Hz` : "waiting for the first segment";
      return;
    }
    const distance = (index) => Math.abs(Math.log(hz[index] / at));
    const nearest = hz.reduce((best, _, index) => distance(index) < distance(best) ? index : best, 0);
    const known = coherence[nearest] === null ? "coherence not known yet" : `coherence ${coherence[nearest].toFixed(4)}`;
    this.readout.textContent = `${hz[nearest].toPrecision(4)} Hz: ${(magnitude[nearest] * 1e6).toPrecision(4)} um/A, ${phase[nearest].toFixed(1)} deg, ${known}`;
  }
}

/** Whole decades around values. */
function range(values) {
  const from = Math.floor(Math.min(...values, 0)), to = Math.ceil(Math.max(...values, from + 1));
  return { from, to };
}

/** A curve; a value that is null, and a step of more than half a turn, interrupt it. */
function drawCurve(context, box, xs, values, toY, name, isWrapping) {
  context.save();
  context.beginPath();
  context.rect(box.left, box.top, box.width, box.height);
  context.clip();
  context.strokeStyle = colour(name);
  context.fillStyle = colour(name);
  context.lineWidth = 1.5;
  context.beginPath();
  let last = null;
  values.forEach((value, index) => {
    const isJump = last === null || (isWrapping && Math.abs(value - last) > 180);
    if (value !== null && isJump) context.moveTo(xs[index], toY(value));
    if (value !== null && !isJump) context.lineTo(xs[index], toY(value));
    last = value;
  });
  context.stroke();
  values.forEach((value, index) => { if (value !== null) context.fillRect(xs[index] - 1, toY(value) - 1, 2, 2); });
  context.restore();
  context.lineWidth = 1;
}
