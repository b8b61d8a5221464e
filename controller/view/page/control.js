// Changes to a running session, where it was started with --view-control: lines as `proxarm set` and `proxarm hold` send
// them, and the session's own answers.

const element = (id) => document.getElementById(id);

const ORDERS = [
  ['hold', 'stop the arm, its drives enabled', 'hold'],
  ['resume', 'go on out of a hold', 'resume'],
  ['release', 'out of a hold: let the arm follow the hand slowly', 'release'],
  ['back off 20 mm', 'out of a hold: away from what was touched last', 'back-off 20mm'],
  ['reset', 'after a fault: enable the drives again, into a hold', 'reset'],
];

// Sliders of masses and stiffnesses are logarithmic: a step is a share.
function parametersOf(stage) {
  const { settings } = stage;
  const all = [
    { name: 'mass', label: 'mass felt', unit: 'kg', low: 0.5, high: 50, log: true, value: settings.mass_kg },
    { name: 'damping', label: 'damping', unit: 'Ns/m', low: 0, high: 100, value: settings.damping_Ns_per_m },
    { name: 'spring', label: 'spring to the start', unit: 'N/m', low: 0, high: 1000, value: settings.spring_N_per_m },
    { name: 'timestep', label: 'timestep', unit: 'ms', low: 1, high: 4, step: 1, value: 1e3 * settings.period_s },
  ];
  for (const object of stage.scene.objects) {
    if (object.friction_can_change) {
      all.push({ name: `${object.name}.friction`, label: `friction of ${object.name}`, unit: '', low: 0, high: 1.5,
                 value: object.friction });
    }
    if (object.driven) {
      all.push({ name: `${object.name}.position_m`, label: `place of ${object.name}, x,y,z`, unit: 'm', text: '0,0,0' });
    }
  }
  return all;
}

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
    element('control').hidden = false;
    element('orders').replaceChildren(...ORDERS.map(([label, title, line]) => {
      const button = document.createElement('button');
      Object.assign(button, { textContent: label, title });
      button.dataset.line = line;
      button.addEventListener('click', () => this.ask(line));
      return button;
    }));
    element('parameters').replaceChildren(...parametersOf(stage).map((parameter) => this.makeParameter(parameter)));
  }

  async ask(line) {
    const answer = await this.connection.ask(line);
    const refused = !answer.startsWith('ok: ');
    element('answer').dataset.refused = String(refused);
    element('answer').textContent = answer;
    return !refused;
  }

  // A field with its slider. What is refused goes back to what is.
  makeParameter(parameter) {
    const box = document.createElement('div'), row = document.createElement('div');
    box.className = 'parameter';
    const label = document.createElement('label'), field = document.createElement('input');
    const slider = parameter.text === undefined ? document.createElement('input') : null;
    field.type = 'text';
    field.id = `set-${parameter.name}`;
    field.inputMode = 'decimal';
    field.value = parameter.text ?? String(parameter.value);
    label.htmlFor = field.id;
    label.textContent = parameter.label;
    const unit = document.createElement('span');
    unit.textContent = parameter.unit;
    label.append(unit);
    let present = field.value;
    const send = async () => {
      const wanted = field.value.trim();
      if (wanted === present) return;
      if (await this.ask(`${parameter.name}=${wanted}${parameter.text === undefined ? parameter.unit : ''}`)) {
        present = wanted;
      }
      field.value = present;
      if (slider) slider.value = String(toSlider(parameter, Number(present)));
    };
    field.addEventListener('change', send);
    if (slider) {
      Object.assign(slider, { type: 'range', min: '0', max: String(STEPS), value: String(toSlider(parameter, Number(present))) });
      slider.setAttribute('aria-label', parameter.label);
      slider.addEventListener('input', () => { field.value = String(fromSlider(parameter, Number(slider.value))); });
      slider.addEventListener('change', send);
      row.append(slider);
    }
    row.append(field);
    box.append(label, row);
    return box;
  }
}
