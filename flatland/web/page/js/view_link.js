import { DISPLAYS } from "./session.js";

/** Time without changes after which the address is updated [ms]. */
const DELAY = 300;

/**
 * Keeps the view in the hash of the address, so that a link shows the same view.
 *
 * `#world=1&x=2.5&y=-1&zoom=40&turn=0.2&follow=robot&select=robot&hide=names&show=trails`
 */
export class ViewLink {
  /**
   * @param {import("./session.js").Session} session
   * @param {import("./stage.js").Stage} stage
   */
  constructor(session, stage) {
    this.session = session;
    this.stage = stage;
    /** @type {number | undefined} */
    this.timer = undefined;
    /** The hash of the address when it was read or written last. */
    this.known = "";
    /** World of the address, as long as the server has not listed the world.
     * @type {number | null} */
    this.wantedWorld = null;
    this.defaults = { ...session.displays };
    this.read();
    window.addEventListener("hashchange", () => {
      if (window.location.hash !== this.known) this.read();
    });
    const schedule = () => this.schedule();
    stage.on("view", schedule);
    session.on("selection", schedule);
    session.on("displays", schedule);
    session.on("current", schedule);
    session.on("hello", () => this.showWantedWorld());
  }

  showWantedWorld() {
    const { session, wantedWorld } = this;
    if (wantedWorld === null || !session.worlds.has(wantedWorld)) return;
    this.wantedWorld = null;
    const selected = session.selectedName;
    session.show(wantedWorld);
    session.select(selected);
  }

  /** Applies the hash of the address. */
  read() {
    const { session, stage } = this;
    this.known = window.location.hash;
    const values = new URLSearchParams(this.known.slice(1));
    /** @type {(name: string) => number | null} */
    const number = (name) => {
      const text = values.get(name);
      const value = Number(text);
      return text !== null && text !== "" && Number.isFinite(value) ? value : null;
    };
    const [x, y, zoom] = [number("x"), number("y"), number("zoom")];
    if (x !== null && y !== null && zoom !== null && zoom > 0) {
      stage.moveView((camera) => {
        [camera.x, camera.y, camera.angle] = [x, y, number("turn") ?? 0];
        camera.zoom = zoom;
        camera.zoomAt(1, camera.width / 2, camera.height / 2);
      });
    } else stage.fit();
    stage.follow(values.get("follow"));
    for (const display of DISPLAYS) {
      const isShown = values.get("show")?.split(",").includes(display);
      const isHidden = values.get("hide")?.split(",").includes(display);
      const wanted = isShown ? true : isHidden ? false : this.defaults[display];
      if (wanted !== session.displays[display]) session.setDisplay(display, wanted);
    }
    this.wantedWorld = number("world");
    this.showWantedWorld();
    session.select(values.get("select"));
  }

  schedule() {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.write(), DELAY);
  }

  /** Returns the hash of the current view. */
  hash() {
    const { session, stage } = this;
    const { camera } = stage;
    const values = new URLSearchParams();
    if (session.world && session.worlds.size > 1) values.set("world", String(session.currentIndex));
    if (!stage.isFitting) {
      const decimals = Math.max(0, Math.ceil(Math.log10(camera.zoom)) + 1);
      values.set("x", camera.x.toFixed(decimals));
      values.set("y", camera.y.toFixed(decimals));
      values.set("zoom", camera.zoom.toPrecision(4));
      if (Math.abs(camera.angle) > 1e-3) values.set("turn", camera.angle.toFixed(3));
    }
    if (stage.followed !== null) values.set("follow", stage.followed);
    if (session.selectedName !== null) values.set("select", session.selectedName);
    const changed = DISPLAYS.filter((display) => session.displays[display] !== this.defaults[display]);
    for (const key of ["show", "hide"]) {
      const names = changed.filter((display) => session.displays[display] === (key === "show"));
      if (names.length > 0) values.set(key, names.join());
    }
    const text = values.toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
    return text ? `#${text}` : "";
  }

  /** Writes the current view into the address without adding an entry to the history. */
  write() {
    window.clearTimeout(this.timer);
    const { pathname, search, hash } = window.location;
    // The user has opened another link, and the browser reports it next.
    if (hash !== this.known) return;
    const written = this.hash();
    if (written === hash) return;
    window.history.replaceState(null, "", `${pathname}${search}${written}`);
    this.known = window.location.hash;
  }
}
