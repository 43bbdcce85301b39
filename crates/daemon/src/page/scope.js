// The scope: three strips over one time axis.

import { axes, begin, colour, line, quantity } from "/page/drawing.js";
import { SIGNALS } from "/page/samples.js";

const STRIPS = [
  { title: "reference and position (um)", signals: [0, 1], factor: 1e6, share: 0.45 },
  { title: "error (um)", signals: [2], factor: 1e6, share: 0.3 },
  { title: "current (A)", signals: [3], factor: 1, share: 0.25 },
];
/** Up to 0.1 m, labels have at most a sign and five digits: a range is at least a 500th of its values, see valueRange. */
const WIDEST_LABEL = "-0.0000";
const UNITS = ["m", "m", "m", "A"];
/** Share of the span after a trigger. */
const AFTER_TRIGGER = 0.8;

export class Scope {
  constructor(canvas, readout, samples) {
    Object.assign(this, { canvas, readout, samples });
    this.spanS = 5;
    this.endS = null; // null: follows the newest sample
    this.cursors = null;
    this.events = [];
    this.pointerS = null;
    this.listen();
  }

  get isPaused() { return this.endS !== null; }

  pause(isPaused) {
    this.endS = isPaused ? this.samples.endS : null;
    this.onpause?.();
  }

  /** Shows the time around an event and pauses. */
  trigger(timeS) { this.triggerS = timeS; }

  zoom(factor) {
    const middleS = this.isPaused ? this.endS - this.spanS / 2 : null;
    this.spanS = Math.min(600, Math.max(0.005, this.spanS * factor));
    if (middleS !== null) this.endS = Math.min(this.samples.endS, middleS + this.spanS / 2);
    this.onzoom?.();
  }

  scroll(share) {
    const endS = (this.endS ?? this.samples.endS) + share * this.spanS;
    this.endS = Math.min(this.samples.endS, Math.max(endS, this.samples.endS - 600));
    this.onpause?.();
  }

  toggleCursors() {
    const [fromS, toS] = this.range();
    this.cursors = this.cursors ? null : [fromS + 0.4 * (toS - fromS), fromS + 0.6 * (toS - fromS)];
    return this.cursors !== null;
  }

  range() {
    const endS = this.endS ?? this.samples.endS;
    return [endS - this.spanS, endS];
  }

