// Controls of a running session, if it was started with --view-control. They send lines as `proxarm set` and `proxarm
// hold` do, and show the session's answer beside the control.

const element = (id) => document.getElementById(id);

// For each order: label, meaning, line, the phases in which it is possible, and the reason why it isn't possible in
// other phases. (CycleStatus::refusal decides; it also knows lasting causes and the enabling input.)
const ORDERS = [
  ['hold', 'stop the arm, its drives enabled', 'hold', ['rendering', 'freeing'], 'the arm isn’t moving'],
  ['resume', 'go on out of a hold', 'resume', ['holding'], 'the arm isn’t in a hold'],
  ['release', 'out of a hold: let the arm follow the hand slowly', 'release', ['holding'], 'the arm isn’t in a hold'],
  ['back off 20 mm', 'out of a hold: away from what was touched last', 'back-off 20mm', ['holding'], 'the arm isn’t in a hold'],
  ['reset', 'after a fault: enable the drives again, into a hold', 'reset', ['faulted'], 'no stop by a fault waits for it'],
];

const number = (value) => String(Number(value.toPrecision(9)));

// Returns the parameters that can be set. `of` returns the present value from the session's settings. `log`: the slider
// is logarithmic, so that each step is the same share of the value.
function parametersOf(stage) {
  const all = [
    { name: 'mass', label: 'mass felt', unit: 'kg', low: 0.5, high: 50, log: true, of: (s) => number(s.mass_kg) },
    { name: 'damping', label: 'damping', unit: 'Ns/m', low: 0, high: 100, of: (s) => number(s.damping_Ns_per_m) },
    { name: 'spring', label: 'spring to the start', unit: 'N/m', low: 0, high: 1000, of: (s) => number(s.spring_N_per_m) },
    { name: 'timestep', label: 'timestep', unit: 'ms', low: 1, high: 4, step: 1, of: (s) => number(1e3 * s.period_s) },
  ];
  stage.scene.objects.forEach((object, i) => {
    if (object.friction_can_change) {
      all.push({ name: `${object.name}.friction`, label: `friction of ${object.name}`, unit: '', low: 0, high: 1.5,
                 of: (s) => number(s.friction[i]) });
    }
    if (object.driven) {
      all.push({ name: `${object.name}.position_m`, label: `place of ${object.name}, x,y,z`, unit: 'm', vector: true,
                 of: (s) => s.position_m[i].map(number).join() });
    }
  });
  return all;
}

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
const BEFORE_UNIT = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s+([^\d\s.,+-]\S*)$/i;

// Returns the value to send. A number alone gets the field's unit. Anything else is sent as typed, and the session
// judges it.
function valueOf(parameter, typed) {
  if (parameter.vector) return typed.replace(/\s*,\s*/g, ',');
  return NUMBER.test(typed) ? typed + parameter.unit : typed.replace(BEFORE_UNIT, '$1$2');
}

const OVER = 'refused: the session is over';

const SETTLED_MS = 3000;  // after a change was taken, the field shows the session's own value only after this time

const STEPS = 1000;
const toSlider = (p, value) =>
  (STEPS * (p.log ? Math.log(value / p.low) / Math.log(p.high / p.low) : (value - p.low) / (p.high - p.low)));
function fromSlider(p, at) {
  const share = at / STEPS;
  const value = p.log ? p.low * (p.high / p.low) ** share : p.low + share * (p.high - p.low);
  return p.step ? Math.round(value / p.step) * p.step : Number(value.toPrecision(3));
}

export class Control {
  constructor(stage, connection) {
    this.connection = connection;
    this.over = false;
    element('control').hidden = false;
    this.phases = stage.words.phases.map((phase) => phase.name);
    this.orders = ORDERS.map(([label, title, line]) => {
      const button = document.createElement('button');
      Object.assign(button, { textContent: label, title });
      button.dataset.line = line;
      button.addEventListener('click', () => this.ask(line));
      return button;
    });
    element('orders').replaceChildren(...this.orders);
    this.settings = stage.settings;
    this.fields = parametersOf(stage).map((parameter) => this.makeField(parameter));
    element('parameters').replaceChildren(...this.fields.map((field) => field.box));
  }

