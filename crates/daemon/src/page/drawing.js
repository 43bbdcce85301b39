// Axes and colours of the plots on canvas.

const probe = document.createElement("span");
probe.hidden = true;
document.documentElement.append(probe);

const colours = new Map();

/** The colour of a name in page.css, in the theme of the page. */
export function colour(name) {
  if (!colours.has(name)) {
    probe.style.color = `var(--${name})`;
    colours.set(name, getComputedStyle(probe).color);
  }
  return colours.get(name);
}

/** The theme has changed. */
export function forgetColours() {
  colours.clear();
}

/** The context of a canvas in the pixels of the screen, with its size and the size of its font in CSS pixels. */
export function begin(canvas) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  const em = parseFloat(getComputedStyle(canvas).fontSize);
  context.font = `${em}px system-ui, sans-serif`;
  return { context, width, height, em };
}

/** Round values that divide a range into about `count` parts. */
export function ticks(from, to, count) {
  const raw = (to - from) / Math.max(1, count);
  if (!(raw > 0)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= raw);
  const first = Math.ceil(from / step - 1e-9);
  const last = Math.floor(to / step + 1e-9);
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, index) => (first + index) * step);
}

/** A number with as many digits as its step needs. */
export function label(value, step) {
  const digits = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  return (Math.abs(value) < step / 1e6 ? 0 : value).toFixed(digits);
}

/** A frame with a grid and labels; returns the functions from values to pixels. */
export function axes(context, box, x, y) {
  const toX = (value) => box.left + (value - x.from) / (x.to - x.from) * box.width;
  const toY = (value) => box.top + box.height - (value - y.from) / (y.to - y.from) * box.height;
  context.lineWidth = 1;
  context.strokeStyle = colour("grid");
  context.fillStyle = colour("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  const rows = ticks(y.from, y.to, Math.max(4, box.height / 40));
  for (const value of rows) {
    line(context, box.left, toY(value), box.left + box.width, toY(value));
    context.fillText(y.text ? y.text(value) : label(value, rows.length > 1 ? rows[1] - rows[0] : 1), box.left - 6, toY(value));
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  const columns = x.ticks ?? ticks(x.from, x.to, Math.max(2, box.width / 90));
  for (const value of columns) {
    line(context, toX(value), box.top, toX(value), box.top + box.height);
    if (x.show) context.fillText(x.text ? x.text(value) : label(value, columns.length > 1 ? columns[1] - columns[0] : 1), toX(value), box.top + box.height + 4);
  }
  context.strokeStyle = colour("line");
  context.strokeRect(box.left, box.top, box.width, box.height);
  return { toX, toY };
}

export function line(context, x1, y1, x2, y2) {
  context.beginPath();
  context.moveTo(x1, y1);
  context.lineTo(x2, y2);
  context.stroke();
}

/** A quantity in metres, amperes or seconds with a unit that suits its size. */
export function quantity(value, unit) {
  if (value === null || value === undefined || Number.isNaN(value)) return "no value";
  const size = Math.abs(value);
  const steps = [[1, ""], [1e-3, "m"], [1e-6, "u"], [1e-9, "n"]];
  const [factor, prefix] = size === 0 ? [1, ""] : steps.find(([factor]) => size >= factor) ?? steps[3];
  return `${(value / factor).toPrecision(4)} ${prefix}${unit}`;
}
