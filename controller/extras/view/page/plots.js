// Four plots of the last 20 s: forces; distance to the nearest surface; mass and energy; compute time of a cycle.
// During a contact, the background is shaded: plain while the contact sticks, hatched while it slips.
import { PHASE_RENDERING } from './connection.js';
import { evenForce } from './felt.js';
import { colour, dash, onTheme } from './theme.js';

const WINDOW_S = 20;
const MOST_ROWS = 1500;
const STICK = 1, SLIP = 2;
const LEFT = 46, RIGHT = 10, TOP = 24, BOTTOM = 20;
const TEXT_HEIGHT = 11;
// PEAK_WIDTH: width of a peak's number. PEAK_SIGN: from the number's left end to the middle of its sign.
const PEAK_WIDTH = 52, PEAK_SIGN = 5;
// Sizes of the head above the lines.
const HEAD_LEFT = 10, HEAD_ROW = 16, SAMPLE = 20;
const HEAD_FONT = '600 12px system-ui, "DejaVu Sans", sans-serif', FONT = '11px system-ui, "DejaVu Sans", sans-serif';

// Distances range from a hand's width down to micrometres, on both sides of the surface. Their scale is linear below
// LINEAR_MM and logarithmic above.
const LINEAR_MM = 0.05;
const bent = (mm) => Math.asinh(mm / LINEAR_MM);
const BENT_TICKS_MM = [-10, -1, -0.1, 0, 0.1, 1, 10, 100];

const moved = (m, value) => (m.phase >= PHASE_RENDERING ? value : NaN);

// Lines may leave a plot at its top for a moment, since a blow of a millisecond would flatten everything else. The
// peak's height is then written there.
const SESSION_PLOTS = [
  { title: 'force', unit: 'N', least: 5, zero: true, lines: [
    { name: 'peaks', value: (m) => moved(m, m.contact_peak_N), as: 'peaks', peaks: true },
    { name: 'hand', value: (m) => moved(m, m.hand_N), as: 'hand' },
    { name: 'contact', value: (m) => moved(m, m.contact_N), as: 'contact' }] },
  { title: 'to the surface', unit: 'mm', bent: true, lines: [
    { name: 'tool', value: (m) => moved(m, 1e3 * m.tool_clearance_m), as: 'tool' },
    { name: 'proxy', value: (m) => moved(m, 1e3 * m.proxy_clearance_m), as: 'proxy' }] },
  { title: 'mass, energy', unit: 'kg · J', least: 1, zero: true, lines: [
    { name: 'wanted', value: (m) => (m.mass_kg > 0 ? m.mass_kg : NaN), as: 'wanted' },
    { name: 'felt', value: (m) => m.felt_kg, as: 'felt' },
    { name: 'energy', value: (m) => m.energy_hand_J, as: 'energy' }] },
  { title: 'computing a cycle', unit: 'µs', least: 10, zero: true, lines: [
    { name: 'longest', value: (m) => m.compute_peak_us, as: 'peaks', peaks: true },
    { name: 'last', value: (m) => m.compute_us, as: 'computing' }],
    live: true, note: overrunNote },
];

// In virtual time a cycle may take longer than its period without an overrun, since virtual time waits for the cycle.
function overrunNote(rows) {
  const { overruns } = rows[rows.length - 1];
  if (overruns > 0) return overruns === 1 ? '1 overrun' : `${overruns} overruns`;
  const longest = rows.reduce((most, row) => (row.compute_peak_us > most.compute_peak_us ? row : most));
  if (longest.compute_peak_us <= 1e6 * longest.period_s) return 'no overrun';
  return `over the period: ${Number((1e-3 * longest.compute_peak_us).toPrecision(3))} ms`;
}

// Plots of the simulated arm alone, where hand and sensor have values in every phase of the drives.
const ARM_PLOTS = [
  { title: 'force', unit: 'N', least: 5, zero: true, lines: [
    { name: 'hand', value: (m) => m.hand_N, as: 'hand' },
    { name: 'on the sensor', value: (m) => m.sensor_N, as: 'contact' }] },
  { title: 'tool’s speed', unit: 'mm/s', least: 10, zero: true, lines: [
    { name: 'tool', value: (m) => m.speed_mm_per_s, as: 'tool' }] },
  { title: 'mass felt', unit: 'kg', least: 1, zero: true, lines: [
    { name: 'in free motion', value: (m) => m.felt_kg, as: 'felt' }] },
];

