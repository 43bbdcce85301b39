// Buffers of the last samples: every tick of the last minute, and minimum and maximum of short blocks of the last ten minutes.
// A block keeps its extremes, so that a spike of one tick stays visible in every span.

export const SIGNALS = ["reference", "position", "error", "current"];

const FINE_S = 65;
const COARSE_S = 610;
const COARSE_TICKS = 64;
/** Most missing values of a spectrum. */
const MISSING_SHARE = 0.01;

/** A ring of bins with minimum and maximum of each signal. Each bin has the number of its time interval, so that old bins are not drawn. */
class Bins {
  constructor(count, widthS) {
    this.count = count;
    this.widthS = widthS;
    this.numbers = new Int32Array(count).fill(-1);
    this.minima = SIGNALS.map(() => new Float32Array(count));
    this.maxima = SIGNALS.map(() => new Float32Array(count));
  }

  add(number, signal, minimum, maximum) {
    const at = number % this.count;
    if (this.numbers[at] !== number) {
      this.numbers[at] = number;
      for (let other = 0; other < SIGNALS.length; other++) {
        this.minima[other][at] = NaN;
        this.maxima[other][at] = NaN;
      }
    }
    const low = this.minima[signal], high = this.maxima[signal];
    if (!(low[at] <= minimum)) low[at] = minimum;
    if (!(high[at] >= maximum)) high[at] = maximum;
  }

  /** Extremes of a signal in a span of time, or null if there is no sample. */
  extremes(signal, fromS, toS) {
    const first = Math.floor(fromS / this.widthS);
    const last = Math.max(first, Math.ceil(toS / this.widthS) - 1);
    const low = this.minima[signal], high = this.maxima[signal];
    let minimum = Infinity, maximum = -Infinity;
    for (let number = first; number <= last; number++) {
      if (number < 0) continue;
      const at = number % this.count;
      if (this.numbers[at] !== number) continue;
      if (low[at] < minimum) minimum = low[at];
      if (high[at] > maximum) maximum = high[at];
    }
    return maximum < minimum ? null : [minimum, maximum];
  }
}

export class Samples {
  constructor() {
    this.clear();
  }

  /** Forgets everything: another daemon counts its time anew. */
  clear() {
    this.periodS = 0;
    this.endS = 0;
    this.fine = null;
    this.coarse = null;
    /** Time of the first sample at full rate. */
    this.fineFromS = Infinity;
  }

  begin(periodS) {
    this.periodS = periodS;
    this.fineFromS = Infinity;
    this.fine = new Bins(Math.ceil(FINE_S / periodS), periodS);
    this.coarse = new Bins(Math.ceil(COARSE_S / (periodS * COARSE_TICKS)), periodS * COARSE_TICKS);
  }

  /** Adds a binary message of the daemon (docs/daemon.md, "Samples"). Returns the frame. */
  add(buffer) {
    const view = new DataView(buffer);
    if (view.getUint8(0) !== 1 || view.getUint8(1) !== 1) throw new Error("samples of another version of the daemon");
    const signals = view.getUint16(2, true), blockTicks = view.getUint32(4, true);
    const startS = view.getFloat64(8, true), blockS = view.getFloat64(16, true);
    const count = view.getUint32(24, true), run = view.getUint32(28, true);
    const tickS = blockS / blockTicks;
    if (this.periodS === 0 || Math.abs(tickS / this.periodS - 1) > 1e-6) this.begin(tickS);
    for (let signal = 0; signal < signals; signal++) {
      const minima = new Float32Array(buffer, 32 + 4 * count * signal, count);
      const maxima = blockTicks > 1 ? new Float32Array(buffer, 32 + 4 * count * (signals + signal), count) : minima;
      this.addSignal(signal, startS, blockTicks, minima, maxima);
    }
    if (blockTicks < COARSE_TICKS) this.fineFromS = Math.min(this.fineFromS, startS);
    this.endS = Math.max(this.endS, startS + count * blockS);
    return { startS, blockS, count, run };
  }

  addSignal(signal, startS, blockTicks, minima, maxima) {
    const firstTick = Math.round(startS / this.periodS);
    for (let block = 0; block < minima.length; block++) {
      if (Number.isNaN(minima[block])) continue;
      const tick = firstTick + block * blockTicks;
      // A block of some ticks fills all fine bins that it covers: its extremes are somewhere in them.
      if (blockTicks < COARSE_TICKS) {
        for (let part = 0; part < blockTicks; part++) this.fine.add(tick + part, signal, minima[block], maxima[block]);
      }
      const coarse = Math.floor(tick / COARSE_TICKS), coarseEnd = Math.floor((tick + blockTicks - 1) / COARSE_TICKS);
      for (let number = coarse; number <= coarseEnd; number++) this.coarse.add(number, signal, minima[block], maxima[block]);
    }
  }

  /** Minimum and maximum of a signal for each of `columns` columns of a span. */
  columns(signal, fromS, toS, columns) {
    if (!this.fine) return [];
    const widthS = (toS - fromS) / columns;
    const fineFromS = widthS < this.coarse.widthS ? Math.max(this.fineFromS, this.endS - FINE_S + 1) : Infinity;
    return Array.from({ length: columns }, (_, column) => {
      const startS = fromS + column * widthS;
      const bins = startS >= fineFromS ? this.fine : this.coarse;
      return bins.extremes(signal, startS, startS + widthS);
    });
  }

  /** The last `count` values of a signal at full rate, oldest first. A missing one is that before it; null if more than 1 % are missing. */
  last(signal, count) {
    if (!this.fine) return null;
    const end = Math.round(this.endS / this.periodS);
    const values = new Float64Array(count);
    let missing = 0, before = 0;
    for (let back = 0; back < count; back++) {
      const number = end - count + back, at = number % this.fine.count;
      const isKnown = number >= 0 && this.fine.numbers[at] === number && !Number.isNaN(this.fine.maxima[signal][at]);
      if (isKnown) before = this.fine.maxima[signal][at];
      else if (++missing > MISSING_SHARE * count) return null;
      values[back] = before;
    }
    return values;
  }
}
