// The keyboard.

import { button, h } from "./dom";
import { pen } from "./paint";
import { store, type Step } from "./store";
import { player } from "./scrubber";

export const STEPS: [Step, string][] = [
  ["footage", "Footage"],
  ["paint", "Paint"],
  ["analysis", "Analysis"],
  ["keys", "Keys"],
  ["poses", "Poses"],
  ["result", "Result"],
];

const LIST: [string, string][] = [
  ["← →", "one frame back, forward (also , and .)"],
  ["Shift ← →", "ten frames"],
  ["Home, End", "first, last frame"],
  ["Space", "play, stop"],
  ["1 … 6", "the steps, Footage to Result"],
  ["M", "mask on, off"],
  ["O", "onion skin"],
  ["A, B, E", "ink: animal, background, eraser"],
  ["[ ]", "thinner, thicker pen"],
  ["C", "copy from the frame before"],
  ["Enter, Escape", "end a polyline, give it up"],
  ["Ctrl Z, Ctrl Shift Z", "undo, redo"],
  ["Wheel", "scrub; with Ctrl zoom"],
  ["Alt or middle drag", "move the picture"],
  ["Two fingers", "zoom and move the picture"],
  ["?", "this list"],
];

export function showShortcuts(): void {
  const dialog = h(
    "dialog",
    { "aria-label": "Keyboard shortcuts" },
    h("h2", {}, "Keyboard shortcuts"),
    h("dl", { className: "shortcuts" }, ...LIST.flatMap(([keys, what]) => [h("dt", {}, keys), h("dd", {}, what)])),
    h(
      "div",
      { className: "row" },
      button("Close", () => dialog.close()),
    ),
  );
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

let maskOpacity = 0.45;

function toggleMask(): void {
  const now = store.view.maskOpacity;
  if (now > 0) maskOpacity = now;
  store.setView({ maskOpacity: now > 0 ? 0 : maskOpacity });
}

export function listenToKeys(go: (step: Step) => void): void {
  document.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    if (document.querySelector("dialog[open]")) return;
    const kind = target instanceof HTMLInputElement ? target.type : "";
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) && kind !== "checkbox";
    if (event.key === "?" && (!typing || kind === "range")) return showShortcuts();
    if (!store.shot) return;
    const command = event.ctrlKey || event.metaKey;
    const writes = kind === "text" || kind === "number";
    if (command && !writes && /^[zy]$/i.test(event.key)) {
      event.preventDefault();
      return event.shiftKey || event.key.toLowerCase() === "y" ? pen.redo() : pen.undo();
    }
    if (typing || command || event.altKey) return;
    const by = event.shiftKey ? 10 : 1;
    const acts: Record<string, () => void> = {
      ArrowLeft: () => store.setFrame(store.frame - by),
      ArrowRight: () => store.setFrame(store.frame + by),
      ",": () => store.setFrame(store.frame - 1),
      ".": () => store.setFrame(store.frame + 1),
      Home: () => store.setFrame(0),
      End: () => store.setFrame(Infinity),
      m: toggleMask,
      o: () => store.setView({ onion: !store.view.onion }),
      a: () => pen.ink("animal"),
      b: () => pen.ink("background"),
      e: () => pen.ink("eraser"),
      "[": () => pen.resize(0.8),
      "]": () => pen.resize(1.25),
      c: () => pen.copy(),
    };
    // A focused button, link or checkbox takes space and enter itself.
    if (!/^(BUTTON|A|INPUT)$/.test(target.tagName)) {
      acts[" "] = () => player.toggle();
      acts["Enter"] = pen.end;
    }
    acts["Escape"] = pen.cancel;
    STEPS.forEach(([step], at) => (acts[String(at + 1)] = () => go(step)));
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (act) {
      event.preventDefault();
      act();
    }
  });
}
