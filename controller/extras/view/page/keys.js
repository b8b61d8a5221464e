// The actions of keys, and the dialog that lists them.

// Whether the element with the focus takes this key itself. Where the user writes or chooses, it takes all keys; a
// button takes the keys that press it or move the focus.
function isOwnKey({ key, target }) {
  return /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) ||
    (target.tagName === 'BUTTON' && /^( |Enter|Arrow.*|Home|End)$/.test(key));
}

export class Keys {
  constructor() {
    this.actions = new Map();
    this.actionsOf = new Map();  // actions of elements, while they have the focus
    this.dialog = document.getElementById('help');
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || this.dialog.open || isOwnKey(event)) return;
      const action = this.actionsOf.get(event.target)?.get(event.key) ?? this.actions.get(event.key);
      if (!action) return;
      event.preventDefault();
      action(event);
    });
    // A clicked button loses the focus, so that the page's keys act again.
    addEventListener('click', (event) => { if (event.detail > 0) event.target.closest?.('button')?.blur(); });
    document.getElementById('help-button').addEventListener('click', () => this.dialog.showModal());
    this.add('?', 'this help', () => this.dialog.showModal());
  }

  add(key, text, action, shown = key) {
    this.actions.set(key, action);
    this.explain(text, shown);
  }

  // Adds an action that a key has only while this element has the focus. It goes before the page's action of this key.
  addFor(element, key, action) {
    if (!this.actionsOf.has(element)) this.actionsOf.set(element, new Map());
    this.actionsOf.get(element).set(key, action);
  }

  explain(text, shown) {
    if (!text) return;
    const term = document.createElement('dt'), what = document.createElement('dd');
    term.textContent = shown;
    what.textContent = text;
    document.getElementById('keys').append(term, what);
  }
}