  listen() {
    const timeAt = (event) => {
      const [fromS, toS] = this.range();
      const box = this.box ?? { left: 0, width: this.canvas.clientWidth };
      return fromS + (event.offsetX - box.left) / box.width * (toS - fromS);
    };
    this.canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.25 : 0.8); }, { passive: false });
    this.canvas.addEventListener("pointerdown", (event) => {
      const timeS = timeAt(event);
      const near = this.cursors?.findIndex((cursorS) => Math.abs(cursorS - timeS) < this.spanS * 0.02) ?? -1;
      this.drag = { x: event.offsetX, endS: this.endS ?? this.samples.endS, cursor: near };
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      this.pointerS = timeAt(event);
      if (!this.drag) return;
      if (this.drag.cursor >= 0) { this.cursors[this.drag.cursor] = this.pointerS; return; }
      if (Math.abs(event.offsetX - this.drag.x) < 4) return;
      const movedS = (this.drag.x - event.offsetX) / (this.box?.width ?? 1) * this.spanS;
      this.endS = Math.min(this.samples.endS, this.drag.endS + movedS);
      this.onpause?.();
    });
    this.canvas.addEventListener("pointerup", () => { this.drag = null; });
    this.canvas.addEventListener("pointerleave", () => { this.pointerS = null; });
    this.canvas.addEventListener("dblclick", () => this.pause(false));
    this.canvas.addEventListener("keydown", (event) => {
      const actions = { ArrowLeft: () => this.scroll(-0.1), ArrowRight: () => this.scroll(0.1), "+": () => this.zoom(0.8), "-": () => this.zoom(1.25), 0: () => this.pause(false) };
      const action = actions[event.key];
      if (action) { event.preventDefault(); action(); }
    });
  }

  /** Pauses when the span after the trigger is complete. */
  checkTrigger() {
    if (this.triggerS === undefined || this.samples.endS < this.triggerS + AFTER_TRIGGER * this.spanS) return;
    this.endS = this.triggerS + AFTER_TRIGGER * this.spanS;
    this.triggerS = undefined;
    this.onpause?.();
  }

  draw() {
    this.checkTrigger();
    const { context, width, height, em } = begin(this.canvas);
    const [fromS, toS] = this.range();
    const left = context.measureText(WIDEST_LABEL).width + 8, bottom = 1.7 * em, titles = 1.3 * em;
    let top = 0;
    for (const [index, strip] of STRIPS.entries()) {
      const room = (height - bottom) * strip.share;
      const box = { left, top: top + titles, width: width - left - 1.8 * em, height: room - titles - 4 };
      this.box = box;
      this.drawStrip(context, box, strip, fromS, toS, index === STRIPS.length - 1);
      top += room;
    }
    this.drawMarks(context, fromS, toS, height - bottom);
    this.showReadout();
  }

  drawStrip(context, box, strip, fromS, toS, isLast) {
    const columns = Math.max(1, Math.round(box.width));
    const curves = strip.signals.map((signal) => this.samples.columns(signal, fromS, toS, columns));
    const y = valueRange(curves, strip.factor);
    context.fillStyle = colour("text");
    context.textAlign = "left";
    context.textBaseline = "bottom";
    context.fillText(strip.title, box.left, box.top - 2);
    const x = { from: fromS - toS, to: 0, show: isLast, text: (value) => `${+value.toPrecision(4)} s` };
    const { toY } = axes(context, box, x, y);
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.width, box.height);
    context.clip();
    const gap = Math.ceil(2.5 * this.samples.periodS / ((toS - fromS) / columns)) || 1;
    strip.signals.forEach((signal, index) => {
      const style = { colour: colour(SIGNALS[signal]), width: signal === 0 ? 3 : 1.5, gap: Math.max(1, gap) };
      drawColumns(context, box, curves[index], strip.factor, toY, style);
    });
    context.restore();
  }

  drawMarks(context, fromS, toS, bottom) {
    const toX = (timeS) => this.box.left + (timeS - fromS) / (toS - fromS) * this.box.width;
    for (const event of this.events) {
      if (event.time_s < fromS || event.time_s > toS || !["state", "trip"].includes(event.kind)) continue;
      context.strokeStyle = colour(event.kind === "trip" ? "error" : "soft");
      context.setLineDash([3, 4]);
      line(context, toX(event.time_s), 18, toX(event.time_s), bottom);
      context.setLineDash([]);
    }
    for (const cursorS of this.cursors ?? []) {
      context.strokeStyle = colour("text");
      line(context, toX(cursorS), 18, toX(cursorS), bottom);
    }
  }

  valuesAt(timeS) {
    const [fromS, toS] = this.range(), widthS = (toS - fromS) / Math.max(1, this.box?.width ?? 1);
    return SIGNALS.map((_, signal) => this.samples.columns(signal, timeS - widthS / 2, timeS + widthS / 2, 1)[0] ?? null);
  }

  showReadout() {
    const text = (timeS) => this.valuesAt(timeS).map((found, signal) => `${SIGNALS[signal]} ${found ? quantity(found[1], UNITS[signal]) : "no value"}`).join(", ");
    const [, toS] = this.range();
    if (this.cursors) {
      const [firstS, secondS] = this.cursors, first = this.valuesAt(firstS), second = this.valuesAt(secondS);
      const differences = SIGNALS.map((name, signal) => first[signal] && second[signal] ? `${name} ${quantity(second[signal][1] - first[signal][1], UNITS[signal])}` : null);
      this.readout.textContent = `between the cursors: ${quantity(secondS - firstS, "s")} (${quantity(1 / Math.abs(secondS - firstS), "Hz")}); ${differences.filter(Boolean).join(", ")}`;
    } else if (this.pointerS !== null) {
      this.readout.textContent = `${(this.pointerS - toS).toFixed(4)} s: ${text(this.pointerS)}`;
    } else {
      this.readout.textContent = text(this.samples.endS - this.samples.periodS);
    }
  }
}

/** The range of all curves with a margin. */
function valueRange(curves, factor) {
  let from = Infinity, to = -Infinity;
  for (const column of curves.flat()) {
    if (!column) continue;
    from = Math.min(from, column[0] * factor);
    to = Math.max(to, column[1] * factor);
  }
  if (to < from) return { from: -1, to: 1 };
  const margin = Math.max(0.08 * (to - from), 1e-3 * Math.max(Math.abs(from), Math.abs(to)), 1e-3);
  return { from: from - margin, to: to + margin };
}

/** A column of pixels reaches from the minimum to the maximum of its time, so that no spike is left out. */
function drawColumns(context, box, columns, factor, toY, style) {
  context.strokeStyle = style.colour;
  context.lineWidth = style.width;
  context.beginPath();
  let lastIndex = -Infinity;
  columns.forEach((column, index) => {
    if (!column) return;
    const x = box.left + index + 0.5, low = toY(column[0] * factor), high = toY(column[1] * factor);
    // Columns between two samples are empty; a longer gap is missing data.
    if (index - lastIndex <= style.gap) context.lineTo(x, high); else context.moveTo(x, high);
    context.lineTo(x, Math.max(low, high + 1));
    lastIndex = index;
  });
  context.stroke();
  context.lineWidth = 1;
}