  // Takes the session's present settings, whoever changed them.
  follow(settings) {
    const before = this.settings;
    this.settings = settings;
    for (const { parameter, show } of this.fields) if (parameter.of(settings) !== parameter.of(before)) show();
  }

  // Disables the orders that aren't possible now. Shows the reasons below, each reason once with all orders that it
  // concerns.
  show({ phase }) {
    const now = this.phases[phase];
    if (this.over || now === this.phase) return;
    this.phase = now;
    const reasons = new Map();
    ORDERS.forEach(([label, title, , phases, reason], i) => {
      const possible = phases.includes(now);
      this.orders[i].disabled = !possible;
      this.orders[i].title = possible ? title : `${title}; not now: ${reason}`;
      if (!possible) reasons.set(reason, [...(reasons.get(reason) ?? []), label]);
    });
    element('not-now').textContent = [...reasons].map(([reason, labels]) => `${labels.join(', ')}: ${reason}`).join('; ');
  }

  // Disables everything, since nothing can be changed after the session.
  end() {
    this.over = true;
    element('not-now').textContent = '';
    element('control-over').hidden = false;
    for (const input of element('control').querySelectorAll('button, input')) input.disabled = true;
  }

  // Sends a line. The answer goes to the output `beside`; a refusal is scrolled into view. Returns whether the line was
  // accepted.
  async ask(line, beside = element('answer')) {
    const answer = this.over ? OVER : await this.connection.ask(line);
    const refused = !answer.startsWith('ok: ');
    beside.dataset.refused = String(refused);
    beside.textContent = answer;
    if (refused) beside.scrollIntoView({ block: 'nearest' });
    return !refused;
  }

  // Makes a field with its slider. show() sets both to the present value, except while the user is changing it.
  makeField(parameter) {
    const box = document.createElement('div'), row = document.createElement('div');
    box.className = 'parameter';
    const label = document.createElement('label'), field = document.createElement('input');
    const slider = parameter.vector ? null : document.createElement('input');
    const answer = document.createElement('output');
    answer.className = 'answer';
    answer.id = `answer-${parameter.name}`;
    field.type = 'text';
    field.id = `set-${parameter.name}`;
    field.setAttribute('aria-describedby', answer.id);
    field.inputMode = 'decimal';
    label.htmlFor = field.id;
    label.textContent = parameter.label;
    const unit = document.createElement('span');
    unit.textContent = parameter.unit;
    label.append(unit);
    let changing = false, sending = false;
    const show = () => {
      if (changing) return;
      field.value = parameter.of(this.settings);
      if (slider) slider.value = String(toSlider(parameter, Number(field.value)));
    };
    const send = async () => {
      sending = true;
      const taken = await this.ask(`${parameter.name}=${valueOf(parameter, field.value.trim())}`, answer);
      changing = sending = false;
      field.setAttribute('aria-invalid', String(!taken));
      // An accepted value is in force from one of the next cycles on. After a refusal, the field goes back to the
      // present value, and the answer, which names the refused value, stays until the next change.
      const told = answer.textContent;
      if (!taken) return show();
      setTimeout(() => {
        if (answer.textContent === told) answer.textContent = '';
        show();
      }, SETTLED_MS);
    };
    const begin = () => {
      changing = true;
      answer.textContent = '';
      delete answer.dataset.refused;
      field.removeAttribute('aria-invalid');
    };
    field.addEventListener('input', begin);
    field.addEventListener('change', send);
    const leave = () => {
      if (sending) return;
      changing = false;
      show();
    };
    field.addEventListener('blur', leave);
    field.addEventListener('keydown', (event) => { if (event.key === 'Escape') leave(); });
    if (slider) {
      Object.assign(slider, { type: 'range', min: '0', max: String(STEPS) });
      slider.setAttribute('aria-label', parameter.label);
      slider.addEventListener('input', () => {
        begin();
        field.value = String(fromSlider(parameter, Number(slider.value)));
      });
      slider.addEventListener('change', send);
      row.append(slider);
    }
    row.append(field);
    box.append(label, row, answer);
    show();
    return { parameter, box, show };
  }
}
