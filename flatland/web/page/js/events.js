/**
 * Events with typed payloads.
 *
 * @template {Record<string, any>} Events
 */
export class Emitter {
  constructor() {
    /** @type {Map<keyof Events, Set<(payload: any) => void>>} */
    this.listeners = new Map();
  }

  /**
   * Calls a listener at each event of a name.
   *
   * @template {keyof Events} Name
   * @param {Name} name
   * @param {(payload: Events[Name]) => void} listener
   * @returns {() => void} removes the listener
   */
  on(name, listener) {
    let group = this.listeners.get(name);
    if (!group) this.listeners.set(name, (group = new Set()));
    group.add(listener);
    return () => group.delete(listener);
  }

  /**
   * Calls all listeners of an event, in the order of their registration.
   *
   * @template {keyof Events} Name
   * @param {Name} name
   * @param {Events[Name]} payload
   */
  emit(name, payload) {
    for (const listener of [...(this.listeners.get(name) ?? [])]) listener(payload);
  }
}
