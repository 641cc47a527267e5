// The strip at the bottom: the current frame, flagged frames, keys, play.

import * as api from "./api";
import { flaggedFrames } from "./csv";
import { button, h } from "./dom";
import { keysVersion, readKeys } from "./keyfile";
import { store } from "./store";
import { scrubByWheel } from "./viewer";

/** The colours of the marks, as in the style sheet. */
const FLAG = "#e06c2b";
const KEY = "#3b82f6";

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

/** The strip; `end` takes it off the shot's events. */
export function scrubber(): { element: HTMLElement; end: () => void } {
  const slide = h("input", { type: "range", min: "0", step: "1", id: "frame", "aria-label": "Frame" });
  const ticks = h("canvas", { className: "ticks", "aria-hidden": "true", height: 10 });
  const count = h("output", { className: "count", htmlFor: "frame" });
  const play = button("▶", () => player.toggle(), {
    className: "play",
    id: "play",
    "aria-label": "Play",
    title: "Play (Space)",
  });
  const step = (by: number, sign: string, words: string) =>
    button(sign, () => store.setFrame(store.frame + by), {
      className: "quiet step-one",
      "aria-label": words,
      title: words,
    });
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
    context.fillStyle = FLAG;
    for (const t of flagged) context.fillRect(at(t), 5, 3, 5);
    context.fillStyle = KEY;
    for (const t of keys) context.fillRect(at(t), 0, 4, 10);
  };
  const look = async () => {
    const shot = store.shot;
    if (!shot) return;
    slide.max = String(Math.max(0, shot.frames - 1));
    move();
    const table = "analysis/silhouettes.csv";
    const now = `${shot.shot} ${shot.files[table] ?? ""} ${keysVersion()}`;
    if (now !== versions) {
      versions = now;
      flagged = shot.files[table] ? flaggedFrames(await api.text(shot.shot, table)) : [];
      keys = (await readKeys())?.keys.map((k) => k.frame) ?? [];
    }
    mark();
  };
  const running = () => {
    play.textContent = player.running ? "❚❚" : "▶";
    play.setAttribute("aria-label", player.running ? "Stop" : "Play");
  };
  slide.addEventListener("input", () => store.setFrame(Number(slide.value)));
  const observer = new ResizeObserver(mark);
  observer.observe(ticks);
  const again = () => void look().catch(() => undefined);
  const ends = [
    store.on(["frame"], move),
    store.on(["view"], running),
    store.on(["shot", "files"], again),
    () => observer.disconnect(),
  ];
  again();
  const legend = h(
    "span",
    { className: "legend hint" },
    h("i", { className: "mark key-mark" }),
    "keys",
    h("i", { className: "mark flag-mark" }),
    "flagged",
  );
  const element = h(
    "footer",
    { className: "scrubber" },
    step(-1, "‹", "One frame back"),
    play,
    step(1, "›", "One frame on"),
    h("div", { className: "track" }, slide, ticks),
    count,
    legend,
  );
  element.addEventListener("wheel", scrubByWheel, { passive: false });
  const end = () => {
    player.running = false;
    ends.forEach((act) => act());
  };
  return { element, end };
}
