import { byId, element, icon, setText } from "../dom.js";
import { fixed, significant } from "../format.js";

/** Ends of the rate slider [times real time]; the last position means as fast as possible. */
const SLOWEST = 0.05;
const FASTEST = 50;
const POSITIONS = 100;
/** Factors that have a position of their own. */
const EXACT = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
/** Time after an input during which the slider ignores the state of the world [ms]. */
const SETTLE_TIME = 1500;
const SEND_PERIOD = 120;

/**
 * Returns the factor of real time at a position of the slider.
 *
 * @param {number} position
 */
export function factorOf(position) {
  const exact = EXACT.find((factor) => positionOf(factor) === position);
  return exact ?? SLOWEST * (FASTEST / SLOWEST) ** (position / (POSITIONS - 1));
}

/**
 * Returns the position of the slider for a factor of real time.
 *
 * @param {number} factor
 */
export function positionOf(factor) {
  const share = Math.log(factor / SLOWEST) / Math.log(FASTEST / SLOWEST);
  return Math.max(0, Math.min(POSITIONS - 1, Math.round(share * (POSITIONS - 1))));
}

/** The bar of the simulated time: pause, single step, rate. */
export class TimeBar {
  /** @param {import("../session.js").Session} session */
  constructor(session) {
    this.session = session;
    this.pauseButton = byId("pause");
    this.stepButton = byId("step", HTMLButtonElement);
    this.slider = byId("rate", HTMLInputElement);
    this.touched = -Infinity;
    /** @type {number | undefined} */
    this.timer = undefined;
    this.pauseButton.addEventListener("click", () => this.togglePause());
    this.stepButton.addEventListener("click", () => this.step());
    this.slider.addEventListener("input", () => this.setRate());
    session.on("status", (world) => {
      if (world === this.statusWorld) this.update();
    });
    session.on("current", () => this.update());
    session.on("hello", () => this.update());
    session.on("world", () => this.update());
    this.update();
  }

  /** The world whose time and rate are shown: the displayed world, or the first one of the grid. */
  get statusWorld() {
    return this.session.world ?? this.session.worlds.values().next().value ?? null;
  }

  /** Pauses or resumes the displayed world, or all worlds of the grid. */
  togglePause() {
    const type = this.statusWorld?.status?.paused ? "resume" : "pause";
    this.forEachWorld(type, {});
  }

  step() {
    this.forEachWorld("step", { n: 1 });
  }

  /**
   * @template {"pause" | "resume" | "step" | "set_rate"} Type
   * @param {Type} type
   * @param {import("../protocol.js").Requests[Type]["fields"]} fields
   */
  forEachWorld(type, fields) {
    const { session } = this;
    if (session.readOnly) return;
    const worlds = session.world ? [session.world] : [...session.worlds.values()];
    for (const world of worlds) session.attempt(type, { world: world.index, ...fields });
  }

  /** Sends the rate of the slider, at most once per period. */
  setRate() {
    this.touched = performance.now();
    this.showRate(this.rate());
    if (this.timer !== undefined) return;
    this.timer = window.setTimeout(() => {
      this.timer = undefined;
      this.touched = performance.now();
      this.forEachWorld("set_rate", { rate: this.rate() });
    }, SEND_PERIOD);
  }

  /** Rate of the slider [Hz], 0 for as fast as possible. */
  rate() {
    const position = Number(this.slider.value);
    if (position >= POSITIONS) return 0;
    return Number((factorOf(position) / (this.statusWorld?.stepSize || 0.005)).toPrecision(3));
  }

  /** @param {number | null} rate  [Hz], 0: no limit, null: a program steps the world */
  showRate(rate) {
    let text = "–";
    if (rate === 0) text = "as fast as possible";
    else if (rate === null) text = "set by a program";
    else if (this.statusWorld?.stepSize) {
      text = `${significant(rate, 3)} Hz (${significant(rate * this.statusWorld.stepSize, 3)}×)`;
    }
    setText(byId("rate-text"), text);
    this.slider.setAttribute("aria-valuetext", text);
  }

  update() {
    const world = this.statusWorld;
    const status = world?.status ?? null;
    const isPaused = status?.paused ?? false;
    setText(byId("time"), status ? `${fixed(status.time, 2)} s` : "–");
    const factor = status?.real_time_factor;
    const isKnown = factor !== null && factor !== undefined;
    setText(byId("rtf"), isPaused ? "paused" : isKnown ? `${fixed(factor, 2)}×` : "–");
    const label = isPaused ? "Resume" : "Pause";
    if (this.pauseButton.dataset.action !== label) {
      this.pauseButton.dataset.action = label;
      this.pauseButton.title = `${label} (Space)`;
      this.pauseButton.setAttribute("aria-label", label);
      const text = element("span", { class: "text" }, label);
      this.pauseButton.replaceChildren(icon(isPaused ? "play" : "pause"), text);
    }
    const rate = status?.rate;
    this.slider.disabled = rate === null || rate === undefined;
    if (rate === undefined || performance.now() - this.touched < SETTLE_TIME) return;
    if (rate !== null && world?.stepSize) {
      this.slider.value = String(rate === 0 ? POSITIONS : positionOf(rate * world.stepSize));
    }
    this.showRate(rate);
  }
}
