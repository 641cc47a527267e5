// The strip at the bottom: the current frame, flagged frames, keys, play.

import * as api from "./api";
import { keyFrames } from "./analysis";
import { flaggedFrames } from "./csv";
import { button, h } from "./dom";
import { store } from "./store";

export const player = {
  running: false,
  toggle(): void {
    this.running = !this.running;
    store.tell("view");
    if (this.running) this.play();
  },
  play(): void {
    const begun = performance.now();
    const from = store.frame;
    const step = () => {
      if (!this.running || !store.shot) return;
      const { fps, frames } = store.shot;
      const passed = Math.floor(((performance.now() - begun) / 1000) * fps);
      store.setFrame((from + passed) % Math.max(1, frames));
      requestAnimationFrame(step);
    };
    step();
  },
};

export function scrubber(): HTMLElement {
  const slide = h("input", { type: "range", min: "0", step: "1", id: "frame", "aria-label": "Frame" });
  const ticks = h("canvas", { className: "ticks", "aria-hidden": "true", height: 10 });
  const count = h("output", { className: "count", htmlFor: "frame" });
  const play = button("Play", () => player.toggle(), { className: "quiet", id: "play" });
  let flagged: number[] = [];
  let keys: number[] = [];
  let versions = "";

  const move = () => {
    slide.value = String(store.frame);
    const shot = store.shot;
    if (shot) count.textContent = `${store.frame} / ${shot.frames - 1}  ${(store.frame / shot.fps).toFixed(2)} s`;
  };
  const mark = () => {
    const frames = store.shot?.frames ?? 1;
    ticks.width = Math.max(1, ticks.clientWidth * devicePixelRatio);
    const context = ticks.getContext("2d")!;
    const at = (t: number) => (t / Math.max(1, frames - 1)) * (ticks.width - 4);
    context.clearRect(0, 0, ticks.width, ticks.height);
    context.fillStyle = "#e06c2b";
    for (const t of flagged) context.fillRect(at(t), 5, 3, 5);
    context.fillStyle = "#3b82f6";
    for (const t of keys) context.fillRect(at(t), 0, 4, 10);
  };
  const look = async () => {
    const shot = store.shot;
    if (!shot) return;
    slide.max = String(Math.max(0, shot.frames - 1));
    move();
    const table = "analysis/silhouettes.csv";
    const now = `${shot.shot} ${shot.files[table] ?? ""} ${shot.files["keys/keys.json"] ?? ""}`;
    if (now !== versions) {
      versions = now;
      flagged = shot.files[table] ? flaggedFrames(await api.text(shot.shot, table)) : [];
      keys = (await keyFrames()).map((k) => k.frame);
    }
    mark();
  };
  slide.addEventListener("input", () => store.setFrame(Number(slide.value)));
  store.on(["frame"], move);
  store.on(["view"], () => (play.textContent = player.running ? "Stop" : "Play"));
  store.on(["shot", "files"], () => void look().catch(() => undefined));
  new ResizeObserver(mark).observe(ticks);
  void look().catch(() => undefined);
  const legend = h("span", { className: "legend hint" }, "blue: keys, orange: flagged");
  return h("footer", { className: "scrubber" }, play, h("div", { className: "track" }, slide, ticks), count, legend);
}
