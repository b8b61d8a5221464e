// Plays a record. Draws a time line of the whole session with its events and the present place.
import { colour, onTheme } from './theme.js';

const element = (id) => document.getElementById(id);
const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
const PLOT_WINDOW_S = 6;
const SPECTRUM_MS = 250;  // how often the handle's vibration is requested while playing
const FRAMES_AFTER_MS = 120;  // after this time at a place, the frames of the buses are requested

function button(label, title, action) {
  const made = document.createElement('button');
  Object.assign(made, { textContent: label, title });
  made.addEventListener('click', action);
  return made;
}

export class Player {
  constructor(stage, connection, plots, keys) {
    this.record = stage.record;
    this.connection = connection;
    this.plots = plots;
    this.at = this.record.open_at;
    this.overview = [];
    this.playing = false;
    this.perSecond = (this.record.cycles - 1) / Math.max(1e-9, this.record.to_s - this.record.from_s);
    this.build();
    plots.leaveOutLive();
    this.addKeys(keys);
    element('frames').hidden = false;
    this.goTo(this.at);
    onTheme(() => { this.stale = true; });
  }

  build() {
    this.playButton = button('▶ play', 'play or pause (space)', () => this.toggle());
    this.speed = document.createElement('select');
    this.speed.setAttribute('aria-label', 'speed');
    for (const speed of SPEEDS) this.speed.add(new Option(`× ${speed}`, speed, speed === 1, speed === 1));
    this.place = document.createElement('output');
    const track = document.createElement('div');
    track.className = 'track';
    this.canvas = document.createElement('canvas');
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'slider');
    this.canvas.setAttribute('aria-label', 'place in the record');
    track.append(this.canvas);
    this.story = document.createElement('span');
    this.story.className = 'story';
    element('player').hidden = false;
    element('player').append(
      this.playButton, this.speed,
      button('−1', 'a cycle back (,)', () => this.step(-1)), button('+1', 'a cycle on (.)', () => this.step(1)),
      button('⟨ event', 'to what happened before (p)', () => this.jump(-1)),
      button('event ⟩', 'to what happens next (n)', () => this.jump(1)),
      button('contact', 'to the next contact (c)', () => this.jump(1, 'contact')),
      button('limit', 'to the next limit that acts (l)', () => this.jump(1, 'limit')),
      button('fault', 'to the fault (x)', () => this.jump(0, 'fault')),
      track, this.place, this.story);
    this.canvas.addEventListener('pointerdown', (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.scrub(event);
    });
    this.canvas.addEventListener('pointermove', (event) => { if (event.buttons) this.scrub(event); });
    new ResizeObserver(() => { this.stale = true; }).observe(track);
  }

  addKeys(keys) {
    keys.add(' ', 'play or pause', () => this.toggle(), 'space');
    keys.add(',', 'a cycle back', () => this.step(-1));
    keys.add('.', 'a cycle on', () => this.step(1));
    keys.add('ArrowLeft', '0.1 s back', () => this.step(-Math.round(0.1 * this.perSecond)), '←');
    keys.add('ArrowRight', '0.1 s on', () => this.step(Math.round(0.1 * this.perSecond)), '→');
    keys.add('p', 'to what happened before', () => this.jump(-1));
    keys.add('n', 'to what happens next', () => this.jump(1));
    keys.add('c', 'to the next contact', () => this.jump(1, 'contact'));
    keys.add('l', 'to the next limit that acts', () => this.jump(1, 'limit'));
    keys.add('x', 'to the fault', () => this.jump(0, 'fault'));
    keys.add('Home', 'to the beginning', () => this.goTo(0));
    keys.add('End', 'to the end', () => this.goTo(this.record.cycles - 1));
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.at >= this.record.cycles - 1) this.at = 0;
    this.playButton.textContent = this.playing ? '❚❚ pause' : '▶ play';
    this.since = performance.now();
  }

  step(cycles) {
    if (this.playing) this.toggle();
    this.goTo(this.at + cycles);
  }

  jump(direction, kind) {
    const events = this.record.events.filter((event) => !kind || event.kind === kind);
    const now = Math.round(this.at);
    const found = direction < 0 ? events.filter((event) => event.at < now).pop()
      : direction > 0 ? events.find((event) => event.at > now) ?? events[0] : events[0];
    if (!found) return;
    if (this.playing) this.toggle();
    this.goTo(found.at);
  }

  scrub(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    if (this.playing) this.toggle();
    this.goTo(share * (this.record.cycles - 1));
  }

  goTo(at) {
    this.at = Math.min(this.record.cycles - 1, Math.max(0, at));
    this.moved = performance.now();
    this.stale = true;
  }

  // Called once per frame of the browser.
  tick(now) {
    if (this.playing) {
      const seconds = Math.min(0.2, (now - this.since) / 1e3);
      this.since = now;
      this.goTo(this.at + seconds * this.perSecond * Number(this.speed.value));
      if (this.at >= this.record.cycles - 1) this.toggle();
    }
    const index = Math.round(this.at);
    if (index !== this.asked) {
      this.asked = index;
      this.connection.want({ at: index });
      this.wantWindow(index);
    }
    if (index !== this.listed && now - this.moved > FRAMES_AFTER_MS) {
      this.listed = index;
      this.connection.want({ frames: index });
    }
    if (index !== this.heard && (now - this.heardAt > SPECTRUM_MS || this.heardAt === undefined)) {
      this.heard = index;
      this.heardAt = now;
      this.connection.want({ spectrum: index });
    }
    if (this.stale) this.draw();
  }

  // Requests the window of rows for the plots, some seconds around the place. It is requested again when the place
  // comes near an end of the window.
  wantWindow(index) {
    const half = Math.round((PLOT_WINDOW_S / 2) * this.perSecond);
    if (this.window && index - this.window[0] > half / 3 && this.window[1] - index > half / 3) return;
    this.window = [Math.max(0, index - half), Math.min(this.record.cycles - 1, index + half)];
    if (this.window[0] === 0) this.window[1] = Math.min(this.record.cycles - 1, 2 * half);
    if (this.lastWindow === this.window.join()) return;
    this.lastWindow = this.window.join();
    this.connection.want({ window: this.window });
  }

  // Returns whether picture, plots and frames all show this cycle.
  isShown(index) {
    return this.asked === index && this.shown === index && this.listed === index && this.framesOf === index &&
      Boolean(this.plots.window) && performance.now() - this.moved > 400;
  }

  // Takes rows. The first rows are the whole record, thinned out; later rows are a requested window.
  takeHistory(rows) {
    if (!this.overview.length) {
      this.overview = rows;
      this.stale = true;
    } else if (rows.length) {
      this.plots.setWindow(rows, rows[0].time_s, rows[rows.length - 1].time_s, this.time);
    }
  }

  show(moment) {
    this.shown = this.asked;
    this.time = moment.time_s;
    this.place.textContent = `cycle ${moment.cycle}`;
    this.plots.setPlayhead(moment.time_s);
    const past = this.record.events.filter((event) => event.at <= this.at + 0.5).pop();
    const text = past ? `${past.time_s.toFixed(3)} s: ${past.text}` : '';
    if (this.story.textContent !== text) this.story.textContent = text;
  }

  showFrames({ at, list }) {
    this.framesOf = at;
    const body = element('frame-table').tBodies[0];
    body.replaceChildren(...list.map((frame) => {
      const row = document.createElement('tr');
      const whose = row.insertCell(), what = row.insertCell();
      whose.textContent = frame.from || frame.bus;
      whose.title = `${frame.bus} ${frame.id}`;
      const words = document.createElement('div'), bytes = document.createElement('code');
      words.textContent = frame.words;
      bytes.textContent = `${frame.id}  ${frame.bytes}`;
      what.append(words, bytes);
      return row;
    }));
    if (!list.length) body.insertRow().insertCell().textContent = 'none in the record';
  }

  draw() {
    this.stale = false;
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = Math.min(2, devicePixelRatio || 1), c = this.canvas.getContext('2d');
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    const x = (index) => 4 + (index / Math.max(1, this.record.cycles - 1)) * (width - 8);
    const middle = height / 2;
    c.fillStyle = colour('--line');
    c.fillRect(4, middle - 4, width - 8, 8);
    this.drawContacts(c, x, middle);
    const marks = { limit: ['--slip', 3], phase: ['--soft', 5], fault: ['--bad', 12] };
    for (const event of this.record.events) {
      const mark = marks[event.kind];
      if (!mark) continue;
      c.fillStyle = colour(mark[0]);
      c.fillRect(x(event.at) - 1, middle - 4 - mark[1], event.kind === 'fault' ? 3 : 1.5, 8 + 2 * mark[1]);
    }
    c.fillStyle = colour('--ink');
    c.beginPath();
    c.arc(x(this.at), middle, 7, 0, 2 * Math.PI);
    c.fill();
    this.canvas.setAttribute('aria-valuenow', Math.round(this.at));
    this.canvas.setAttribute('aria-valuemax', this.record.cycles - 1);
  }

  drawContacts(c, x, middle) {
    const rows = this.overview;
    for (let i = 0; i + 1 < rows.length; ++i) {
      if (rows[i].contact === 0) continue;
      const share = (row) => ((row.time_s - this.record.from_s) / Math.max(1e-9, this.record.to_s - this.record.from_s)) *
        (this.record.cycles - 1);
      c.fillStyle = colour(rows[i].contact === 2 ? '--slip' : '--stick');
      const from = x(share(rows[i]));
      c.fillRect(from, middle - (rows[i].contact === 2 ? 4 : 2), Math.max(1, x(share(rows[i + 1])) - from),
        rows[i].contact === 2 ? 8 : 4);
    }
  }
}