// The mass that the hand feels: the hand's force along the tool's acceleration, divided by this acceleration. It is a
// running fit over about half a second of free motion. Force and tool position are filtered equally, so both have the
// same delay.
class FeltMass {
  // `anyMass`: whether a mass is shown although there is no proxy with a known mass.
  constructor(anyMass = false) {
    this.anyMass = anyMass;
    this.reset();
  }

  reset() {
    this.rows = [];
    this.forceTimesA = this.aTimesA = 0;
  }

  of(moment) {
    const last = this.rows[this.rows.length - 1];
    if (last && moment.time_s <= last.time_s) this.reset();
    this.rows.push(moment);
    if (this.rows.length < 9) return NaN;
    if (this.rows.length > 9) this.rows.shift();
    const [a, b, c] = [this.rows[0], this.rows[4], this.rows[8]];
    const h1 = b.time_s - a.time_s, h2 = c.time_s - b.time_s;
    const keep = Math.exp(-(b.time_s - this.rows[3].time_s) / 0.5);
    this.forceTimesA *= keep;
    this.aTimesA *= keep;
    if (a.contact === 0 && c.contact === 0 && (this.anyMass || c.mass_kg > 0) && h1 > 0 && h2 > 0) {
      const force = evenForce(this.rows);
      ['x', 'y', 'z'].forEach((axis, k) => {
        const p = `tool_${axis}`;
        const acceleration = 2 * ((c[p] - b[p]) / h2 - (b[p] - a[p]) / h1) / (h1 + h2);
        this.forceTimesA += force[k] * acceleration;
        this.aTimesA += acceleration * acceleration;
      });
    }
    const known = this.aTimesA > 0.5 && a.contact === 0 && c.contact === 0;
    // The sensor doesn't see the force that moves the handle.
    const handle_kg = this.anyMass ? 0 : c.handle_kg;
    return known ? Math.min(200, Math.max(0, handle_kg + this.forceTimesA / this.aTimesA)) : NaN;
  }
}

function speedBetween(a, b) {
  return 1e3 * Math.hypot(b.tool_x - a.tool_x, b.tool_y - a.tool_y, b.tool_z - a.tool_z) / (b.time_s - a.time_s);
}

function niceStep(range, most) {
  const raw = range / most, power = 10 ** Math.floor(Math.log10(raw));
  return [1, 2, 5, 10].map((f) => f * power).find((step) => step >= raw);
}

class Plot {
  constructor(description, parent) {
    this.description = description;
    const box = document.createElement('div');
    box.className = 'plot';
    box.setAttribute('role', 'img');
    box.setAttribute('aria-label', `${description.title}, in ${description.unit}, over the last ${WINDOW_S} s`);
    this.canvas = document.createElement('canvas');
    box.append(this.canvas);
    parent.append(box);
    this.context = this.canvas.getContext('2d');
    this.values = document.createElement('div');
    this.values.className = 'values';
    this.values.hidden = true;
    box.append(this.values);
    box.addEventListener('pointermove', (event) => { this.pointer = event.offsetX; this.stale = true; });
    box.addEventListener('pointerleave', () => { this.pointer = undefined; this.stale = true; });
    new ResizeObserver(() => this.resize()).observe(box);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    // The box may end within a pixel, and scaling to it would blur the canvas.
    this.canvas.style.width = `${this.canvas.width / ratio}px`;
    this.canvas.style.height = `${this.canvas.height / ratio}px`;
    this.ratio = ratio;
    this.width = width;
    this.height = height;
    this.stale = true;
  }

  range(rows) {
    const { lines, least = 0, zero } = this.description;
    const heights = [];
    let low = zero ? 0 : Infinity, high = zero ? least : -Infinity;
    for (const row of rows) {
      for (const line of lines) {
        const value = this.scaled(line.value(row));
        if (!Number.isFinite(value) || line.peaks) continue;
        if (value < low) low = value;
        if (value > high) high = value;
        heights.push(value);
      }
    }
    if (zero && heights.length > 20) {
      // Short peaks don't determine the range either; they leave the plot at its top.
      heights.sort((a, b) => a - b);
      high = Math.max(least, Math.min(high, 2.5 * heights[Math.floor(0.97 * heights.length)]));
    }
    if (this.description.bent) {
      low = Math.min(low, bent(-0.1));
      high = Math.max(high, bent(10));
    }
    if (!(high > low)) return [0, 1];
    return [low < 0 ? low * 1.08 : low, high + 0.08 * (high - low)];
  }

