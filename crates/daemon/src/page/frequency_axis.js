// A logarithmic frequency axis with cursor and zoom, for the plots on canvas.
// Wheel, or + and -: zoom. Drag: pan. Arrow keys: move the cursor. Double click, or 0: the whole axis.

/** Smallest visible range in decades. */
const MIN_DECADES = 0.05;

export class FrequencyAxis {
  /** Calls `draw` after each change of the visible range or of the cursor. */
  constructor(canvas, draw) {
    Object.assign(this, { canvas, draw });
    this.box = { left: 0, width: 1 };
    this.setLimits(1, 1000);
    this.zoomed = null; // decades; null: the whole axis
    this.cursor = null; // decades
    this.isPointed = false; // whether the pointer has moved the cursor
    this.listen();
  }

  setLimits(fromHz, toHz) {
    this.limits = [Math.log10(fromHz), Math.log10(toHz)];
  }

  get range() { return this.zoomed ?? this.limits; }

  /** The description of the axis for `axes` of drawing.js. */
  describe(isShown) {
    const [from, to] = this.range;
    const decades = [];
    for (let power = Math.ceil(from - 1e-9); power <= to + 1e-9; power++) decades.push(power);
    const text = (value) => {
      const hz = 10 ** value;
      return `${hz >= 1 ? +hz.toPrecision(3) : hz.toFixed(Math.ceil(-value))} Hz`;
    };
    return { from, to, show: isShown, text, ticks: decades.length > 1 ? decades : undefined };
  }

  get cursorHz() { return this.cursor === null ? null : 10 ** this.cursor; }

  at(event) {
    const [from, to] = this.range;
    return from + (event.offsetX - this.box.left) / this.box.width * (to - from);
  }

  show(from, to) {
    const [low, high] = this.limits;
    const width = Math.min(high - low, Math.max(MIN_DECADES, to - from));
    const start = Math.min(high - width, Math.max(low, from));
    this.zoomed = width >= high - low - 1e-9 ? null : [start, start + width];
    this.draw();
  }

  zoom(factor, around) {
    const [from, to] = this.range;
    const middle = around ?? this.cursor ?? (from + to) / 2;
    this.show(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  moveCursor(share) {
    this.isPointed = false;
    const [from, to] = this.range;
    this.cursor = Math.min(to, Math.max(from, (this.cursor ?? (from + to) / 2) + share * (to - from)));
    this.draw();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.25 : 0.8, this.at(event)); }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => { this.drag = { x: event.offsetX, range: [...this.range] }; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointermove", (event) => {
      if (this.drag) {
        const moved = (this.drag.x - event.offsetX) / this.box.width * (this.drag.range[1] - this.drag.range[0]);
        if (this.zoomed) this.show(this.drag.range[0] + moved, this.drag.range[1] + moved);
        return;
      }
      this.cursor = this.at(event);
      this.isPointed = true;
      this.draw();
    });
    canvas.addEventListener("pointerup", () => { this.drag = null; });
    // A cursor that the keyboard has moved stays.
    canvas.addEventListener("pointerleave", () => { if (this.isPointed) { this.cursor = null; this.draw(); } });
    canvas.addEventListener("dblclick", () => { this.zoomed = null; this.draw(); });
    canvas.addEventListener("keydown", (event) => {
      const actions = {
        ArrowLeft: () => this.moveCursor(-0.02), ArrowRight: () => this.moveCursor(0.02),
        "+": () => this.zoom(0.8), "-": () => this.zoom(1.25), 0: () => { this.zoomed = null; this.draw(); },
      };
      const action = actions[event.key];
      if (action) { event.preventDefault(); action(); }
    });
  }
}
