import { byId, setText } from "../dom.js";
import { significant } from "../format.js";

const WIDEST = 120;

/**
 * Shows the scale of the view.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 */
export function createScaleBar(session, stage) {
  const bar = byId("scale");
  const text = byId("scale-text");
  let shownZoom = 0;
  stage.on("frame", () => {
    bar.hidden = session.world === null;
    const { zoom } = stage.camera;
    if (zoom === shownZoom) return;
    shownZoom = zoom;
    const longest = WIDEST / zoom;
    const power = 10 ** Math.floor(Math.log10(longest));
    const length = [5, 2, 1].map((factor) => factor * power).find((each) => each <= longest) ?? power;
    bar.style.width = `${length * zoom}px`;
    setText(text, length < 1 ? `${significant(length * 100)} cm` : `${significant(length)} m`);
  });
}