  scaled(value) {
    return this.description.bent ? bent(value) : value;
  }

  ticks(low, high) {
    if (this.description.bent) {
      return BENT_TICKS_MM.map((mm) => [bent(mm), String(mm).replace('-', '−')]).filter(([y]) => y >= low && y <= high);
    }
    const step = niceStep(high - low, 4), out = [];
    for (let y = Math.ceil(low / step) * step; y <= high; y += step) {
      out.push([y, String(Number(y.toPrecision(6))).replace('-', '−')]);
    }
    return out;
  }

  // `headRows`: number of rows for the head, at least as many as layHead() has returned.
  draw(rows, from, to, playhead, headRows) {
    const c = this.context;
    if (!this.width || !this.height) return;
    this.top = TOP + (headRows - 1) * HEAD_ROW;
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    c.clearRect(0, 0, this.width, this.height);
    const [low, high] = this.range(rows);
    const x = (t) => LEFT + ((t - from) / (to - from)) * (this.width - LEFT - RIGHT);
    const y = (v) => this.height - BOTTOM - ((v - low) / (high - low)) * (this.height - this.top - BOTTOM);
    this.shade(rows, x);
    this.axes(low, high, from, to, x, y);
    c.save();
    c.beginPath();
    c.rect(LEFT, this.top - 2, this.width - LEFT - RIGHT, this.height - this.top - BOTTOM + 4);
    c.clip();
    for (const line of this.description.lines) this.line(line, rows, x, y);
    c.restore();
    this.numberPeaks(rows, high, x);
    if (playhead !== undefined) {
      c.strokeStyle = colour('--ink');
      c.setLineDash([]);
      c.beginPath();
      c.moveTo(x(playhead), this.top - 4);
      c.lineTo(x(playhead), this.height - BOTTOM);
      c.stroke();
    }
    this.drawHead();
    this.tellPointed(rows, from, to, x);
  }

  // Shows the values of the row that is nearest to the pointer.
  tellPointed(rows, from, to, x) {
    const inside = this.pointer >= LEFT && this.pointer <= this.width - RIGHT && rows.length > 0;
    this.values.hidden = !inside;
    if (!inside) return;
    const time = from + ((this.pointer - LEFT) / (this.width - LEFT - RIGHT)) * (to - from);
    const row = rows.reduce((best, one) => (Math.abs(one.time_s - time) < Math.abs(best.time_s - time) ? one : best));
    const { unit, lines } = this.description, c = this.context;
    const told = lines.map((line) => [line.name, line.value(row)]).filter(([, value]) => Number.isFinite(value));
    this.values.textContent = [`${row.time_s.toFixed(3)} s`, ...told.map(([name, value]) => `${name} ${Number(value.toPrecision(4))}`)]
      .join('\n') + (told.length ? ` ${unit}` : '');
    c.strokeStyle = colour('--ink');
    c.lineWidth = 1;
    c.setLineDash(dash('peaks'));
    c.beginPath();
    c.moveTo(x(row.time_s), this.top);
    c.lineTo(x(row.time_s), this.height - BOTTOM);
    c.stroke();
    c.setLineDash([]);
    const right = x(row.time_s) > this.width / 2;
    this.values.style.left = right ? '' : `${x(row.time_s) + 6}px`;
    this.values.style.right = right ? `${this.width - x(row.time_s) + 6}px` : '';
  }

  shade(rows, x) {
    const c = this.context, { top } = this, height = this.height - top - BOTTOM;
    const fills = { [STICK]: colour('--shade-stick'), [SLIP]: this.hatching() };
    let i = 0;
    while (i < rows.length) {
      const contact = rows[i].contact, first = i;
      while (i < rows.length && rows[i].contact === contact) ++i;
      if (contact !== STICK && contact !== SLIP) continue;
      const from = Math.max(LEFT, x(rows[first].time_s));
      const to = x(rows[Math.min(i, rows.length - 1)].time_s);
      c.fillStyle = fills[contact];
      c.fillRect(from, top, Math.max(1, to - from), height);
    }
  }

