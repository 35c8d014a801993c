import { Emitter } from "../events.js";
import { errorText } from "../session.js";

/** Time between two commands while a robot is driven [ms]. */
const COMMAND_PERIOD = 50;

/** Directions of keys: forward, left, turn to the left. Keys are values of `KeyboardEvent.code`. */
const KEYS = new Map([
  ["ArrowUp", [1, 0, 0]],
  ["ArrowDown", [-1, 0, 0]],
  ["ArrowLeft", [0, 0, 1]],
  ["ArrowRight", [0, 0, -1]],
  ["KeyW", [1, 0, 0]],
  ["KeyS", [-1, 0, 0]],
  ["KeyA", [0, 0, 1]],
  ["KeyD", [0, 0, -1]],
  ["KeyQ", [0, 1, 0]],
  ["KeyE", [0, -1, 0]],
]);

/**
 * Drives the selected robot while keys or the stick are held. The robot stops on release, and when
 * the page loses the focus, is hidden, or another model is selected.
 *
 * @extends {Emitter<{active: boolean}>}
 */
export class Drive extends Emitter {
  /** @param {import("../session.js").Session} session */
  constructor(session) {
    super();
    this.session = session;
    /** Largest speeds [m/s, rad/s]. */
    this.limits = { speed: 0.8, turn: 1 };
    /** @type {Set<string>} */
    this.keys = new Set();
    /** Deflection of the stick: forward, to the left; each in [-1, 1]. */
    this.stick = [0, 0];
    /** @type {import("../world_state.js").Model | null} */
    this.model = null;
    /** @type {number | undefined} */
    this.timer = undefined;
    window.addEventListener("blur", () => this.stop());
    document.addEventListener("visibilitychange", () => this.stop());
    document.addEventListener("keyup", (event) => this.release(event.code));
    document.addEventListener("focusin", () => this.stop());
    session.on("selection", () => {
      if (session.selected?.id !== this.model?.id) this.stop();
    });
    session.connection.on("state", () => this.stop());
  }

  /** Whether the selected model can be driven. */
  get isPossible() {
    const { selected, readOnly } = this.session;
    return !readOnly && selected !== null && selected.commands.length > 0;
  }

  /**
   * Starts to drive by a key.
   *
   * @param {string} code  of a keyboard event
   * @returns {boolean} whether the key drives
   */
  press(code) {
    if (!this.isPossible || !KEYS.has(code)) return false;
    if (!this.keys.has(code)) {
      this.keys.add(code);
      this.update();
    }
    return true;
  }

  /** @param {string} code */
  release(code) {
    if (this.keys.delete(code)) this.update();
  }

  /**
   * @param {number} forward  in [-1, 1]
   * @param {number} left  in [-1, 1]
   */
  deflect(forward, left) {
    this.stick = [forward, left];
    this.update();
  }

  /** Releases all keys and the stick. */
  stop() {
    this.keys.clear();
    this.stick = [0, 0];
    this.update();
  }

  /** Returns the velocity that the keys and the stick request: forward, left, turn. */
  velocity() {
    const sum = [this.stick[0], 0, this.stick[1]];
    for (const key of this.keys) {
      for (const [i, part] of (KEYS.get(key) ?? []).entries()) sum[i] += part;
    }
    const [forward, left, turn] = sum.map((part) => Math.max(-1, Math.min(1, part)));
    return [forward * this.limits.speed, left * this.limits.speed, turn * this.limits.turn];
  }

  update() {
    const isActive = this.keys.size > 0 || this.stick.some((part) => part !== 0);
    if (isActive && !this.model && this.isPossible) {
      this.model = this.session.selected;
      this.timer = window.setInterval(() => this.send(), COMMAND_PERIOD);
      this.emit("active", true);
    }
    if (isActive) this.send();
    else if (this.model) {
      window.clearInterval(this.timer);
      this.command(this.model, [0, 0, 0]);
      this.model = null;
      this.emit("active", false);
    }
  }

  send() {
    if (this.model) this.command(this.model, this.velocity());
  }

  /**
   * @param {import("../world_state.js").Model} model
   * @param {number[]} velocity
   */
  async command(model, [vx, vy, angular]) {
    try {
      const { id, commands } = model;
      await this.session.request("drive", { model: id, command: commands[0], linear: [vx, vy], angular });
    } catch (error) {
      if (this.model !== model) return;
      this.session.notify("error", errorText(error));
      this.stop();
    }
  }
}
