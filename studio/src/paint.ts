// Paint: strokes over the footage, repainted masks, whole sketches.

import { button, checkbox, fill, group, h, percent, slider } from "./dom";
import { saveAll } from "./drawing";
import { Painter, SIZES, setting, type Ink, type Shape, type What } from "./painter";
import { attempt } from "./say";
import { maskView, segment } from "./silhouettes";
import { store } from "./store";
import { Viewer } from "./viewer";

let painter: Painter | null = null;

/** For shortcuts: what the pen can be told from the keyboard. */
export const pen = {
  undo: () => painter?.drawing.undo(),
  redo: () => painter?.drawing.redo(),
  end: () => painter?.endPolyline(),
  cancel: () => painter?.cancel(),
  ink: (ink: Ink) => {
    setting.ink = ink === "eraser" && setting.what === "mask" ? "background" : ink;
    store.tell("view");
  },
  resize: (factor: number) => {
    const size = Math.round(setting.size * factor + Math.sign(factor - 1));
    setting.size = Math.min(SIZES.max, Math.max(SIZES.min, size));
    store.tell("view");
  },
  copy: () => painter && attempt(painter.copyPrevious.bind(painter)),
};

const INKS: [Ink, string][] = [
  ["animal", "Animal"],
  ["background", "Background"],
  ["eraser", "Eraser"],
];
const SHAPES: [Shape, string][] = [
  ["brush", "Brush"],
  ["line", "Line"],
  ["polyline", "Polyline"],
];

/** Buttons of which one is pressed. */
function choose<Value extends string>(
  label: string,
  all: [Value, string][],
  now: Value,
  change: (v: Value) => void,
): HTMLElement {
  return group(
    label,
    ...all.map(([value, text]) =>
      button(text, () => change(value), { "aria-pressed": String(value === now), className: `pick ${value}` }),
    ),
  );
}

export function paint(main: HTMLElement, inspector: HTMLElement): () => void {
  const viewer = new Viewer();
  const { source } = store.opened.settings;
  const sketching = store.opened.footage && !(source.foreground && source.background);
  const dimBefore = store.view.dim;
  store.setView({ dim: sketching ? 0.6 : 0 });
  const own = new Painter(viewer.redraw);
  painter = own;
  viewer.tool = own;
  viewer.showMask = setting.what === "strokes";
  main.append(viewer.element);

  const turn = () => {
    own.turn();
    viewer.showMask = setting.what === "strokes";
    viewer.redraw();
  };
  const draw = () => {
    const inks = setting.what === "mask" ? INKS.slice(0, 2) : INKS;
    fill(
      inspector,
      h("h2", {}, "Paint"),
      h("p", { className: "lead" }, lead(sketching)),
      choose<What>(
        "Draw on",
        [
          ["strokes", "Strokes"],
          ["mask", "Mask"],
        ],
        setting.what,
        (v) => {
          setting.what = v;
          if (v === "mask" && setting.ink === "eraser") setting.ink = "background";
          turn();
          draw();
        },
      ),
      choose("Ink", inks, setting.ink, pen.ink),
      choose("Pen", SHAPES, setting.shape, (v) => {
        own.endPolyline();
        setting.shape = v;
        draw();
      }),
      setting.shape === "polyline"
        ? h(
            "div",
            { className: "row" },
            button("End the line", () => own.endPolyline()),
            h("span", { className: "hint" }, "or a double click"),
          )
        : null,
      slider(
        "Size",
        setting.size,
        { ...SIZES, step: 1 },
        (v) => {
          setting.size = v;
          viewer.redraw();
        },
        (v) => `${v} px`,
      ),
      checkbox("Pen pressure changes the size", setting.pressure, (v) => (setting.pressure = v)),
      h(
        "div",
        { className: "row four" },
        button("Undo", pen.undo),
        button("Redo", pen.redo),
        button("Clear", () => own.drawing.wipe()),
        button("Copy previous", () => pen.copy(), { title: "What is drawn on the frame before" }),
      ),
      button(
        "Find silhouettes",
        () =>
          attempt(async () => {
            await saveAll();
            await segment();
            turn();
          }),
        { className: "main", id: "segment", disabled: store.job !== null },
      ),
      h("h3", {}, "View"),
      slider(
        "Dim the footage",
        store.view.dim,
        { min: 0, max: 0.95, step: 0.05 },
        (v) => store.setView({ dim: v }),
        percent,
      ),
      ...maskView(),
    );
  };
  draw();
  const ends = [
    store.on(["frame"], turn),
    store.on(["job"], draw),
    store.on(["files"], () => own.renew()),
    store.on(["view"], () => {
      // A slider that is being moved is not replaced under the finger.
      const held = document.activeElement;
      if (!(inspector.contains(held) && held?.tagName === "INPUT")) draw();
    }),
  ];
  return () => {
    own.endPolyline();
    void own.drawing.save();
    painter = null;
    ends.forEach((act) => act());
    viewer.end();
    store.setView({ dim: dimBefore });
  };
}

function lead(sketching: boolean): string {
  if (sketching)
    return "No rectangles are drawn, so the strokes are the silhouettes: sketch the animal in white on every frame.";
  return setting.what === "strokes"
    ? "A few strokes where the silhouette is wrong. They hold on this frame and teach the frames around it."
    : "Repaint the silhouette itself. It holds on this frame and teaches the frames around it.";
}
