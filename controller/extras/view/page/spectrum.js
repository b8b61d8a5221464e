// The handle's vibration and the amplitudes that a hand just notices: third-octave bands of the last second, on two
// logarithmic axes (docs/how_to/view.md has the sources).
import { colour, dash, onTheme } from './theme.js';

const LEFT = 34, RIGHT = 6, TOP = 18, BOTTOM = 16;
const EDGE = 10 ** 0.05;  // factor from a band's centre to its edges
const TICKS_HZ = [10, 20, 50, 100, 200, 400];
const LEAST_UM = 1e-3, MOST_UM = 1e5;  // ends of the axis
const FONT = '10px system-ui, "DejaVu Sans", sans-serif';

// Returns 1234 as "1.2 mm", 0.031 as "0.031 µm".
export function micrometres(um) {
  if (um >= 1e3) return `${Number((1e-3 * um).toPrecision(2))} mm`;
  return um >= 1e-3 ? `${Number(um.toPrecision(2))} µm` : 'under 1 nm';
}

// Returns the band whose amplitude is largest compared with what a hand notices.
export function loudest(bands) {
  const told = bands.filter((band) => band.threshold_um !== null);
  return told.reduce((most, band) =>
    (!most || band.amplitude_um / band.threshold_um > most.amplitude_um / most.threshold_um ? band : most), null);
}

export class Spectrum {
  constructor(section, stage) {
    this.section = section;
    this.canvas = section.querySelector('canvas');
    this.context = this.canvas.getContext('2d');
    this.words = section.querySelector('p');
    this.points = stage.threshold?.points ?? [];
    this.bands = [];
    section.hidden = stage.mode === 'arm' || !this.points.length;
    section.title = `threshold: ${stage.threshold?.source ?? ''}`;
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    onTheme(() => this.draw());
  }

  // `at`: the record's cycle to which the bands belong.
  show({ bands, of, at }) {
    if (this.section.hidden) return;
    this.bands = bands;
    this.of = of;
    this.at = at;
    this.words.textContent = this.sentence();
    this.draw();
  }

  sentence() {
    const band = loudest(this.bands);
    if (!band) return 'after a second of rendering without a break';
    const times = band.amplitude_um / band.threshold_um, source = this.of === 'steel' ? 'of the steel' : 'by the encoders';
    const what = `${micrometres(band.amplitude_um)} at ${band.frequency_Hz.toFixed(0)} Hz, ${source}`;
    return times >= 1 ? `a hand notices ${what}: ${Number(times.toPrecision(2))} × the threshold`
      : `no hand notices the strongest, ${what}: ${Number(times.toPrecision(2))} × the threshold`;
  }

  range() {
    const all = [...this.points.map(([, um]) => um), ...this.bands.map((band) => band.amplitude_um)].filter((um) => um >= LEAST_UM);
    return [Math.max(Math.log10(LEAST_UM), Math.floor(Math.log10(Math.min(...all)) - 0.3)),
      Math.ceil(Math.log10(Math.min(MOST_UM, Math.max(...all))) + 0.1)];
  }

  draw() {
    const c = this.context, { clientWidth: width, clientHeight: height } = this.canvas;
    if (!c || !width || this.section.hidden) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [low, high] = this.range(), from = Math.log10(10 / EDGE), to = Math.log10(400 * EDGE);
    const x = (Hz) => LEFT + ((Math.log10(Hz) - from) / (to - from)) * (width - LEFT - RIGHT);
    const y = (um) => height - BOTTOM - ((Math.log10(Math.max(um, 10 ** low)) - low) / (high - low)) * (height - TOP - BOTTOM);
    this.axes(width, height, low, high, x, y);
    for (const { centre_Hz, amplitude_um, threshold_um } of this.bands) {
      const left = x(centre_Hz / EDGE) + 1, right = x(centre_Hz * EDGE) - 1;
      c.fillStyle = colour(threshold_um !== null && amplitude_um >= threshold_um ? '--slip' : '--soft');
      c.fillRect(left, y(amplitude_um), right - left, y(10 ** low) - y(amplitude_um));
    }
    c.strokeStyle = colour('--line-wanted');
    c.setLineDash(dash('wanted'));
    c.lineWidth = 2;
    c.beginPath();
    this.points.forEach(([Hz, um], i) => (i ? c.lineTo(x(Hz), y(um)) : c.moveTo(x(Hz), y(um))));
    c.stroke();
    c.setLineDash([]);
  }

  axes(width, height, low, high, x, y) {
    const c = this.context;
    c.clearRect(0, 0, width, height);
    c.font = FONT;
    c.fillStyle = colour('--soft');
    c.strokeStyle = colour('--line');
    c.lineWidth = 1;
    c.textBaseline = 'middle';
    c.textAlign = 'right';
    const every = Math.ceil((high - low) / 5);
    for (let decade = low; decade <= high; ++decade) {
      const at = Math.round(y(10 ** decade)) + 0.5;
      c.beginPath();
      c.moveTo(LEFT, at);
      c.lineTo(width - RIGHT, at);
      c.stroke();
      if ((decade - low) % every === 0) c.fillText(decade >= 3 ? `${10 ** (decade - 3)} mm` : `${Number((10 ** decade).toPrecision(1))}`, LEFT - 3, Math.max(TOP + 2, at));
    }
    c.textAlign = 'center';
    for (const Hz of TICKS_HZ) c.fillText(Hz === 400 ? '400 Hz' : String(Hz), Math.min(x(Hz), width - 18), height - 7);
    c.textAlign = 'left';
    c.fillText('µm, by frequency', 2, 8);
    c.strokeStyle = colour('--line-wanted');
    c.setLineDash(dash('wanted'));
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(width - 132, 8);
    c.lineTo(width - 112, 8);
    c.stroke();
    c.setLineDash([]);
    c.fillText('what a hand notices', width - 107, 8);
  }
}
