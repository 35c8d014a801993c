/**
 * Events with typed payloads.
 *
 * @template {object} Events
 */
export class Emitter {
  constructor() {
    /** @type {{[Name in keyof Events]?: Set<(payload: Events[Name]) => void>}} */
    this.listeners = {};
  }

  /**
   * Registers a listener for the events of a name.
   *
   * @template {keyof Events} Name
   * @param {Name} name
   * @param {(payload: Events[Name]) => void} listener
   */
  on(name, listener) {
    this.listeners[name] ??= new Set();
    this.listeners[name].add(listener);
  }

  /**
   * Calls all listeners of an event, in the order of their registration.
   *
   * @template {keyof Events} Name
   * @param {Name} name
   * @param {Events[Name]} payload
   */
  emit(name, payload) {
    for (const listener of [...(this.listeners[name] ?? [])]) listener(payload);
  }
}
