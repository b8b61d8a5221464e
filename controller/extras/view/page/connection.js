// The WebSocket to the process that serves this page.
//
// A text message is JSON with one key; the handler with the key's name gets its value. A binary message is a moment or
// a history. Its layout follows from the message "stage"; controller/stage/moment.hpp describes it.

const KIND_MOMENT = 1, KIND_HISTORY = 2;
const POSE_FLOATS = 7;

// The controller's phase of rendering. In the phases before it, there is no proxy yet, and the sensor isn't tared.
export const PHASE_RENDERING = 3;

export class Connection {
  constructor(handlers) {
    this.handlers = handlers;
    this.fields = [];
    this.contactFields = [];
    this.questions = new Map();
    this.lastId = 0;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/live`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => {
      for (const answered of this.questions.values()) answered('refused: the connection was lost');
      this.questions.clear();
      this.handlers.lost();
    };
  }

  // Sends a line for the session's control socket. Resolves to the session's answer, "ok: …" or "refused: …".
  ask(line) {
    const id = ++this.lastId;
    return new Promise((answered) => {
      if (this.socket.readyState !== WebSocket.OPEN) return answered('refused: the connection was lost');
      this.questions.set(id, answered);
      this.socket.send(JSON.stringify({ ask: line, id }));
    });
  }

  // Sends a request about a record, such as {at: CYCLE}.
  want(request) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  receive(data) {
    if (typeof data !== 'string') return this.receiveBinary(data);
    const [name, value] = Object.entries(JSON.parse(data))[0];
    if (name === 'answer') {
      const answered = this.questions.get(value.id);
      this.questions.delete(value.id);
      if (answered) answered(value.text);
      return;
    }
    if (name === 'stage') {
      this.fields = value.fields;
      this.contactFields = value.contact_fields;
      this.links = value.links.length;
      this.objects = value.scene.objects.length;
    }
    this.handlers[name]?.(value);
  }

  receiveBinary(buffer) {
    const head = new Float64Array(buffer, 0, 2);
    const width = this.fields.length;
    if (head[0] === KIND_MOMENT) {
      const contactsAt = 8 * (1 + width), count = new Float64Array(buffer, contactsAt, 1)[0];
      const posesAt = contactsAt + 8 * (1 + count * this.contactFields.length);
      this.handlers.moment({
        ...this.named(new Float64Array(buffer, 8, width), 0),
        touches: this.touches(new Float64Array(buffer, contactsAt + 8, count * this.contactFields.length), count),
        links: new Float32Array(buffer, posesAt, POSE_FLOATS * this.links),
        objects: new Float32Array(buffer, posesAt + 4 * POSE_FLOATS * this.links, POSE_FLOATS * this.objects),
      });
    } else if (head[0] === KIND_HISTORY) {
      const rows = new Float64Array(buffer, 16);
      this.handlers.history(Array.from({ length: head[1] }, (_, i) => this.named(rows, i * width)));
    }
  }

  named(numbers, from, fields = this.fields) {
    const moment = {};
    for (let i = 0; i < fields.length; ++i) moment[fields[i]] = numbers[from + i];
    return moment;
  }

  // Returns the recorded contacts.
  touches(numbers, count) {
    const fields = this.contactFields;
    return Array.from({ length: count }, (_, i) => this.named(numbers, i * fields.length, fields));
  }
}

// Returns a vector from its three fields: vector(moment, 'proxy').
export function vector(moment, name) {
  return [moment[`${name}_x`], moment[`${name}_y`], moment[`${name}_z`]];
}
