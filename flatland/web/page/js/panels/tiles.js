import { byId, element, setText } from "../dom.js";

/**
 * Labels of the small views of several worlds; a click enlarges a view.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 */
export function createTiles(session, stage) {
  const root = byId("tiles");
  const back = byId("all-worlds");

  /** @param {import("../world_state.js").WorldState} world */
  const label = (world) => {
    const name = world.name || `world ${world.index}`;
    return world.status?.paused ? `${name}, paused` : name;
  };
  const arrange = () => {
    if (session.world) return;
    stage.tiles().forEach((tile, i) => {
      const button = root.children[i];
      if (!(button instanceof HTMLElement)) return;
      button.style.left = `${tile.left}px`;
      button.style.top = `${tile.top}px`;
      button.style.width = `${tile.width}px`;
      button.style.height = `${tile.height}px`;
    });
  };
  const rebuild = () => {
    root.hidden = session.world !== null;
    back.hidden = session.world === null || session.worlds.size < 2;
    stage.canvas.tabIndex = session.world ? 0 : -1;
    const name = session.world?.name ?? "";
    setText(byId("world-name"), session.world ? name : `${session.worlds.size} worlds`);
    setText(byId("title"), session.title);
    document.title = name && name !== session.title ? `${name} – ${session.title}` : session.title;
    if (session.world) return;
    root.replaceChildren(
      ...[...session.worlds.values()].map((world) => {
        const button = element(
          "button",
          { type: "button", class: "tile" },
          element("span", {}, label(world)),
        );
        button.addEventListener("click", () => {
          session.show(world.index);
          stage.fit();
          stage.canvas.focus();
        });
        return button;
      }),
    );
    arrange();
  };

  back.addEventListener("click", () => session.show(null));
  session.on("hello", rebuild);
  session.on("current", rebuild);
  session.on("world", rebuild);
  session.on("status", (world) => {
    const index = [...session.worlds.values()].indexOf(world);
    const text = root.children[index]?.firstElementChild;
    if (text && !session.world) setText(text, label(world));
  });
  new ResizeObserver(arrange).observe(stage.canvas);
  rebuild();
}
