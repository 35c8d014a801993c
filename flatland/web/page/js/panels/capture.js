import { byId, saveFile, setPressed, setText } from "../dom.js";

const FRAME_RATE = 30;
const BIT_RATE = 8_000_000;
const FORMATS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

/** Saves pictures and videos of the canvas. */
export class Capture {
  /**
   * @param {import("../stage.js").Stage} stage
   * @param {import("../session.js").Session} session
   */
  constructor(stage, session) {
    this.stage = stage;
    this.session = session;
    this.button = byId("record");
    /** @type {MediaRecorder | null} */
    this.recorder = null;
    byId("screenshot").addEventListener("click", () => this.saveScreenshot());
    this.button.addEventListener("click", () => this.toggleRecording());
  }

  /** @param {string} extension */
  fileName(extension) {
    const name = (this.session.world?.name || "worlds").replace(/[^\w.-]+/g, "_");
    const time = new Date().toISOString().slice(0, 19).replaceAll(":", "-");
    return `flatland-${name}-${time}.${extension}`;
  }

  saveScreenshot() {
    // Drawn in the same task, because the browser clears the canvas at its end.
    this.stage.draw();
    this.stage.canvas.toBlob((blob) => {
      if (!blob) {
        this.session.notify("error", "The browser cannot create a picture of the view");
        return;
      }
      saveFile(blob, this.fileName("png"));
      this.session.notify("info", "Screenshot saved");
    }, "image/png");
  }

  toggleRecording() {
    if (this.recorder) this.recorder.stop();
    else this.startRecording();
  }

  startRecording() {
    const format = FORMATS.find((each) => window.MediaRecorder?.isTypeSupported(each));
    if (!format) {
      this.session.notify("error", "This browser cannot record WebM videos");
      return;
    }
    const stream = this.stage.canvas.captureStream(FRAME_RATE);
    const recorder = new MediaRecorder(stream, { mimeType: format, videoBitsPerSecond: BIT_RATE });
    const name = this.fileName("webm");
    /** @type {Blob[]} */
    const parts = [];
    recorder.ondataavailable = (event) => parts.push(event.data);
    recorder.onerror = () => this.session.notify("error", "The recording failed");
    recorder.onstop = () => {
      this.recorder = null;
      for (const track of stream.getTracks()) track.stop();
      this.showState(false);
      saveFile(new Blob(parts, { type: "video/webm" }), name);
      this.session.notify("info", `Recording saved as ${name}`);
    };
    recorder.start(1000);
    this.recorder = recorder;
    this.showState(true);
    // The video of a paused world has only this frame, because nothing else changes the canvas.
    this.stage.invalidate();
    this.session.notify("info", "Recording; the same menu stops it");
  }

  /** @param {boolean} isRecording */
  showState(isRecording) {
    setPressed(this.button, isRecording);
    setText(byId("record-text"), isRecording ? "Stop recording" : "Record a video");
  }
}