  hatching() {
    const key = colour('--slip');
    if (this.hatched !== key) {
      const tile = document.createElement('canvas');
      tile.width = tile.height = 8;
      const c = tile.getContext('2d');
      c.fillStyle = colour('--shade-slip');
      c.fillRect(0, 0, 8, 8);
      c.strokeStyle = key;
      c.globalAlpha = 0.35;
      for (const shift of [-8, 0, 8]) {
        c.beginPath();
        c.moveTo(shift, 8);
        c.lineTo(shift + 8, 0);
        c.stroke();
      }
      this.pattern = this.context.createPattern(tile, 'repeat');
      this.hatched = key;
    }
    return this.pattern;
  }

  axes(low, high, from, to, x, y) {
    const c = this.context;
    c.font = FONT;
    c.lineWidth = 1;
    c.setLineDash([]);
    c.strokeStyle = colour('--line');
    c.fillStyle = colour('--soft');
    c.textAlign = 'right';
    c.textBaseline = 'middle';
    let last = Infinity;
    for (const [value, text] of this.ticks(low, high)) {
      const at = Math.round(y(value)) + 0.5;
      c.beginPath();
      c.moveTo(LEFT, at);
      c.lineTo(this.width - RIGHT, at);
      c.stroke();
      // In a low plot, numbers near 0 would lie over the 0.
      if (value !== 0 && (Math.abs(at - y(0)) < TEXT_HEIGHT || Math.abs(at - last) < TEXT_HEIGHT)) continue;
      c.fillText(text, LEFT - 5, at);
      last = at;
    }
    c.textAlign = 'center';
    c.textBaseline = 'top';
    const step = niceStep(to - from, Math.max(2, this.width / 90));
    for (let t = Math.ceil(from / step) * step; t <= to; t += step) {
      if (t < 0 || x(t) > this.width - 22) continue;
      c.fillText(`${Number(t.toFixed(3))} s`, x(t), this.height - BOTTOM + 5);
    }
  }

  line(line, rows, x, y) {
    const c = this.context;
    c.strokeStyle = colour(`--line-${line.as}`);
    c.lineWidth = 1.8;
    c.setLineDash(dash(line.as));
    c.beginPath();
    let down = false;
    for (const row of rows) {
      const value = this.scaled(line.value(row));
      if (!Number.isFinite(value)) { down = false; continue; }
      if (down) c.lineTo(x(row.time_s), y(value)); else c.moveTo(x(row.time_s), y(value));
      down = true;
    }
    c.stroke();
  }

  // Writes the heights of peaks that leave the plot at its top. Of peaks whose numbers would overlap, only the highest
  // is written.
  numberPeaks(rows, high, x) {
    const c = this.context, { lines } = this.description;
    this.peaks = [];
    for (const row of rows) {
      const value = Math.max(...lines.map((line) => this.scaled(line.value(row))).filter(Number.isFinite));
      const last = this.peaks[this.peaks.length - 1];
      if (!(value > high) || x(row.time_s) < LEFT) continue;
      if (last && x(row.time_s) - last.x < PEAK_WIDTH) {
        if (value > last.value) Object.assign(last, { value, x: x(row.time_s) });
      } else {
        this.peaks.push({ value, x: x(row.time_s) });
      }
    }
    c.font = FONT;
    c.textBaseline = 'top';
    for (const peak of this.peaks) {
      const number = String(Number(peak.value.toPrecision(3)));
      const width = c.measureText(`▲ ${number}`).width, right = peak.x + width > this.width - 2;
      peak.text = right ? `${number} ▲` : `▲ ${number}`;
      const left = right ? peak.x - width + PEAK_SIGN : peak.x - PEAK_SIGN;
      c.fillStyle = colour('--card');
      c.globalAlpha = 0.8;
      c.fillRect(left - 1, this.top - 1, width + 2, TEXT_HEIGHT + 2);
      c.globalAlpha = 1;
      c.fillStyle = colour('--ink');
      c.textAlign = 'left';
      c.fillText(peak.text, left, this.top);
    }
  }

