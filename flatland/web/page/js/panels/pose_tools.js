import { byId, element, setPressed } from "../dom.js";

/**
 * Connects the buttons of the tools that publish poses, and the selection of their topics. They are
 * hidden in programs without topics of other programs.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../tools/tool_box.js").ToolBox} tools
 * @param {Record<"tool-goal" | "tool-initial-pose", import("../tools/pose_tool.js").PoseTool>} poseTools
 *   by the id of the button
 */
export function createPoseTools(session, tools, poseTools) {
  const group = byId("pose-topics");
  const parts = [
    {
      tool: poseTools["tool-goal"],
      button: byId("tool-goal"),
      select: byId("goal-topic", HTMLSelectElement),
    },
    {
      tool: poseTools["tool-initial-pose"],
      button: byId("tool-initial-pose"),
      select: byId("initial-pose-topic", HTMLSelectElement),
    },
  ];
  const updateTools = () => {
    for (const { tool, button } of parts) setPressed(button, tools.active === tool);
  };
  const update = () => {
    const isHidden = session.topics.entries === null || session.readOnly;
    group.hidden = isHidden;
    for (const { tool, button, select } of parts) {
      button.hidden = isHidden;
      const topics = session.topics.poseTopics[tool.purpose] ?? [];
      if (select.dataset.key === topics.join()) continue;
      select.dataset.key = topics.join();
      const first = element("option", { value: "" }, "of the selected model");
      select.replaceChildren(first, ...topics.map((topic) => element("option", { value: topic }, topic)));
      select.value = topics.includes(tool.chosenTopic) ? tool.chosenTopic : "";
    }
    if (isHidden && parts.some(({ tool }) => tools.active === tool)) tools.use("select");
  };
  for (const { tool, button, select } of parts) {
    button.addEventListener("click", () => tools.use(tools.active === tool ? "select" : tool.purpose));
    select.addEventListener("change", () => {
      tool.chosenTopic = select.value;
      tools.updateHint();
    });
    tool.onDone = () => tools.use("select");
  }
  tools.on("change", updateTools);
  session.topics.on("list", update);
  session.on("hello", update);
  session.on("selection", () => tools.updateHint());
  update();
}
