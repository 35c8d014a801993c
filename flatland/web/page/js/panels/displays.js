import { byId, element, firstChild } from "../dom.js";
import { css } from "../renderer/palette.js";
import { DISPLAYS } from "../session.js";

/**
 * Connects the check boxes of the displays, and creates a check box for each layer of the map.
 *
 * @param {import("../session.js").Session} session
 */
export function createDisplays(session) {
  for (const display of DISPLAYS) {
    const box = byId(`toggle-${display}`, HTMLInputElement);
    const update = () => {
      box.checked = session.displays[display];
    };
    box.addEventListener("change", () => session.setDisplay(display, box.checked));
    session.on("displays", update);
    update();
  }

  const layerList = byId("layer-list");
  const legend = firstChild(layerList);
  const updateLayers = () => {
    const layers = session.world?.layers ?? [];
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
  session.on("world", updateLayers);
  session.on("current", updateLayers);
  session.on("hello", updateLayers);
  updateLayers();
}
