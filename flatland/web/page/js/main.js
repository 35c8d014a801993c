import { Connection } from "./connection.js";
import { byId, setText } from "./dom.js";
import { Editing } from "./editing.js";
import { Hotkeys } from "./hotkeys.js";
import { Capture } from "./panels/capture.js";
import { createConnectionBadge } from "./panels/connection_badge.js";
import { createDisplays } from "./panels/displays.js";
import { createDriveHint } from "./panels/drive_hint.js";
import { HistoryBar } from "./panels/history_bar.js";
import { Inspector } from "./panels/inspector.js";
import { createModelList } from "./panels/model_list.js";
import { ModelMenu } from "./panels/model_menu.js";
import { createNotices } from "./panels/notices.js";
import { Plots } from "./panels/plots.js";
import { createPoseTools } from "./panels/pose_tools.js";
import { saveWorld } from "./panels/save_world.js";
import { createScaleBar } from "./panels/scale_bar.js";
import { createShare } from "./panels/share.js";
import { SpawnDialog } from "./panels/spawn_dialog.js";
import { createTiles } from "./panels/tiles.js";
import { TimeBar } from "./panels/time_bar.js";
import { createToolbar } from "./panels/toolbar.js";
import { createTopicList } from "./panels/topic_list.js";
import { createTouchTips } from "./panels/touch_tips.js";
import { exposeScripting } from "./scripting.js";
import { Session } from "./session.js";
import { Stage } from "./stage.js";
import { connectTheme, isDark } from "./theme.js";
import { Drive } from "./tools/drive.js";
import { MeasureTool } from "./tools/measure_tool.js";
import { PanTool } from "./tools/pan_tool.js";
import { PointerInput } from "./tools/pointer.js";
import { PoseTool } from "./tools/pose_tool.js";
import { SelectTool } from "./tools/select_tool.js";
import { SpawnTool } from "./tools/spawn_tool.js";
import { createStick } from "./tools/stick.js";
import { ToolBox } from "./tools/tool_box.js";
import { redo, undo } from "./undo.js";
import { ViewLink } from "./view_link.js";

/** Returns the address of the WebSocket of the server that sent the page. */
function socketAddress() {
  const address = new URL("ws", window.location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = window.location.search;
  address.hash = "";
  return address.href;
}

const connection = new Connection(socketAddress());
const session = new Session(connection);
const stage = new Stage(byId("canvas", HTMLCanvasElement), session, isDark());

const selectTool = new SelectTool(session, stage);
const spawnTool = new SpawnTool(session, stage);
const goalTool = new PoseTool(session, stage, "goal", "Goal");
const initialPoseTool = new PoseTool(session, stage, "initial_pose", "Initial pose");
const tools = new ToolBox({
  select: selectTool,
  pan: new PanTool(),
  measure: new MeasureTool(stage),
  spawn: spawnTool,
  goal: goalTool,
  initial_pose: initialPoseTool,
});
const drive = new Drive(session);

/** Returns the position of the mouse in the view, else the centre of the view. */
function pastePlace() {
  const { px, py } = pointer.hovered ?? hotkeys.center();
  const [x, y] = stage.camera.toWorld(px, py);
  return { x, y };
}

const editing = new Editing(session, pastePlace);

async function deleteSelected() {
  if (await editing.deleteSelected()) stage.canvas.focus();
}

function toggleFollow() {
  stage.follow(stage.followed === null ? session.selectedName : null);
}

const timeBar = new TimeBar(session);
const plots = new Plots(session, isDark);
const spawnDialog = new SpawnDialog(session, tools, spawnTool);
const menu = new ModelMenu();
const help = byId("help-dialog", HTMLDialogElement);

function openHelp() {
  hotkeys.createHelp();
  help.showModal();
}

const hotkeys = new Hotkeys(stage, session, tools, drive, {
  togglePause: () => timeBar.togglePause(),
  step: () => timeBar.step(),
  openSpawn: () => spawnDialog.open(),
  deleteSelected,
  copy: () => editing.copy(),
  paste: () => void editing.paste(),
  undo: () => void undo(session),
  redo: () => void redo(session),
  toggleFollow,
  togglePlots: () => plots.toggle(),
  showAll: () => session.worlds.size > 1 && session.show(null),
  openHelp,
});
byId("help").addEventListener("click", openHelp);

const pointer = new PointerInput(stage, session, tools, (spot, event) => {
  const model = selectTool.modelUnder(spot);
  if (model) session.select(model.name);
  const items = model ? modelItems(model) : [];
  if (!session.readOnly) {
    if (editing.copied) items.push({ text: "Paste", icon: "paste", run: () => void editing.paste(spot) });
    if (!model) items.push({ text: "Save world…", icon: "save", run: () => void saveWorld(session) });
  }
  if (items.length > 0) menu.open(event.clientX, event.clientY, items, stage.canvas);
});

/**
 * Returns the menu items of a model.
 *
 * @param {import("./world_state.js").Model} model
 */
function modelItems(model) {
  const pose = session.world?.modelPose(model);
  /** @type {import("./panels/model_menu.js").Item[]} */
  const items = [
    { text: "Centre", icon: "center", run: () => void (pose && stage.centerOn(pose[0], pose[1])) },
    { text: "Follow", icon: "follow", run: () => stage.follow(model.name) },
  ];
  if (!session.readOnly) {
    items.push({ text: "Copy", icon: "copy", run: () => editing.copy() });
    items.push({ text: "Delete", icon: "delete", run: () => void deleteSelected() });
  }
  return items;
}

stage.overlay = (batch, labels, viewport, palette) => {
  selectTool.draw(batch, labels, viewport, palette);
  if (tools.name !== "select") tools.active.draw(batch, labels, viewport, palette);
  hotkeys.drawAim(batch, viewport, palette);
};

createNotices(session);
new HistoryBar(session);
byId("undo").addEventListener("click", () => void undo(session));
byId("reset").addEventListener("click", () => void editing.reset());
byId("save-world").addEventListener("click", () => void saveWorld(session));
createConnectionBadge(session, stage);
createModelList(session, stage);
createDisplays(session);
createTopicList(session, (name) => {
  plots.setOpen(true);
  plots.add(name);
});
createPoseTools(session, tools, { "tool-goal": goalTool, "tool-initial-pose": initialPoseTool });
new Inspector(session, stage, { deleteSelected, plot: (name) => plots.show(name) });
new Capture(stage, session);
createTiles(session, stage);
createScaleBar(session, stage);
createStick(session, drive);
createDriveHint(session, drive);
createTouchTips();
createToolbar(session, stage, tools, { toggleFollow, zoomIn: hotkeys.zoomIn, zoomOut: hotkeys.zoomOut });
connectTheme((dark) => {
  stage.setTheme(dark);
  plots.setTheme(dark);
});
createShare(session, new ViewLink(session, stage));
exposeScripting(session, stage);

document.addEventListener("visibilitychange", () => session.setHidden(document.hidden));
// The browser may keep a page that the user has left, with its connection, for a later return.
window.addEventListener("pagehide", () => connection.close());
window.addEventListener("pageshow", () => connection.open());
window.addEventListener("online", () => connection.open());
session.on("current", () => tools.use("select"));
setText(byId("title"), session.title);
connection.open();
