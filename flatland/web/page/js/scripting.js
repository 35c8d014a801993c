/**
 * Read access for scripts and tests: `window.flatland`.
 *
 * @param {import("./session.js").Session} session
 * @param {import("./stage.js").Stage} stage
 */
export function exposeScripting(session, stage) {
  /** @param {import("./world_state.js").WorldState} world */
  const describe = (world) => ({
    world: world.index,
    name: world.name,
    time: world.status?.time ?? 0,
    paused: world.status?.paused ?? null,
    rate: world.status?.rate ?? null,
    edges: world.layers.reduce((sum, { edges }) => sum + (edges?.length ?? 0) / 4, 0),
    layers: world.layers.map(({ name, visible, edges }) => ({
      name,
      visible,
      edges: (edges?.length ?? 0) / 4,
    })),
    models: Object.fromEntries(
      [...world.models.values()].map((model) => [model.name, { id: model.id, pose: world.modelPose(model) }]),
    ),
    scans: [...world.lasers.values()].filter((laser) => laser.ranges !== null).length,
  });
  const api = {
    /** Contents of the worlds, the selection and the connection, as plain values. */
    get state() {
      const worlds = [...session.worlds.values()].map(describe);
      return {
        connection: session.connection.state,
        title: session.title,
        readOnly: session.readOnly,
        current: session.currentIndex,
        selected: session.selectedName,
        followed: stage.followed,
        displays: { ...session.displays },
        view: { x: stage.camera.x, y: stage.camera.y, zoom: stage.camera.zoom, turn: stage.camera.angle },
        worlds,
        models: worlds.find(({ world }) => world === session.currentIndex)?.models ?? {},
      };
    },
    /** Number of frames drawn. */
    get frames() {
      return stage.frames;
    },
    /** Mean processor time of the script in a frame [ms]. */
    get frameCost() {
      return stage.frameCost;
    },
    /**
     * Returns the position of a point on the page [CSS pixels].
     *
     * @param {number} x  [m]
     * @param {number} y  [m]
     */
    toScreen(x, y) {
      const { left, top } = stage.canvas.getBoundingClientRect();
      const [px, py] = stage.camera.toScreen(x, y);
      return [left + px, top + py];
    },
    /**
     * Returns the small view of a world in the grid: left, top, width and height on the page
     * [CSS pixels], null while one world is enlarged.
     *
     * @param {number} index
     */
    tile(index) {
      const found = session.world ? undefined : stage.tiles().find(({ world }) => world.index === index);
      if (!found) return null;
      const { left, top } = stage.canvas.getBoundingClientRect();
      return [left + found.left, top + found.top, found.width, found.height];
    },
    /**
     * Returns the point of the world at a position on the page [m].
     *
     * @param {number} px  [CSS pixels]
     * @param {number} py  [CSS pixels]
     */
    toWorld(px, py) {
      const { left, top } = stage.canvas.getBoundingClientRect();
      return stage.camera.toWorld(px - left, py - top);
    },
  };
  Object.defineProperty(window, "flatland", { value: Object.freeze(api), enumerable: true });
}
