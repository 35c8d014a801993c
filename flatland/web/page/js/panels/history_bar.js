import { byId, setText } from "../dom.js";
import { fixed } from "../format.js";

/**
 * The slider of the recent states of the world. The last position is the newest state.
 *
 * The world is paused while the user looks at an earlier state. One request is under way at a time;
 * of the positions that the slider takes meanwhile, only the last one is requested.
 */
export class HistoryBar {
  /** @param {import("../session.js").Session} session */
  constructor(session) {
    this.session = session;
    this.bar = byId("history");
    this.slider = byId("history-slider", HTMLInputElement);
    this.text = byId("history-text");
    this.continueButton = byId("history-continue", HTMLButtonElement);
    this.newestButton = byId("history-newest", HTMLButtonElement);
    /** Number of the moment to visit, null for the newest state, undefined for none.
     * @type {number | null | undefined} */
    this.wanted = undefined;
    /** The request under way: it ends with its reply and a new history, in any order.
     * @type {{before: import("../protocol.js").HistoryMessage, replied: boolean} | null} */
    this.request = null;
    this.slider.addEventListener("input", () => this.want(this.momentAt(Number(this.slider.value))));
    this.newestButton.addEventListener("click", () => this.want(null));
    this.continueButton.addEventListener("click", () => void session.attempt("resume", {}));
    for (const button of [this.newestButton, this.continueButton]) {
      // The button disappears; on the slider, the arrow keys would not drive the robot.
      button.addEventListener("click", () => byId("canvas").focus());
    }
    session.on("history", (world) => {
      if (world === session.world) this.proceed();
    });
    session.on("current", () => this.forget());
    session.on("hello", () => this.forget());
    this.update();
  }

  get history() {
    return this.session.world?.history ?? null;
  }

  /** The moments before the newest state. */
  get earlier() {
    const { history } = this;
    if (!history) return [];
    return history.current === null ? history.moments : history.moments.slice(0, -1);
  }

  /**
   * Returns the number of the moment at a position of the slider, null for the newest state.
   *
   * @param {number} position
   */
  momentAt(position) {
    return this.earlier[position]?.moment ?? null;
  }

  /** @param {number | null} moment  null for the newest state */
  want(moment) {
    if (this.session.readOnly) return;
    this.wanted = moment;
    this.show(moment);
    this.proceed();
  }

  forget() {
    this.wanted = undefined;
    this.request = null;
    this.update();
  }

  /** Ends the request if it is complete, and starts the next one. */
  proceed() {
    const { history, request, wanted } = this;
    if (request?.replied && history !== request.before) this.request = null;
    // Positions that wait during a lost connection are dropped with the next one.
    if (history && this.session.ready && !this.request && wanted !== undefined) {
      this.wanted = undefined;
      // While an earlier state is shown, the last moment is the newest state.
      const newest = history.current === null ? null : (history.moments.at(-1)?.moment ?? null);
      const number = wanted ?? newest;
      if (number !== null && number !== history.current) void this.visit(number, history);
    }
    this.update();
  }

  /**
   * @param {number} moment  number of the moment
   * @param {import("../protocol.js").HistoryMessage} before
   */
  async visit(moment, before) {
    const request = { before, replied: false };
    this.request = request;
    const reply = await this.session.attempt("visit", { moment });
    request.replied = true;
    if (this.request !== request) return;
    if (reply) {
      this.session.emit("outdated", undefined);
      this.session.notifySetBack(reply.result.effect);
    }
    // After an error, or if another client visits a state instead, no history may follow.
    if (!reply || reply.result.superseded) this.request = null;
    this.proceed();
  }

  /** @param {number | null} moment  number of the moment, null for the newest state */
  show(moment) {
    const { earlier } = this;
    const index = earlier.findIndex((each) => each.moment === moment);
    const { time, label } = earlier[index] ?? { time: 0, label: "" };
    const text = index < 0 ? "newest" : `${fixed(time, 2)} s${label ? `, ${label}` : ""}`;
    this.slider.max = String(earlier.length);
    this.slider.value = String(index < 0 ? earlier.length : index);
    this.slider.setAttribute("aria-valuetext", index < 0 ? "newest state" : text);
    setText(this.text, text);
    this.text.title = text;
  }

  update() {
    const { history } = this;
    const isVisiting = (history?.current ?? null) !== null;
    this.bar.toggleAttribute("hidden", this.session.readOnly || !this.session.world);
    this.continueButton.disabled = this.newestButton.disabled = !isVisiting;
    this.slider.disabled = this.earlier.length === 0;
    this.slider.title = history?.obstacle || "Earlier states of the world";
    if (!this.request && this.wanted === undefined) this.show(history?.current ?? null);
  }
}