  // Lays out the head: the title, the name of each line after a sample of the line, and the note. Returns the number of
  // rows that the head takes.
  layHead(rows) {
    const c = this.context, { title, unit, lines, note } = this.description;
    let x = HEAD_LEFT, row = 0;
    this.head = [];
    const put = (text, font, line) => {
      c.font = font;
      const width = c.measureText(text).width + (line ? SAMPLE + 5 : 0);
      if (this.head.length && x + width > this.width - 4) {
        x = HEAD_LEFT;
        ++row;
      }
      this.head.push({ text, font, line, x, row, width });
      x += width + 12;
    };
    put(`${title}, ${unit}`, HEAD_FONT);
    for (const line of lines) put(line.name, FONT, line);
    const text = note && rows.length ? note(rows) : '';
    if (text) put(text, FONT);
    return row + 1;
  }

  drawHead() {
    const c = this.context;
    c.textBaseline = 'middle';
    c.textAlign = 'left';
    c.lineWidth = 2;
    for (const { text, font, line, x, row } of this.head) {
      const y = 12 + row * HEAD_ROW;
      if (line) {
        c.strokeStyle = colour(`--line-${line.as}`);
        c.setLineDash(dash(line.as));
        c.beginPath();
        c.moveTo(x, y);
        c.lineTo(x + SAMPLE, y);
        c.stroke();
      }
      c.font = font;
      c.fillStyle = colour(font === HEAD_FONT ? '--ink' : '--soft');
      c.fillText(text, line ? x + SAMPLE + 5 : x, y);
    }
    c.setLineDash([]);
  }
}

export class Plots {
  constructor(parent) {
    this.parent = parent;
    this.plots = [];
    this.rows = [];
    this.felt = new FeltMass();
    this.drawn = 0;
    onTheme(() => { this.stale = true; });
  }

  introduce(stage) {
    const alone = stage.mode === 'arm';
    this.parent.replaceChildren();
    this.parent.classList.toggle('three', alone);
    this.plots = (alone ? ARM_PLOTS : SESSION_PLOTS).map((description) => new Plot(description, this.parent));
    this.felt = new FeltMass(alone);
  }

  // Hides plots of compute times, which a record doesn't have, since they depend on the machine.
  leaveOutLive() {
    for (const plot of this.plots) plot.canvas.parentElement.hidden = Boolean(plot.description.live);
    this.plots[0].canvas.parentElement.parentElement.classList.add('three');
  }

  add(moment) {
    const last = this.rows[this.rows.length - 1];
    if (last && moment.time_s <= last.time_s) return;
    const { links, objects, ...row } = moment;
    row.felt_kg = this.felt.of(row);
    row.speed_mm_per_s = last ? speedBetween(last, row) : NaN;
    this.rows.push(row);
    while (this.rows.length > MOST_ROWS || this.rows[0].time_s < row.time_s - WINDOW_S - 1) this.rows.shift();
    this.stale = true;
  }

  // Sets a window of a record, with the place that is shown.
  setWindow(rows, from, to, playhead) {
    this.felt.reset();
    this.rows = rows;
    for (const row of rows) row.felt_kg = this.felt.of(row);
    this.window = { from, to };
    this.setPlayhead(playhead);
  }

  setPlayhead(playhead) {
    this.playhead = playhead;
    this.stale = true;
  }

  // Draws at most twenty times a second, which is fast enough for the eye to follow lines.
  draw(now) {
    if (now - this.drawn < 50 || !(this.stale || this.plots.some((plot) => plot.stale))) return;
    this.drawn = now;
    this.stale = false;
    const newest = this.rows.length ? this.rows[this.rows.length - 1].time_s : 0;
    const to = this.window ? this.window.to : Math.max(WINDOW_S, newest);
    const from = this.window ? this.window.from : to - WINDOW_S;
    const rows = this.rows.filter((row) => row.time_s >= from - 0.1 && row.time_s <= to + 0.1);
    const shown = this.plots.filter((plot) => plot.width && plot.height);
    const headRows = Math.max(1, ...shown.map((plot) => plot.layHead(rows)));
    for (const plot of this.plots) {
      plot.stale = false;
      plot.draw(rows, from, to, this.playhead, headRows);
    }
  }
}
