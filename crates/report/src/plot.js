// Cursor readout and zoom for the plots of the chart engine (src/report/chart). Without this script a plot is complete.
//
// attachPlots(root) attaches to every SVG below root that has plots; it may be called again after new SVGs were inserted.
// A plot is a <g class="plot"> with data-box (left, top, right, bottom in units of the view box), data-x and data-y
// ("linear|log|degrees|blank LOW HIGH"), data-x-name, data-x-unit, data-y-name, data-y-unit. It holds <g class="ticks"> and
// <g class="marks">; a curve in the latter is a <g data-name>. A zoom maps pixels linearly, on logarithmic axes too.
// Values come from the drawn curve, so their resolution is a tenth of a pixel of the plot before zooming.
(() => {
'use strict';
const HINT = 'click, then wheel or drag: zoom; Shift + drag: pan; double click: reset';
const MAX_ZOOM = 200, {abs, max, min} = Math;
const INK = '#282828', FRAME = '#5A5A5A', PAPER = '#FFFFFF';
let clips = 0;

const get = (node, name) => node.getAttribute(name);
const clamp = (value, low, high) => min(max(value, low), high);
const numbers = text => (text.match(/-?[\d.]+(?:e-?\d+)?/g) || []).map(Number);

function element(parent, name, attributes, text) {
  const made = document.createElementNS(parent.namespaceURI, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

// ---- axes: `from` and `to` are the visible part, in the places of the axis before zooming

function axisOf(plot, which, start, end) {
  const [kind, low, high] = get(plot, 'data-' + which).split(' ');
  return {kind, low: +low, high: +high, start, end, from: start, to: end, vertical: which === 'y',
    name: get(plot, `data-${which}-name`), unit: get(plot, `data-${which}-unit`)};
}

function valueAt(axis, place) {
  const ratio = (place - axis.start) / (axis.end - axis.start);
  return axis.kind === 'log' ? axis.low * (axis.high / axis.low) ** ratio : axis.low + ratio * (axis.high - axis.low);
}

function placeOf(axis, value) {
  const ratio = axis.kind === 'log' ? Math.log(value / axis.low) / Math.log(axis.high / axis.low)
    : (value - axis.low) / (axis.high - axis.low);
  return axis.start + ratio * (axis.end - axis.start);
}

const scaleOf = axis => (axis.end - axis.start) / (axis.to - axis.from);
const shown = (axis, place) => axis.start + (place - axis.from) * scaleOf(axis);
const back = (axis, place) => axis.from + (place - axis.start) / scaleOf(axis);
const isZoomed = axis => axis.from !== axis.start || axis.to !== axis.end;

// Shows the places from `from` to `to`, moved and widened into the limits of the axis.
function show(axis, from, to) {
  const full = axis.end - axis.start;
  const width = Math.sign(full) * clamp(abs(to - from), abs(full) / MAX_ZOOM, abs(full));
  const [low, high] = full > 0 ? [axis.start, axis.end - width] : [axis.end - width, axis.start];
  axis.from = clamp((from + to - width) / 2, low, high);
  axis.to = axis.from + width;
  if (abs(width - full) < 1e-6 * abs(full)) [axis.from, axis.to] = [axis.start, axis.end];
}

function zoomAxis(axis, factor, place) {
  const centre = back(axis, place);
  const from = centre + (axis.from - centre) / factor, to = centre + (axis.to - centre) / factor;
  show(axis, from, to);
}

// ---- numbers and ticks

const superscript = power => String(power).replace(/./g, c => c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]);
const minus = text => text.replace(/-/g, '−');

function numberText(value, digits) {
  if (value === 0) return '0';
  const size = abs(value);
  if (size >= 1e-3 && size < 1e6) return minus(String(Number(value.toPrecision(digits))));
  const [mantissa, power] = value.toExponential(digits - 1).split('e');
  const factor = Number(mantissa);
  return minus((factor === 1 ? '' : factor + '·')) + '10' + superscript(Number(power));
}

// A value of an axis with its unit. A linear axis has no more digits than its pixels resolve.
function quantity(axis, value, bound) {
  const span = abs(valueAt(axis, axis.to) - valueAt(axis, axis.from));
  const step = 10 ** Math.floor(Math.log10(span / 3000));
  const rounded = axis.kind === 'log' ? value : Math.round(value / step) * step;
  return (bound || '') + numberText(rounded, 5) + (axis.unit ? ' ' + axis.unit : '');
}

function linearTicks(low, high, step) {
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= Math.floor(high / step + 1e-9); k++)
    ticks.push({value: k * step, label: numberText(Number((k * step).toPrecision(12)), 9)});
  return ticks;
}

function niceStep(step, steps) {
  const power = 10 ** Math.floor(Math.log10(step));
  return (steps || [1, 2, 5, 10].map(digit => digit * power)).find(nice => nice >= step * (1 - 1e-9)) || step;
}

function decadeTicks(axis, low, high) {
  const decades = Math.log10(high / low), every = max(1, Math.ceil(decades / 8)), ticks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++)
    for (let digit = 1; digit < 10; digit++) {
      const value = Number(digit + 'e' + power);
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const fine = decades < (axis.vertical ? 2 : 3) && (digit === 2 || digit === 5);
      const labelled = fine || (digit === 1 && (!axis.vertical || power % every === 0));
      const plain = axis.vertical ? (digit === 1 ? '' : digit + '·') + '10' + superscript(power) : numberText(value, 9);
      ticks.push({value, label: labelled ? plain : null});
    }
  return ticks;
}

function ticksOf(axis) {
  const low = valueAt(axis, axis.from), high = valueAt(axis, axis.to);
  if (axis.kind === 'blank') return [];
  if (axis.kind === 'log' && Math.log10(high / low) >= 0.7) return decadeTicks(axis, low, high);
  const count = max(1, abs(axis.end - axis.start) / (axis.vertical ? 400 : 900));
  const step = (high - low) / count;
  const angles = [1, 2, 5, 10, 15, 30, 45, 90, 180, 360];
  return linearTicks(low, high, niceStep(step, axis.kind === 'degrees' && step > 1 && step <= 360 ? angles : null));
}

// ---- marks

function pointsOf(shape) {
  const flat = numbers(get(shape, 'points')), points = [];
  for (let k = 0; k + 1 < flat.length; k += 2) points.push([flat[k], flat[k + 1]]);
  return points;
}

function middle(shape) {
  if (shape.tagName === 'circle') return [+get(shape, 'cx'), +get(shape, 'cy')];
  const points = pointsOf(shape), sum = points.reduce((a, b) => [a[0] + b[0], a[1] + b[1]], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

// How each shape follows a zoom: its points are mapped, or it keeps its size and moves with a point.
function shapesOf(marks) {
  const shapes = [];
  for (const text of marks.querySelectorAll('[data-at]')) shapes.push({node: text, anchor: numbers(get(text, 'data-at'))});
  for (const node of marks.querySelectorAll('polyline,polygon,circle')) {
    const symbol = node.tagName === 'circle' || node.closest('[data-kind="points"]');
    const head = node.tagName === 'polygon' && pointsOf(node).length === 3 && node.closest('[data-name]');
    if (symbol || head) shapes.push({node, anchor: middle(node)});
    else if (!node.closest('[data-dash]')) shapes.push({node, points: pointsOf(node), original: get(node, 'points')});
  }
  for (const group of marks.querySelectorAll('[data-dash]')) shapes.push(...dashedShapes(group));
  return shapes;
}

// The dashes of a line, joined to one line where no more than the space between two dashes is missing.
function dashedShapes(group) {
  const pattern = get(group, 'data-dash'), runs = [];
  for (const node of group.querySelectorAll('polyline')) {
    const points = pointsOf(node), last = runs.at(-1), end = last && last.points.at(-1);
    const joined = end && Math.hypot(points[0][0] - end[0], points[0][1] - end[1]) < 1.3 * numbers(pattern)[1];
    if (joined) { last.points.push(...points); last.rest.push(node); }
    else runs.push({node, points, original: get(node, 'points'), rest: [], pattern});
  }
  return runs;
}

function drawShape(shape, area, zoomed) {
  const map = ([x, y]) => [shown(area.x, x), shown(area.y, y)];
  if (shape.anchor) {
    const [x, y] = map(shape.anchor);
    shape.node.setAttribute('transform', `translate(${x - shape.anchor[0]} ${y - shape.anchor[1]})`);
    return;
  }
  const points = zoomed ? shape.points.map(point => map(point).map(v => v.toFixed(1)).join(',')).join(' ') : shape.original;
  shape.node.setAttribute('points', points);
  if (!shape.rest) return;
  shape.rest.forEach(node => { node.style.display = zoomed ? 'none' : ''; });
  shape.node.style.strokeDasharray = zoomed ? shape.pattern : '';
}

// The named curves and points. A curve of rising x has one value at each x.
function seriesOf(marks) {
  return [...marks.querySelectorAll('[data-name]')].map(group => {
    const symbols = get(group, 'data-kind') === 'points', points = [];
    const lines = [...group.querySelectorAll('polyline')];
    const nodes = symbols || !lines.length ? [...group.querySelectorAll('polyline,circle')] : lines;
    for (const node of nodes) {
      const of = symbols || node.tagName === 'circle' ? [middle(node)] : pointsOf(node);
      of.forEach(([x, y], k) => points.push({x, y, starts: k === 0}));
    }
    const rising = !symbols && points.length > 1 && points.at(-1).x > points[0].x + 1
      && points.every((point, k) => k === 0 || point.x >= points[k - 1].x - 1);
    const paint = ['stroke', 'fill'].map(name => nodes[0]?.getAttribute(name));
    const colour = paint.find(value => value && value !== 'none') || INK;
    return {name: get(group, 'data-name').replace(/ \(band.*\)$/, ''), points, rising, symbols, colour};
  }).filter(series => series.points.length);
}

// The point of a curve at x, or null where the curve has a gap.
function atX(points, x) {
  let low = 0, high = points.length;
  while (low < high) { const k = (low + high) >> 1; if (points[k].x < x) low = k + 1; else high = k; }
  const before = points[low - 1], after = points[low];
  if (!before || !after) { const end = before || after; return abs(end.x - x) <= 30 ? end : null; }
  if (after.starts && after.x - before.x > 150) {
    const near = x - before.x < after.x - x ? before : after;
    return abs(near.x - x) <= 30 ? near : null;
  }
  const ratio = after.x > before.x ? (x - before.x) / (after.x - before.x) : 0;
  return {x, y: before.y + ratio * (after.y - before.y)};
}

// The point of a curve that is nearest on the screen.
function nearest(series, area, x, y) {
  const sx = scaleOf(area.x), sy = scaleOf(area.y);
  let best = null, least = Infinity;
  series.points.forEach((point, k) => {
    const start = series.symbols || point.starts ? point : series.points[k - 1];
    const [dx, dy] = [(point.x - start.x) * sx, (point.y - start.y) * sy];
    const along = ((x - start.x) * sx * dx + (y - start.y) * sy * dy) / (dx * dx + dy * dy || 1);
    const t = clamp(along, 0, 1), at = {x: start.x + t * (point.x - start.x), y: start.y + t * (point.y - start.y)};
    const distance = Math.hypot((x - at.x) * sx, (y - at.y) * sy);
    if (distance < least) [best, least] = [at, distance];
  });
  return best;
}

// ---- one plot area

function areaOf(plot) {
  const [left, top, right, bottom] = numbers(get(plot, 'data-box'));
  const ticks = plot.querySelector('.ticks'), marks = plot.querySelector('.marks');
  const texts = [...ticks.querySelectorAll('text')];
  const area = {plot, ticks, marks, left, top, right, bottom, x: axisOf(plot, 'x', left, right), y: axisOf(plot, 'y', bottom, top),
    equal: plot.hasAttribute('data-equal'), shapes: shapesOf(marks), series: seriesOf(marks),
    xText: texts.find(text => +get(text, 'y') > bottom), yText: texts.find(text => +get(text, 'x') < left)};
  area.rising = area.series.length > 0 && area.series.every(series => series.rising);
  const clip = element(plot, 'clipPath', {id: 'plot-clip-' + clips});
  element(clip, 'rect', {x: left, y: top, width: right - left, height: bottom - top});
  area.clip = `url(#plot-clip-${clips++})`;
  return area;
}

function drawTicks(area) {
  area.drawn?.remove();
  const zoomed = isZoomed(area.x) || isZoomed(area.y);
  area.ticks.style.display = zoomed ? 'none' : '';
  if (!zoomed) return;
  area.drawn = element(area.plot, 'g', {class: 'zoomed-ticks'});
  area.ticks.after(area.drawn);
  for (const axis of [area.x, area.y])
    for (const {value, label} of ticksOf(axis)) {
      const at = shown(axis, placeOf(axis, value)), labelled = label !== null;
      const ends = axis.vertical ? {x1: area.left, x2: area.right, y1: at, y2: at} : {x1: at, x2: at, y1: area.top, y2: area.bottom};
      element(area.drawn, 'line', {...ends, stroke: labelled ? '#CDCDCD' : '#EAEAEA', 'stroke-width': labelled ? 8 : 6});
      const model = axis.vertical ? area.yText : area.xText;
      if (!labelled || !model) continue;
      const text = model.cloneNode(false);
      text.setAttribute(axis.vertical ? 'y' : 'x', at);
      text.textContent = label;
      area.drawn.append(text);
    }
}

function drawArea(area) {
  const zoomed = isZoomed(area.x) || isZoomed(area.y);
  if (zoomed) area.marks.setAttribute('clip-path', area.clip); else area.marks.removeAttribute('clip-path');
  area.shapes.forEach(shape => drawShape(shape, area, zoomed));
  drawTicks(area);
}

// ---- readout

// A line for each series: its value at the cursor, or its nearest point.
function rowsOf(area, x, y) {
  const rows = [];
  for (const series of area.series) {
    const at = series.rising ? atX(series.points, x) : nearest(series, area, x, y);
    if (!at) continue;
    const bound = at.y <= area.top + 0.6 ? '≥ ' : at.y >= area.bottom - 0.6 ? '≤ ' : '';
    const value = area.y.kind === 'blank' ? '' : quantity(area.y, valueAt(area.y, at.y), series.rising ? bound : '');
    const text = series.rising || area.x.kind === 'blank' ? value : quantity(area.x, valueAt(area.x, at.x)) + ', ' + value;
    rows.push({text: series.name + ': ' + text, colour: series.colour, at});
  }
  return rows.slice(0, 9);
}

function cursorText(area, x, y) {
  const name = axis => (axis.name || (axis.vertical ? 'y' : 'x')) + ': ';
  return [area.x, area.y].filter(axis => axis.kind !== 'blank').map(axis => name(axis) + quantity(axis, valueAt(axis, axis.vertical ? y : x))).join('; ');
}

function drawReadout(sheet) {
  sheet.readout.replaceChildren();
  const {cursor} = sheet;
  if (!cursor) return '';
  const said = [];
  for (const area of sheet.areas.filter(other => other === cursor.area || other.x === cursor.area.x)) {
    const active = area === cursor.area;
    const x = back(area.x, cursor.x), y = back(area.y, active ? cursor.y : (area.top + area.bottom) / 2);
    const line = (x1, y1, x2, y2) => element(sheet.readout, 'line', {x1, y1, x2, y2, stroke: INK, 'stroke-width': 6, 'stroke-opacity': 0.6});
    line(cursor.x, area.top, cursor.x, area.bottom);
    if (active) line(area.left, cursor.y, area.right, cursor.y);
    const rows = rowsOf(area, x, y);
    for (const {at, colour} of rows) {
      const [cx, cy] = [shown(area.x, at.x), shown(area.y, at.y)];
      if (cx >= area.left - 1 && cx <= area.right + 1 && cy >= area.top - 1 && cy <= area.bottom + 1)
        element(sheet.readout, 'circle', {cx, cy, r: 40, fill: 'none', stroke: colour, 'stroke-width': 16});
    }
    const heads = active ? [{text: cursorText(area, x, y), colour: INK}] : [];
    const lines = [...heads, ...rows];
    said.push(...lines.map(row => row.text));
    if (active && !sheet.used) lines.push({text: HINT, colour: FRAME});
    if (lines.length) drawBox(sheet, area, lines);
  }
  return said.join('; ');
}

// The lines in a box in the corner away from the cursor.
function drawBox(sheet, area, lines) {
  const box = element(sheet.readout, 'g', {'font-family': 'sans-serif', 'font-size': 120});
  const plate = element(box, 'rect', {fill: PAPER, 'fill-opacity': 0.92, stroke: FRAME, 'stroke-width': 6, rx: 30});
  const texts = lines.map(line => element(box, 'text', {fill: INK}, line.text));
  const width = max(...texts.map(text => text.getComputedTextLength())) + 260, height = 165 * lines.length + 70;
  const at = x => pointerAt(sheet, {clientX: x, clientY: 0}).x;
  const [start, end] = [max(area.left, at(0)), min(area.right, at(document.documentElement.clientWidth))];
  const left = sheet.cursor.x > (start + end) / 2 ? start + 60 : end - width - 60;
  const low = area === sheet.cursor.area && sheet.cursor.y < (area.top + area.bottom) / 2;
  const top = low ? area.bottom - height - 60 : area.top + 60;
  for (const [key, value] of Object.entries({x: left, y: top, width, height})) plate.setAttribute(key, value);
  texts.forEach((text, k) => {
    const y = top + 150 + 165 * k;
    text.setAttribute('x', left + (lines[k].at ? 190 : 70));
    text.setAttribute('y', y);
    if (lines[k].at) element(box, 'line', {x1: left + 60, x2: left + 160, y1: y - 40, y2: y - 40, stroke: lines[k].colour, 'stroke-width': 24});
  });
}

// ---- one sheet: the plots of an SVG

function draw(sheet) {
  if (sheet.waiting) return;
  sheet.waiting = true;
  requestAnimationFrame(() => {
    sheet.waiting = false;
    if (sheet.moved) sheet.areas.forEach(drawArea);
    sheet.moved = false;
    const text = drawReadout(sheet);
    if (sheet.status) sheet.status.textContent = sheet.byKey ? text : '';
  });
}

function zoom(sheet, area, factor, x, y, tall) {
  sheet.moved = sheet.used = true;
  if (!tall || area.equal) zoomAxis(area.x, factor, x);
  if (tall || area.equal || !area.rising) zoomAxis(area.y, factor, y);
  draw(sheet);
}

function pan(sheet, area, dx, dy) {
  sheet.moved = true;
  for (const [axis, by] of [[area.x, dx / scaleOf(area.x)], [area.y, dy / scaleOf(area.y)]]) show(axis, axis.from - by, axis.to - by);
  draw(sheet);
}

function reset(sheet) {
  sheet.moved = true;
  for (const area of sheet.areas) for (const axis of [area.x, area.y]) show(axis, axis.start, axis.end);
  draw(sheet);
}

// Zooms to a rectangle; one that is narrow or flat keeps that axis.
function zoomTo(sheet, area, a, b) {
  const wide = abs(a.x - b.x) > 80, high = abs(a.y - b.y) > 80;
  if (area.equal) {
    const size = max(abs(a.x - b.x) / (area.right - area.left), abs(a.y - b.y) / (area.bottom - area.top));
    const [x, y] = [area.x, area.y].map((axis, k) => back(axis, k ? (a.y + b.y) / 2 : (a.x + b.x) / 2));
    [[area.x, x], [area.y, y]].forEach(([axis, at]) => {
      const half = (axis.to - axis.from) * size / 2;
      show(axis, at - half, at + half);
    });
  } else {
    if (wide) show(area.x, back(area.x, min(a.x, b.x)), back(area.x, max(a.x, b.x)));
    if (high) show(area.y, back(area.y, max(a.y, b.y)), back(area.y, min(a.y, b.y)));
  }
  sheet.moved = sheet.used = true;
  draw(sheet);
}

function areaAt(sheet, {x, y}) {
  return sheet.areas.find(area => x >= area.left && x <= area.right && y >= area.top && y <= area.bottom);
}

function pointerAt(sheet, event) {
  const matrix = sheet.svg.getScreenCTM();
  return matrix ? new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse()) : {x: -1, y: -1};
}

function setCursor(sheet, area, x, y, byKey) {
  sheet.cursor = area ? {area, x: clamp(x, area.left, area.right), y: clamp(y, area.top, area.bottom)} : null;
  sheet.byKey = byKey;
  draw(sheet);
}

function press(sheet, event) {
  const at = pointerAt(sheet, event), area = areaAt(sheet, at);
  if (!area || event.button !== 0) return;
  sheet.svg.focus({preventScroll: true});
  setCursor(sheet, area, at.x, at.y, false);
  if (event.pointerType === 'touch') return;
  sheet.svg.setPointerCapture(event.pointerId);
  sheet.drag = {area, from: at, last: at, pans: event.shiftKey};
}

function move(sheet, event) {
  const at = pointerAt(sheet, event), drag = sheet.drag;
  setCursor(sheet, drag ? drag.area : areaAt(sheet, at), at.x, at.y, false);
  if (!drag) return;
  if (drag.pans) pan(sheet, drag.area, at.x - drag.last.x, at.y - drag.last.y);
  drag.last = at;
  if (!drag.pans) drawSelection(sheet);
}

function drawSelection(sheet) {
  sheet.selection?.remove();
  if (!sheet.drag) return;
  const {cursor, drag: {area, from}} = sheet;
  let [x, y, width, height] = [min(from.x, cursor.x), min(from.y, cursor.y), abs(from.x - cursor.x), abs(from.y - cursor.y)];
  if (height <= 80 && !area.equal) [y, height] = [area.top, area.bottom - area.top];
  else if (width <= 80 && !area.equal) [x, width] = [area.left, area.right - area.left];
  sheet.selection = element(sheet.svg, 'rect', {x, y, width, height, fill: '#0072B2', 'fill-opacity': 0.15, stroke: '#0072B2', 'stroke-width': 8});
}

function release(sheet, cancelled) {
  const {drag, cursor} = sheet;
  sheet.drag = null;
  drawSelection(sheet);
  if (!drag || drag.pans || cancelled || !cursor) return;
  if (Math.hypot(drag.from.x - cursor.x, drag.from.y - cursor.y) > 80) zoomTo(sheet, drag.area, drag.from, cursor);
}

// The wheel zooms a plot that has the focus; otherwise it scrolls the page.
function wheel(sheet, event) {
  const at = pointerAt(sheet, event), area = areaAt(sheet, at);
  if (!area || !(sheet.svg.matches(':focus') || event.ctrlKey)) return;
  const steps = (event.deltaY || event.deltaX) * (event.deltaMode === 1 ? 16 : 1);
  const sideways = event.shiftKey, full = !isZoomed(area.x) && !isZoomed(area.y);
  if (steps > 0 && full && !event.ctrlKey) return;
  event.preventDefault();
  zoom(sheet, area, Math.exp(-0.0018 * steps), at.x, at.y, sideways);
}

const MOVES = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

function key(sheet, event) {
  if (event.altKey || event.ctrlKey || event.metaKey) return;
  const cursor = sheet.cursor || centre(sheet.areas[0]), {area} = cursor;
  if (MOVES[event.key]) step(sheet, cursor, MOVES[event.key].map(by => by * (event.shiftKey ? 400 : 40)));
  else if (event.key === '+' || event.key === '=') zoom(sheet, area, 1.5, cursor.x, cursor.y);
  else if (event.key === '-') zoom(sheet, area, 1 / 1.5, cursor.x, cursor.y);
  else if (event.key === '0') reset(sheet);
  else if (event.key === 'Escape') setCursor(sheet, null);
  else if (event.key === 'PageDown' || event.key === 'PageUp') nextArea(sheet, cursor, event.key === 'PageDown' ? 1 : -1);
  else return;
  event.preventDefault();
}

function centre(area) {
  return {area, x: (area.left + area.right) / 2, y: (area.top + area.bottom) / 2};
}

// Moves the cursor; at an edge of a zoomed plot the view moves, at its top or bottom the cursor enters the next plot.
function step(sheet, cursor, [dx, dy]) {
  const {area} = cursor, [x, y] = [cursor.x + dx, cursor.y + dy];
  const over = [x - clamp(x, area.left, area.right), y - clamp(y, area.top, area.bottom)];
  if (over[1] && !isZoomed(area.y) && nextArea(sheet, cursor, Math.sign(over[1]))) return;
  if (over[0] || over[1]) pan(sheet, area, -over[0], -over[1]);
  sheet.used = true;
  setCursor(sheet, area, x, y, true);
}

function nextArea(sheet, cursor, by) {
  const next = sheet.areas[sheet.areas.indexOf(cursor.area) + by];
  if (!next) return false;
  const y = by > 0 ? next.top : next.bottom;
  setCursor(sheet, next, next.x === cursor.area.x ? cursor.x : centre(next).x, y, true);
  return true;
}

// Plots above each other with the same horizontal axis share it.
function linkAxes(areas) {
  const same = (a, b) => ['kind', 'low', 'high', 'start', 'end', 'unit'].every(key => a[key] === b[key]);
  areas.forEach((area, k) => {
    const first = areas.slice(0, k).find(other => !area.equal && !other.equal && same(other.x, area.x));
    if (first) area.x = first.x;
  });
}

// What a screen reader says after a key: the readout.
function statusOf(svg) {
  const status = document.createElement('div');
  status.setAttribute('role', 'status');
  status.style.cssText = 'position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)';
  svg.after(status);
  return status;
}

function attach(svg) {
  const areas = [...svg.querySelectorAll('g.plot')].map(areaOf);
  if (!areas.length) return;
  linkAxes(areas);
  svg.setAttribute('data-attached', '');
  svg.setAttribute('tabindex', '0');
  if (!svg.hasAttribute('role')) svg.setAttribute('role', 'img');
  if (!svg.hasAttribute('aria-label')) svg.setAttribute('aria-label', (svg.querySelector('text')?.textContent || 'plot').trim());
  const sheet = {svg, areas, readout: element(svg, 'g', {class: 'readout', 'pointer-events': 'none'}), cursor: null};
  const on = (name, act, options) => svg.addEventListener(name, act, options);
  on('pointerdown', event => press(sheet, event));
  on('pointermove', event => move(sheet, event));
  on('pointerup', () => release(sheet, false));
  on('pointercancel', () => release(sheet, true));
  on('pointerleave', () => { if (!sheet.drag && !sheet.byKey) setCursor(sheet, null); });
  on('mousedown', event => { if (areaAt(sheet, pointerAt(sheet, event))) event.preventDefault(); });
  on('dblclick', () => reset(sheet));
  on('wheel', event => wheel(sheet, event), {passive: false});
  on('keydown', event => { sheet.status ||= statusOf(svg); key(sheet, event); });
  on('blur', () => setCursor(sheet, null));
}

function attachPlots(root) {
  const svgs = [...root.querySelectorAll('svg:not([data-attached])')];
  if (root.matches?.('svg:not([data-attached])')) svgs.push(root);
  svgs.forEach(attach);
}

globalThis.attachPlots = attachPlots;
attachPlots(document);
})();
