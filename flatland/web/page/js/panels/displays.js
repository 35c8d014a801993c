import { byId, element } from "../dom.js";
import { css } from "../renderer/palette.js";

/**
 * Connects the check boxes of the displays, and creates one for each layer of the map.
 *
 * @param {import("../session.js").Session} session
 */
export function createDisplays(session) {
  /** @type {NodeListOf<HTMLInputElement>} */
  const boxes = document.querySelectorAll("input[data-display]");
  const layerList = byId("layer-list");
  const update = () => {
    for (const box of boxes) {
      box.checked = session.displays[/** @type {import("../session.js").Display} */ (box.dataset.display)];
    }
  };
  for (const box of boxes) {
    box.addEventListener("change", () => {
      session.setDisplay(/** @type {import("../session.js").Display} */ (box.dataset.display), box.checked);
    });
  }

  const updateLayers = () => {
    const layers = session.world?.layers ?? [];
    const legend = /** @type {HTMLElement} */ (layerList.firstElementChild);
    layerList.hidden = layers.length < 2;
    layerList.replaceChildren(
      legend,
      ...layers.map((layer) => {
        const box = element("input", { type: "checkbox" });
        box.checked = layer.visible;
        box.addEventListener("change", () => {
          layer.visible = box.checked;
          session.emit("redraw", undefined);
        });
        const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
        swatch.style.background = css(layer.color);
        return element("label", {}, box, swatch, layer.name);
      }),
    );
  };
  session.on("displays", update);
  session.on("world", updateLayers);
  session.on("current", updateLayers);
  session.on("hello", updateLayers);
  update();
  updateLayers();
}
